"""What every kind of link can do. A link carries bytes and knows no MAVLink."""

from __future__ import annotations

from collections.abc import Hashable
from typing import NamedTuple, Protocol

Address = Hashable
"""Where bytes came from. A stream that is connected anew has a new address, so that what two connections cut off is
not joined. For `send` it says to whom on a link that has several other ends."""


class Received(NamedTuple):
    """What one read gave: a datagram, or a piece of a stream."""

    data: bytes
    source: Address


class Link(Protocol):
    """One open link. Nothing here blocks, and nothing that the other end does raises.

    Whoever has a link waits for `fileno` and then calls `receive`, and calls `service` when it is `due`.
    """

    text: str
    """What the link is, in words: `listening on 127.0.0.1:14550/udp`."""
    stream: bool
    """True if frames may be cut anywhere (serial, TCP); False for datagrams."""

    @property
    def dropped(self) -> int:
        """What could not be sent, and what the kernel says it dropped on receipt."""

    def fileno(self) -> int:
        """The descriptor to wait on for input; -1 once closed, and while a UDP link waits for a name or an address.

        Otherwise it stays the same until `close`: a link that reconnects, or has several connections, gives that of an
        epoll in which its sockets come and go. Then it may also be readable with nothing to give.
        """

    def receive(self, limit: int = 64) -> list[Received]:
        """What is waiting, at most `limit` pieces; empty if nothing is. With a limit of 1 it does not look for more.

        A connection that turns out to be broken is let go, and `service` is due at once.
        """

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send without waiting; False if it could not be sent (counted in `dropped`). Never sends a part of `data`.

        On a TCP server `to` is one client, None all of them.
        """

    def due(self) -> float:
        """When (monotonic seconds) `service` has something to do; infinite for nothing, -infinite for at once."""

    def service(self, now: float) -> None:
        """Connect, reconnect, give up: what is due at `now` (monotonic seconds)."""

    def close(self) -> None:
        """Let go of the sockets or the device. May be called again."""
