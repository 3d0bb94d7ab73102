"""A client of paho's as a connection needs it: made for a broker, opened, shut."""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from paho.mqtt.client import Client
from paho.mqtt.enums import CallbackAPIVersion

from .complaints import unreachable
from .options import VERSIONS

if TYPE_CHECKING:
    from .options import Broker

MOST_IN_FLIGHT: Final = 10
"""Publications that the broker has not acknowledged, at most; what is more waits in the client. Brokers allow 10 at the
least (HiveMQ), mosquitto 20."""


class Will(NamedTuple):
    """What the broker says for us when we are gone."""

    topic: str
    text: str


def make(broker: Broker, ident: str, will: Will | None) -> Client:
    """A client that is not connected yet, and calls nobody."""
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
    """Open the connection, which may take long; why it cannot be."""
    try:
        client.connect(broker.host, broker.port, broker.keepalive)
        sock: Any = client.socket()
        if sock is not None:
            sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, broker.keepalive * 1000)
    except Exception as error:  # the network's, and whatever paho raises for an answer that is none
        return unreachable(error)
    return None


def shut(client: Client) -> None:
    """End it as if the line were cut."""
    sock = client.socket()
    if sock is not None:
        sock.close()
