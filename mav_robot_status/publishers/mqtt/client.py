"""The paho client of one connection: create, connect, close; and in words why a broker fails, with a remedy."""

from __future__ import annotations

import socket
import ssl
from typing import Any, Final, NamedTuple

from paho.mqtt.client import Client
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.reasoncodes import ReasonCode

from .settings import VERSIONS, Broker

MOST_IN_FLIGHT: Final = 10
"""The limit on publications without an acknowledgement. Further ones wait in the client. HiveMQ allows 10, mosquitto
20."""
OTHER: Final = "does another gateway publish the same robot there (--mqtt-robot gives each its own name)"
"""The usual reason why a broker closes a connection. mosquitto does not give it."""
REFUSALS: Final = {
    "Unsupported protocol version": "it does not speak this version of MQTT: try --mqtt-version 3.1.1",
    "Bad user name or password": "wrong user or password",
    "Not authorized": "this user, password or certificate is not authorized",
    "Session taken over": f"another client has the same client id; {OTHER}?",
}
"""The messages for the reason codes of a broker."""


class Will(NamedTuple):
    """The message that the broker publishes if the connection breaks."""

    topic: str
    text: str


def make(broker: Broker, ident: str, will: Will | None) -> Client:
    """A client without callbacks that is not connected yet."""
    client = Client(
        CallbackAPIVersion.VERSION2,
        ident,
        clean_session=None if broker.version == "5" else True,
        protocol=VERSIONS[broker.version],  # type: ignore[arg-type]
        reconnect_on_failure=False,
    )
    client.max_inflight_messages_set(MOST_IN_FLIGHT)
    if broker.tls is not None:
        client.tls_set_context(broker.tls)
    if broker.user is not None:
        client.username_pw_set(broker.user, broker.password)
    if will is not None:
        client.will_set(will.topic, will.text, 1, True)
    return client


def dial(client: Client, broker: Broker) -> str | None:
    """Open the connection. This may block for long. Return the reason of a failure, or None."""
    try:
        client.connect(broker.host, broker.port, broker.keepalive)
        sock: Any = client.socket()
        if sock is not None:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, broker.keepalive * 1000)
    except Exception as error:  # network errors, and whatever paho raises for an invalid answer
        return unreachable(error)
    return None


def shut(client: Client) -> None:
    """Close the socket without a DISCONNECT."""
    sock = client.socket()
    if sock is not None:
        sock.close()


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
