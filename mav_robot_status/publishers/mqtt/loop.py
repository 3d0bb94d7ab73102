"""The event loop of all connections, in one thread. A second thread opens connections, because that may block."""

from __future__ import annotations

import contextlib
import queue
import select
import socket
import threading
from collections import deque
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...clock import Instant
    from .connection import Connection

TURN: Final = 1.0  # s between two timer calls of every connection
MOST_DIALS: Final = 16
"""Connections that may be in the queue of the second thread."""


class Loop:
    """Polls all connections. Any thread may call `wake`; only one thread may call the rest."""

    def __init__(self, clock: Callable[[], Instant]) -> None:
        self._clock = clock
        self._connections: list[Connection] = []
        self._poll = select.poll()
        self._watched: dict[int, tuple[Connection, int]] = {}
        """The connection of each descriptor, and its poll events."""
        self._descriptors: dict[Connection, int] = {}
        self._due: deque[Connection] = deque()
        self._wake_read, self._wake_write = socket.socketpair()
        for end in (self._wake_read, self._wake_write):
            end.setblocking(False)
        self._poll.register(self._wake_read, select.POLLIN)
        self._turned_at = float("-inf")
        self._dials: queue.SimpleQueue[tuple[Connection, Callable[[], str | None]] | None] = queue.SimpleQueue()
        self._dialled: queue.SimpleQueue[tuple[Connection, str | None]] = queue.SimpleQueue()
        self._dialling = 0
        self._dialler = threading.Thread(target=self._dial, name="mqtt dial", daemon=True)
        self._dialler.start()

    def add(self, connection: Connection) -> None:
        """Open a connection, and reopen it after each loss."""
        self._connections.append(connection)
        self._turned_at = float("-inf")

    def remove(self, connection: Connection) -> None:
        """Forget a connection that was closed."""
        self.watch(connection)
        self._connections.remove(connection)

    def wake(self) -> None:
        """Make `turn` return soon."""
        with contextlib.suppress(OSError):  # closed, or full of wake-ups
            self._wake_write.send(b"x")

    def turn(self, longest: float = TURN) -> None:
        """Wait for events, at most `longest` seconds, and handle them."""
        for fd, event in self._poll.poll(max(0.0, longest) * 1000):
            if fd == self._wake_read.fileno():
                with contextlib.suppress(BlockingIOError):
                    while self._wake_read.recv(4096):
                        pass
            elif fd in self._watched:
                self._serve(fd, event)
        now = self._clock().mono
        while not self._dialled.empty():
            connection, reason = self._dialled.get()
            self._dialling -= 1
            connection.dialled(reason, now)
            self.watch(connection)
        if now - self._turned_at >= TURN:
            self._turned_at = now
            for connection in self._connections:
                connection.turn(now)
                self.watch(connection)
            self._due = deque(connection for connection in self._connections if connection.due(now))
        self._begin_dials(now)

    def watch(self, connection: Connection) -> None:
        """Update the poll events of a connection. Call this after each write outside of its callbacks."""
        sock: Any = connection.socket
        new = -1 if sock is None else sock.fileno()
        old = self._descriptors.get(connection, -1)
        if old != new and old >= 0:
            del self._descriptors[connection]
            if self._watched[old][0] is connection:  # otherwise another connection has the descriptor now
                del self._watched[old]
                with contextlib.suppress(KeyError, OSError):
                    self._poll.unregister(old)
        if new < 0:
            return
        wanted = (connection, select.POLLIN | (select.POLLOUT if connection.wants_write else 0))
        if self._watched.get(new) != wanted:
            self._watched[new] = wanted
            self._descriptors[connection] = new
            self._poll.register(new, wanted[1])

    def close(self) -> None:
        """Release the thread and the sockets. The owners close the connections."""
        self._dials.put(None)
        self._dialler.join(0.2)  # a thread that is opening a connection ends after that
        self._wake_read.close()
        self._wake_write.close()

    def _serve(self, fd: int, event: int) -> None:
        connection, _ = self._watched[fd]
        now = self._clock().mono
        if event & ~select.POLLOUT:
            connection.readable(now)
        if event & select.POLLOUT:
            connection.writable(now)
        self.watch(connection)

    def _begin_dials(self, now: float) -> None:
        while self._due and self._dialling < MOST_DIALS:
            connection = self._due.popleft()
            if connection.due(now):
                self._dialling += 1
                self._dials.put((connection, connection.dial()))

    def _dial(self) -> None:
        while (request := self._dials.get()) is not None:
            connection, dial = request
            self._dialled.put((connection, dial()))
            self.wake()
