"""The interface of a link. A link carries bytes and knows no MAVLink."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import NamedTuple, Protocol, runtime_checkable

Address = Hashable
"""The source of received bytes. Each connection of a stream has an address of its own, so that the bytes of two
connections are never joined. In `send` the address selects one peer of a link with several."""


class Received(NamedTuple):
    """The result of one read: a datagram, or a piece of a stream."""

    data: bytes
    source: Address


class Dated(NamedTuple):
    """A datagram with the time of its arrival."""

    data: bytes
    source: Address
    stamp: int | None
    """Microseconds since 1970 on the clock of the kernel; None: not known."""


class Link(Protocol):
    """One open link. No method blocks, and no method raises because of the peer.

    The owner of a link waits until `fileno` is readable, then calls `receive`. It calls `service` when that is `due`.
    """

    text: str
    """What the link does, for the log: `listening on 127.0.0.1:14550/udp`."""
    stream: bool
    """True if a read can end within a frame (serial, TCP); False for datagrams."""

    @property
    def dropped(self) -> int:
        """How many sends failed, plus how many received datagrams the kernel has dropped."""

    def fileno(self) -> int:
        """The descriptor to poll for input; -1 after `close`, and while the link has no socket yet.

        Otherwise it stays the same until `close`. A link that reconnects, or has several connections, returns the
        descriptor of an epoll that contains its sockets. Such a descriptor may be readable although no data waits.
        """

    def receive(self, limit: int = 64) -> list[Received]:
        """The pieces that wait, at most `limit`; empty if none does. With a limit of 1 there is only one read.

        If the connection is broken, the link closes it, and `service` is due at once.
        """

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send without waiting; False if that failed, which `dropped` counts. Never sends only a part of `data`.

        On a link with several peers `to` is one of them; None: all peers of a TCP server.
        """

    def due(self) -> float:
        """When `service` has work, in monotonic seconds; infinity: never, -infinity: now."""

    def service(self, now: float) -> None:
        """Do the work that is due at `now` (monotonic seconds): connect, reconnect, time out."""

    def close(self) -> None:
        """Close the sockets or the device. May be called again."""


@runtime_checkable
class ServesClients(Protocol):
    """A link with a limited number of clients, which drops a less important one for a new one."""

    priority: Callable[[Address], int]
    """How important a client is: one of the priorities below. The owner of the link sets it: a link knows no frames."""


IDLE, SPEAKS, STAYS = 0, 1, 2
"""Priorities of a client: no valid frames arrive from it; they do; it keeps its place, for example a vehicle."""


@runtime_checkable
class DatedLink(Protocol):
    """What a link can offer besides `Link`: the arrival times of datagrams that were not read at once."""

    def receive_dated(self, limit: int = 64) -> list[Dated]:
        """As `receive`, with stamps. It takes longer, so it is called only if input may be old."""
