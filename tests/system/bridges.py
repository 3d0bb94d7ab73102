"""Other kinds of link between a fake autopilot and a gateway: what the autopilot's UDP socket says, on a stream.

A bridge can be cut and mended like a cable that is pulled, or a server that is killed and started again.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import threading
import tty
from abc import ABC, abstractmethod
from pathlib import Path


class Bridge(ABC):
    """Bytes from a UDP socket to a stream and back, in a thread."""

    def __init__(self) -> None:
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind(("127.0.0.1", 0))
        self._udp.setblocking(False)
        self.address: tuple[str, int] = self._udp.getsockname()
        """Where the autopilot is to send."""
        self._vehicle: tuple[str, int] | None = None
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Connect, and carry bytes from now on."""
        self.mend()
        self._thread.start()

    def cut(self) -> None:
        """The stream ends, as if the cable were pulled or the server killed."""
        with self._lock:
            self._close()

    def mend(self) -> None:
        """The stream is there again, at the same place."""
        with self._lock:
            self._open()

    def close(self) -> None:
        """The end."""
        self._stop.set()
        self._thread.join()
        self.cut()
        self._udp.close()

    @abstractmethod
    def _open(self) -> None:
        """Make the stream."""

    @abstractmethod
    def _close(self) -> None:
        """End it, if there is one."""

    @abstractmethod
    def _ends(self) -> list[int]:
        """Descriptors on which something may come."""

    @abstractmethod
    def _read(self, end: int) -> bytes:
        """What has come on one end."""

    @abstractmethod
    def _write(self, data: bytes) -> None:
        """Send, if there is a stream."""

    def _run(self) -> None:
        while not self._stop.is_set():
            with self._lock:
                ends = self._ends()
            with contextlib.suppress(OSError, ValueError):  # cut while waiting
                ready, _, _ = select.select([self._udp.fileno(), *ends], [], [], 0.02)
                with self._lock, contextlib.suppress(OSError):
                    for end in ready:
                        self._carry(end)

    def _carry(self, end: int) -> None:
        if end == self._udp.fileno():
            data, self._vehicle = self._udp.recvfrom(65535)
            self._write(data)
        elif end in self._ends():
            back = self._read(end)
            if back and self._vehicle:
                self._udp.sendto(back, self._vehicle)


class PtyBridge(Bridge):
    """A serial device: a pseudo-terminal under a name that stays the same when it is plugged in again."""

    def __init__(self, device: Path) -> None:
        super().__init__()
        self.device = device
        self._master = self._slave = -1

    def _open(self) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.device.unlink(missing_ok=True)
        self.device.symlink_to(os.ttyname(self._slave))

    def _close(self) -> None:
        if self._master >= 0:
            self.device.unlink(missing_ok=True)
            os.close(self._slave)
            os.close(self._master)
            self._master = -1

    def _ends(self) -> list[int]:
        return [self._master] if self._master >= 0 else []

    def _read(self, end: int) -> bytes:
        return os.read(end, 4096)

    def _write(self, data: bytes) -> None:
        if self._master >= 0:
            os.write(self._master, data)


class TcpServerBridge(Bridge):
    """A simulator's TCP port: it serves one client."""

    def __init__(self) -> None:
        super().__init__()
        self.port = 0
        self._server: socket.socket | None = None
        self._client: socket.socket | None = None

    def _open(self) -> None:
        self._server = socket.socket()
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._server.bind(("127.0.0.1", self.port))
        self._server.listen()
        self.port = self._server.getsockname()[1]

    def _close(self) -> None:
        for end in (self._client, self._server):
            if end is not None:
                end.close()
        self._client = self._server = None

    def _ends(self) -> list[int]:
        return [end.fileno() for end in (self._server, self._client) if end is not None]

    def _read(self, end: int) -> bytes:
        if self._server is not None and end == self._server.fileno():
            if self._client is not None:
                self._client.close()
            self._client = self._server.accept()[0]
            return b""
        assert self._client is not None
        data = self._client.recv(4096)
        if not data:
            self._client.close()
            self._client = None
        return data

    def _write(self, data: bytes) -> None:
        if self._client is not None:
            self._client.sendall(data)


class TcpClientBridge(Bridge):
    """A vehicle that connects to us by TCP."""

    def __init__(self, port: int) -> None:
        super().__init__()
        self._port = port
        self._socket: socket.socket | None = None

    def _open(self) -> None:
        self._socket = socket.create_connection(("127.0.0.1", self._port))

    def _close(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _ends(self) -> list[int]:
        return [self._socket.fileno()] if self._socket is not None else []

    def _read(self, end: int) -> bytes:
        assert self._socket is not None
        return self._socket.recv(4096)

    def _write(self, data: bytes) -> None:
        if self._socket is not None:
            self._socket.sendall(data)
