"""The keys of rmw_zenoh: where a message is published, and the liveliness tokens that show a node and its topics.

Source: https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md. Pure functions.
"""

from __future__ import annotations

import hashlib
import struct
from typing import TYPE_CHECKING, Final

from .diagnostics import NODE
from .transport import Endpoint

if TYPE_CHECKING:
    from .messages import MessageType

SPACE: Final = "@ros2_lv"
QOS: Final = "::,10:,:,:,,"
"""Reliable, volatile, keep the last 10; no deadline, lifespan or liveliness. What is left out is the default."""
SUBSCRIPTION: Final = "MS"
PARTS: Final = 13
"""Parts of a token of a publisher or a subscription."""


def message_key(domain: int, topic: str, kind: MessageType) -> str:
    """Where the messages of a topic are published."""
    return f"{domain}/{topic[1:]}/{kind.dds_name}/{kind.hash}"


def node_token(domain: int, zid: str, namespace: str) -> str:
    """Shows our node in `ros2 node list`."""
    return f"{SPACE}/{domain}/{zid}/0/0/NN/%/{_mangled(namespace)}/{NODE}"


def publisher_token(domain: int, zid: str, namespace: str, number: int, topic: str, kind: MessageType) -> str:
    """Shows a topic in `ros2 topic list`. `number` is unique in the session, and 0 is the node."""
    node = f"{SPACE}/{domain}/{zid}/0/{number}/MP/%/{_mangled(namespace)}/{NODE}"
    return f"{node}/{_mangled(topic)}/{kind.dds_name}/{kind.hash}/{QOS}"


def gid(token: str) -> bytes:
    """The 16 bytes that identify a publisher."""
    return hashlib.sha256(token.encode()).digest()[:16]


def attachment(sequence: int, unix_ns: int, publisher: bytes) -> bytes:
    """What rmw_zenoh expects beside a message: its number from 1, its time, and the publisher's gid with its length."""
    return struct.pack("<qqB", sequence, unix_ns, len(publisher)) + publisher


def subscriptions(domain: str = "*") -> str:
    """Matches the token of each subscription."""
    return f"{SPACE}/{domain}/*/*/*/{SUBSCRIPTION}/**"


def endpoint(token: str) -> Endpoint | None:
    """What the token of a publisher or subscription says; None for any other key, and for one that is no such token."""
    parts = token.split("/")
    if len(parts) != PARTS or parts[0] != SPACE or not (parts[1].isascii() and parts[1].isdigit()):
        return None
    namespace, name, topic, dds_type, type_hash = parts[7:12]
    return Endpoint(int(parts[1][:9]), f"{_plain(namespace)}/{name}", _plain(topic), dds_type, type_hash)


def _mangled(name: str) -> str:
    return name.replace("/", "%") or "%"


def _plain(part: str) -> str:
    """A name without a slash at its end."""
    return part.replace("%", "/").rstrip("/")
