"""Connections without message boundaries: the common part of TCP client, TCP server and serial device."""

from __future__ import annotations

import errno
import math
import os
import select
from abc import ABC, abstractmethod

from mav_robot_status.links.base import Address, Received
from mav_robot_status.links.retry import Backoff, StateLog

CHUNK = 1 << 13
"""The most bytes of one read."""
STABLE_AFTER = 2.0
"""Seconds after which a connection is stable: the next wait is then short again, and a loss is logged. So a peer that
accepts and closes repeatedly neither fills the log nor receives five attempts a second."""


class Stream:
    """One connection: an open, non-blocking descriptor, registered in the epoll of its link."""

    def __init__(self, epoll: select.epoll, descriptor: int, address: Address) -> None:
        self.address = address
        self._epoll = epoll
        self._descriptor = descriptor
        self._rest = b""
        epoll.register(descriptor, select.EPOLLIN)

    def read(self) -> Received:
        """One read. Raises BlockingIOError if nothing waits, OSError if the connection is broken or closed."""
        if self._rest:
            self._flush()
        data = os.read(self._descriptor, CHUNK)
        if not data:
            raise OSError(errno.ENOTCONN, "closed by the other end")
        return Received(data, self.address)

    def write(self, data: bytes) -> bool:
        """Send; False if the send buffer is full. Raises OSError if the connection is broken.

        If the system accepts only a part, this counts as sent: the rest goes out first as soon as the buffer has room.
        """
        if self._rest and not self._flush():
            return False
        try:
            written = os.write(self._descriptor, data)
        except BlockingIOError:
            return False
        if written < len(data):
            self._rest = data[written:]
            self._epoll.modify(self._descriptor, select.EPOLLIN | select.EPOLLOUT)
        return True

    def detach(self) -> None:
        """Remove it from the epoll. The caller closes the descriptor."""
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
    """A link with one connection, which it restores after every loss."""

    stream = True
    attempting = "connecting to"
    """What the link does without a connection, for the log."""

    def __init__(self, text: str, where: str, backoff: Backoff, state_log: StateLog) -> None:
        """Does not connect yet; `where` names the peer in the log."""
        self.text = text
        self.dropped = 0
        self._where = where
        self._backoff = backoff
        self._state_log = state_log
        self._epoll = select.epoll()
        self._stream: Stream | None = None
        self._stable = False
        self._short_lived = False
        """The last connection was lost before it was stable, and no attempt has failed since."""
        self._connection_lost = False
        """A connection was lost since the last `service`."""
        self.connections = 0
        """The connections so far. It tells a new connection from the one before."""
        self._due = -math.inf

    @property
    def connected(self) -> bool:
        """Whether there is a connection."""
        return self._stream is not None

    @abstractmethod
    def _connect(self, now: float) -> None:
        """Continue to connect. Calls `_connected` or `_retry`, or sets `_due` to the time of the next step."""

    @abstractmethod
    def _release(self) -> None:
        """Close the connection, if any."""

    def fileno(self) -> int:
        """The descriptor of the epoll; -1 once closed."""
        return -1 if self._epoll.closed else self._epoll.fileno()

    def receive(self, limit: int = 64) -> list[Received]:
        """The pieces that wait; each connection has a `source` of its own."""
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
            self._disconnect(error)
        return pieces

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send to the only peer; `to` is ignored. False if it was not sent."""
        try:
            if self._stream is not None and self._stream.write(data):
                return True
        except OSError as error:
            self._disconnect(error)
        self.dropped += 1
        return False

    def due(self) -> float:
        """When `service` has work."""
        return self._due

    def service(self, now: float) -> None:
        """Connect; check whether a connection is stable; wait after a loss."""
        if now < self._due:
            return
        self._due = math.inf
        if self._connection_lost:
            self._connection_lost = False
            self._due = self._backoff.after(now)
        elif self._stream is None:
            self._connect(now)
        else:
            self._stable = True
            self._short_lived = False
            self._backoff.reset()
            self._state_log.up(f"connected to {self._where}")

    def reconnect(self) -> None:
        """End the connection, because what it carries is of no use, and connect again after a wait."""
        if self._stream is not None:
            self._drop()
            self._connection_lost, self._due = True, -math.inf

    def close(self) -> None:
        """Close the connection."""
        self._drop()
        self._due = math.inf
        self._epoll.close()

    def _connected(self, descriptor: int, now: float) -> None:
        self.connections += 1
        self._stream = Stream(self._epoll, descriptor, (self._where, self.connections))
        self._stable = False
        self._due = now + STABLE_AFTER
        if not self._short_lived:
            self._state_log.up(f"connected to {self._where}")

    def _retry(self, why: str, now: float) -> None:
        """Connecting failed: log the reason once, and wait."""
        self._short_lived = False
        self._state_log.down(f"{self.attempting} {self._where}: {why}, trying again")
        self._due = self._backoff.after(now)

    def _disconnect(self, error: OSError) -> None:
        """The connection is broken. `service` knows the time, and sets the wait."""
        self._drop()
        self._connection_lost = True
        self._due = -math.inf
        if self._stable:
            self._state_log.down(f"lost {self._where}: {self._why(error)}, trying again")
        else:
            self._short_lived = True
            self._state_log.down(
                f"{self.attempting} {self._where}: {self._why(error)} soon after connecting, trying again"
            )

    def _why(self, error: OSError) -> str:
        """Why a connection was lost, for the log."""
        return reason(error)

    def _drop(self) -> None:
        if self._stream is not None:
            self._stream.detach()
            self._stream = None
        self._release()


def reason(error: OSError) -> str:
    """The error text of the system, in lower case."""
    return (error.strerror or str(error)).lower()
