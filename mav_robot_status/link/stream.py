"""What connections without message boundaries have in common: TCP, client and server, and serial devices."""

from __future__ import annotations

import errno
import itertools
import math
import os
import select
from abc import ABC, abstractmethod

from mav_robot_status.link.base import Address, Received
from mav_robot_status.link.retry import Backoff, Changes

CHUNK = 1 << 13
"""Bytes that one read takes at most."""
STEADY = 2.0
"""Seconds that a connection has to last before it counts as a success: the next wait is short again, and its loss is
told. A peer that accepts and closes again and again neither fills the log nor is asked five times a second."""


class Stream:
    """One connection: an open, non-blocking descriptor, watched in the epoll of its link."""

    def __init__(self, epoll: select.epoll, descriptor: int, address: Address) -> None:
        self.address = address
        self._epoll = epoll
        self._descriptor = descriptor
        self._rest = b""
        epoll.register(descriptor, select.EPOLLIN)

    def read(self) -> Received:
        """What is there. Raises BlockingIOError if nothing is, OSError if the connection is broken or closed."""
        if self._rest:
            self._flush()
        data = os.read(self._descriptor, CHUNK)
        if not data:
            raise OSError(errno.ENOTCONN, "closed by the other end")
        return Received(data, self.address)

    def write(self, data: bytes) -> bool:
        """Send; False if there is no room. Raises OSError if the connection is broken.

        What the system takes only a part of counts as sent: the rest follows when there is room, before anything else.
        """
        if self._rest and not self._flush():
            return False
        try:
            taken = os.write(self._descriptor, data)
        except BlockingIOError:
            return False
        if taken < len(data):
            self._rest = data[taken:]
            self._epoll.modify(self._descriptor, select.EPOLLIN | select.EPOLLOUT)
        return True

    def detach(self) -> None:
        """Watch it no longer. The descriptor is closed by whoever opened it."""
        self._epoll.unregister(self._descriptor)

    def _flush(self) -> bool:
        try:
            self._rest = self._rest[os.write(self._descriptor, self._rest) :]
        except BlockingIOError:
            return False
        if not self._rest:
            self._epoll.modify(self._descriptor, select.EPOLLIN)
        return not self._rest


class Reconnecting(ABC):
    """A link with one connection, which is made again whenever it is lost."""

    stream = True
    seeking = "connecting to"
    """What is done while there is no connection, for the log."""

    def __init__(self, text: str, where: str, backoff: Backoff, changes: Changes) -> None:
        """Nothing is connected yet; `where` is the other end, in words."""
        self.text = text
        self.dropped = 0
        self._where = where
        self._backoff = backoff
        self._changes = changes
        self._epoll = select.epoll()
        self._stream: Stream | None = None
        self._steady = False
        self._flaps = False
        """Whether the last connection did not last, and no attempt has failed since."""
        self._lost = False
        """Whether a connection was lost since `service` was last here."""
        self._numbers = itertools.count(1)
        self._due = -math.inf

    @abstractmethod
    def _connect(self, now: float) -> None:
        """Go on connecting: ends in `_connected` or `_retry`, or sets `_due` to when to go on."""

    @abstractmethod
    def _release(self) -> None:
        """Close what is open, if anything is."""

    def fileno(self) -> int:
        """The descriptor of the epoll; -1 once closed."""
        return -1 if self._epoll.closed else self._epoll.fileno()

    def receive(self, limit: int = 64) -> list[Received]:
        """What is waiting; each connection has a `source` of its own."""
        pieces: list[Received] = []
        if self._stream is None:
            return pieces
        try:
            while len(pieces) < limit:
                pieces.append(self._stream.read())
                if len(pieces[-1].data) < CHUNK:
                    break
        except BlockingIOError:
            pass
        except OSError as error:
            self._lose(error)
        return pieces

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send to the other end, whatever `to` says: there is only one. False if it was not sent."""
        try:
            if self._stream is not None and self._stream.write(data):
                return True
        except OSError as error:
            self._lose(error)
        self.dropped += 1
        return False

    def due(self) -> float:
        """When `service` has something to do."""
        return self._due

    def service(self, now: float) -> None:
        """Connect; see whether a connection lasts; wait after a loss."""
        if now < self._due:
            return
        self._due = math.inf
        if self._lost:
            self._lost = False
            self._due = self._backoff.after(now)
        elif self._stream is None:
            self._connect(now)
        else:
            self._steady = True
            self._flaps = False
            self._backoff.reset()
            self._changes.good(f"connected to {self._where}")

    def close(self) -> None:
        """Let go of the connection."""
        self._drop()
        self._due = math.inf
        self._epoll.close()

    def _connected(self, descriptor: int, now: float) -> None:
        self._stream = Stream(self._epoll, descriptor, (self._where, next(self._numbers)))
        self._steady = False
        self._due = now + STEADY
        if not self._flaps:
            self._changes.good(f"connected to {self._where}")

    def _retry(self, why: str, now: float) -> None:
        """Connecting failed: say why, once, and wait."""
        self._flaps = False
        self._changes.bad(f"{self.seeking} {self._where}: {why}, trying again")
        self._due = self._backoff.after(now)

    def _lose(self, error: OSError) -> None:
        """The connection is broken. How long to wait is for `service` to say, which is told the time."""
        self._drop()
        self._lost = True
        self._due = -math.inf
        if self._steady:
            self._changes.bad(f"lost {self._where}: {self._why(error)}, trying again")
        else:
            self._flaps = True
            self._changes.bad(f"{self.seeking} {self._where}: {self._why(error)} soon after connecting, trying again")

    def _why(self, error: OSError) -> str:
        """In words, why a connection was lost."""
        return reason(error)

    def _drop(self) -> None:
        if self._stream is not None:
            self._stream.detach()
            self._stream = None
        self._release()


def reason(error: OSError) -> str:
    """The system's words, to go on within a line."""
    return (error.strerror or str(error)).lower()
