"""The clients of one port: each gets every frame. No method blocks, and nothing grows with what a client does."""

from __future__ import annotations

import logging
import select
import socket
import struct
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from ...paced_log import PacedLog
from ..listener import host_port
from .requests import RequestReader

log = logging.getLogger(__name__)

MOST_CLIENTS: Final = 8
MOST_ACCEPTED: Final = 16
"""Connections that one `look` accepts, or refuses."""
CHUNK: Final = 4096
"""Bytes that one `look` reads from each client."""
MOST_WAITING: Final = 1 << 16
"""Bytes that wait for a client. With one more it counts as a client that does not read."""
KERNEL_BUFFER: Final = 1 << 13
"""Bytes that the kernel buffers in addition, in each direction. Linux doubles this."""
SOCKET_OPTIONS: Final = (
    (socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BUFFER),
    (socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BUFFER),
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),  # a status does not wait for the next one
    # a client without power, or behind a cut cable, gives its place back
    (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 10),
    (socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 5),
    (socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 2),
    (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 20_000),  # ms; while frames wait, there are no keepalives
)
RESET: Final = struct.pack("ii", 1, 0)
"""SO_LINGER: close at once, and discard what waits."""
MINUTE: Final = 60.0  # s


class Client:
    """One connection."""

    __slots__ = ("requests", "socket", "waiting", "where")

    def __init__(self, opened: socket.socket, where: str, requests: RequestReader) -> None:
        self.socket, self.where, self.requests = opened, where, requests
        self.waiting = bytearray()
        """What the kernel has not taken yet."""

    def send(self, data: bytes) -> bool:
        """Send, and queue the rest; False if too much waits. Raises OSError if the connection is broken."""
        self.waiting += data
        if self.waiting:
            with suppress(BlockingIOError):
                del self.waiting[: self.socket.send(self.waiting)]
        return len(self.waiting) <= MOST_WAITING


class Server:
    """Accepts at most MOST_CLIENTS clients, sends them frames, and answers their requests."""

    def __init__(self, name: str, listener: socket.socket, requests: Callable[[], RequestReader]) -> None:
        """It owns the listening socket. `requests` makes the reader of a new client."""
        self.where = host_port(*listener.getsockname()[:2])
        self.dropped = 0
        """Clients that were disconnected because they did not read."""
        self._text = f"{name} on {self.where}/tcp"
        self._listener, self._requests = listener, requests
        self._clients: dict[int, Client] = {}
        self._poll = select.poll()
        self._poll.register(listener, select.POLLIN)
        self._now = 0.0
        self._tell, self._tell_refused = PacedLog(log, 20, MINUTE), PacedLog(log, 1, MINUTE)

    def send(self, frame: bytes) -> None:
        """Send a frame to every client, after what waits."""
        for client in list(self._clients.values()):
            self._send(client, frame)

    def look(self, now: float, latest: bytes) -> None:
        """Read what clients have sent, and accept new ones. They get `latest` at once. `now` in monotonic seconds."""
        self._now = now
        self.send(b"")
        ready = {descriptor for descriptor, _ in self._poll.poll(0)}
        for client in [client for descriptor, client in self._clients.items() if descriptor in ready]:
            self._read(client)
        if self._listener.fileno() in ready:  # after the clients: one that is gone makes room for its next connection
            self._accept(latest)

    def close(self) -> None:
        """Close the port and all connections. A second call does nothing."""
        for client in list(self._clients.values()):
            self._forget(client)
        self._listener.close()

    def _accept(self, latest: bytes) -> None:
        try:
            for _ in range(MOST_ACCEPTED):
                self._add(*self._listener.accept(), latest)
        except BlockingIOError:
            pass
        except OSError as error:  # the client is gone already, or there is no free descriptor
            self._tell_refused(logging.WARNING, self._now, f"{self._text}: cannot accept a client: {error.strerror}")

    def _add(self, new: socket.socket, address: tuple[Any, ...], latest: bytes) -> None:
        where = host_port(*address[:2])
        if len(self._clients) >= MOST_CLIENTS:
            new.close()
            self._tell_refused(
                logging.WARNING, self._now, f"{self._text}: {where} refused: already {MOST_CLIENTS} clients"
            )
            return
        new.setblocking(False)
        client = self._clients[new.fileno()] = Client(new, where, self._requests())
        self._poll.register(new, select.POLLIN)
        self._tell(logging.INFO, self._now, f"{self._text}: {where} has connected")
        self._send(client, latest)

    def _read(self, client: Client) -> None:
        try:
            data = client.socket.recv(CHUNK)
        except BlockingIOError:
            return
        except OSError as error:
            self._gone(client, error.strerror or str(error))
            return
        if not data:
            self._gone(client, "closed by the other end")
            return
        self._send(client, client.requests.feed(data))

    def _send(self, client: Client, data: bytes) -> None:
        """Send to one client. Disconnect it if it does not read."""
        try:
            if client.send(data):
                return
        except OSError as error:
            self._gone(client, error.strerror or str(error))
            return
        self.dropped += 1
        client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RESET)
        self._forget(client)
        self._tell(logging.WARNING, self._now, f"{self._text}: {client.where} does not read and is disconnected")

    def _gone(self, client: Client, why: str) -> None:
        self._forget(client)
        self._tell(logging.INFO, self._now, f"{self._text}: {client.where} is gone: {why.lower()}")

    def _forget(self, client: Client) -> None:
        with suppress(OSError):  # bytes that nobody has read would turn the end into a reset, which discards frames
            client.socket.recv(CHUNK)
        self._poll.unregister(client.socket)
        del self._clients[client.socket.fileno()]
        client.socket.close()
