"""What is wrong with a broker, in words that say what would be right, and told once."""

from __future__ import annotations

import logging
import socket
import ssl
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from paho.mqtt.reasoncodes import ReasonCode

    from .options import Broker

log = logging.getLogger(__name__)

OTHER: Final = "does another gateway publish the same robot there (--mqtt-robot gives each its own name)"
"""What a broker that throws us out most often means; mosquitto does not say it."""
REFUSALS: Final = {
    "Unsupported protocol version": "it does not speak this version of MQTT: try --mqtt-version 3.1.1",
    "Bad user name or password": "wrong user or password",
    "Not authorized": "this user, or password, or certificate may not do what is asked",
    "Session taken over": f"somebody else came under our name; {OTHER}?",
}
"""What a broker's reasons mean here."""


class Complaints:
    """One line for each reason, however many connections have it, until one of them is open again."""

    def __init__(self, broker: Broker) -> None:
        self._broker = broker
        self._told: set[str] = set()
        self._worked = False

    def fails(self, reason: str) -> None:
        """Tell it, once."""
        if reason not in self._told:
            self._told.add(reason)
            log.warning("mqtt: %s: %s; trying again", self._broker.name, reason)

    def opens(self) -> None:
        """Tell the first time, if nothing was wrong before."""
        if not (self._told or self._worked):
            log.info("mqtt: %s: connected", self._broker.name)
        self._worked = True

    def holds(self) -> None:
        """A connection has held for a while: what is wrong later is news."""
        if self._told:
            log.warning("mqtt: %s: connected again", self._broker.name)
            self._told.clear()


def words(code: ReasonCode) -> str:
    """A broker's reason."""
    return REFUSALS.get(str(code), str(code))


def refusal(code: ReasonCode) -> str | None:
    """A broker's reason why not; None if it agrees."""
    return words(code) if code.is_failure else None


def lost(broker: Broker, opened: bool, steady: bool) -> str:
    """Why a connection may have ended of which nobody says it."""
    if steady:
        return "connection lost"
    if opened:
        return f"connection lost soon after it was made; {OTHER}, or may we not publish there?"
    if broker.tls is None:
        return "the broker hangs up before it answers; does it speak TLS, or want a client certificate?"
    return "the broker hangs up before it answers; does it want a client certificate (--mqtt-cert)?"


def unreachable(error: Exception) -> str:
    """Why a connection could not be opened."""
    if isinstance(error, ssl.SSLCertVerificationError):
        told = error.verify_message
        own = "; --mqtt-ca FILE names the authority to believe" if "issuer" in told or "self" in told else ""
        return f"its certificate is not believed: {told}{own}"
    if isinstance(error, ssl.SSLError):
        return f"no TLS with it ({error.reason or error})"
    if isinstance(error, socket.gaierror):
        return "the name is not known"
    if isinstance(error, TimeoutError):
        return "no answer"
    if isinstance(error, ConnectionResetError):  # so early only in the handshake of TLS
        return "the broker hangs up; does it speak TLS on this port?"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return f"{type(error).__name__}: {error}"
