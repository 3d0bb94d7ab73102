"""What every kind of link can do. A link carries bytes and knows no MAVLink."""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple, Protocol

Address = Hashable
"""Where bytes came from or go to on a link that has several other ends; None on a link with just one."""


class Received(NamedTuple):
    """What one read gave: a datagram, or a piece of a stream."""

    data: bytes
    source: Address


class Link(Protocol):
    """One open link. Nothing here blocks, and nothing that the other end does raises."""

    text: str
    """What the link is, in words: `listening on 127.0.0.1:14550/udp`."""
    stream: bool
    """True if frames may be cut anywhere (serial, TCP); False for datagrams."""
    dropped: int
    """What could not be sent, and what the kernel says it dropped on receipt."""

    def fileno(self) -> int:
        """The descriptor to wait on, or -1 while there is none."""

    def receive(self, limit: int = 64) -> list[Received]:
        """All that is waiting, at most `limit` pieces; empty if nothing is."""

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send without waiting; False if it could not be sent (counted in `dropped`)."""

    def close(self) -> None:
        """Let go of the socket or device."""
