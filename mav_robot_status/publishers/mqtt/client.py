"""The paho client of one connection: create, connect, close."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING, Any, Final

from paho.mqtt.client import Client
from paho.mqtt.enums import CallbackAPIVersion

from mav_robot_status.values import NamedTuple

from .reasons import unreachable
from .settings import VERSIONS

if TYPE_CHECKING:
    from .settings import Broker

MOST_IN_FLIGHT: Final = 10
"""The limit on publications without an acknowledgement. Further ones wait in the client. HiveMQ allows 10, mosquitto
20."""


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
