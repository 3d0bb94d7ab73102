"""The reasons why a broker fails, in words that suggest a remedy."""

from __future__ import annotations

import socket
import ssl
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from paho.mqtt.reasoncodes import ReasonCode

    from .settings import Broker

OTHER: Final = "does another gateway publish the same robot there (--mqtt-robot gives each its own name)"
"""The usual reason why a broker closes a connection. mosquitto does not give it."""
REFUSALS: Final = {
    "Unsupported protocol version": "it does not speak this version of MQTT: try --mqtt-version 3.1.1",
    "Bad user name or password": "wrong user or password",
    "Not authorized": "this user, password or certificate is not authorized",
    "Session taken over": f"another client has the same client id; {OTHER}?",
}
"""The messages for the reason codes of a broker."""


def words(code: ReasonCode) -> str:
    """The message for a reason code."""
    return REFUSALS.get(str(code), str(code))


def refusal(code: ReasonCode) -> str | None:
    """The message for a failure; None for a success."""
    return words(code) if code.is_failure else None


def lost(broker: Broker, opened: bool, steady: bool) -> str:
    """The probable reason why a connection ended, if the broker gives none."""
    if steady:
        return "connection lost"
    if opened:
        return f"connection lost soon after it was opened; {OTHER}, or does the broker refuse the topic?"
    if broker.tls is None:
        return "the broker closes the connection without an answer; does it need TLS or a client certificate?"
    return "the broker closes the connection without an answer; does it need a client certificate (--mqtt-cert)?"


def unreachable(error: Exception) -> str:
    """Why a connection could not be opened."""
    if isinstance(error, ssl.SSLCertVerificationError):
        problem = error.verify_message
        remedy = "; --mqtt-ca FILE names a CA to trust" if "issuer" in problem or "self" in problem else ""
        return f"its certificate is not trusted: {problem}{remedy}"
    if isinstance(error, ssl.SSLError):
        return f"the TLS handshake fails ({error.reason or error})"
    if isinstance(error, socket.gaierror):
        return "cannot resolve the name"
    if isinstance(error, TimeoutError):
        return "no answer"
    if isinstance(error, ConnectionResetError):  # this early, only in the TLS handshake
        return "the broker closes the connection; does it use TLS on this port?"
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return f"{type(error).__name__}: {error}"
