"""Bridges from the UDP socket of a fake autopilot to a serial port or a TCP connection of the gateway.

A bridge can be cut and restored, like a cable that is unplugged or a server that is restarted.
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

from ..ports import free_port


class Bridge(ABC):
    """Bytes from a UDP socket to a stream and back, in a thread."""

    def __init__(self) -> None:
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._udp.bind(("127.0.0.1", 0))
        self._udp.setblocking(False)
        self.address: tuple[str, int] = self._udp.getsockname()
        """The address to which the autopilot sends."""
        self._vehicle: tuple[str, int] | None = None
        self._stop = threading.Event()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self) -> None:
        """Connect, and start to carry bytes."""
        self.mend()
        self._thread.start()

    def cut(self) -> None:
        """End the stream, as an unplugged cable or a killed server does."""
        with self._lock:
            self._close()

    def mend(self) -> None:
        """Open the stream again at the same place."""
        with self._lock:
            self._open()

    def close(self) -> None:
        """Stop the thread and close everything."""
        self._stop.set()
        self._thread.join()
        self.cut()
        self._udp.close()

    @abstractmethod
    def _open(self) -> None:
        """Open the stream."""

    @abstractmethod
    def _close(self) -> None:
        """Close the stream if there is one."""

    @abstractmethod
    def _ends(self) -> list[int]:
        """The descriptors from which to read."""

    @abstractmethod
    def _read(self, end: int) -> bytes:
        """The bytes that wait at one descriptor."""

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
    """A serial device: a pseudo-terminal whose name stays the same after a reconnection."""

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
    """The TCP port of a simulator, for one client."""

    def __init__(self) -> None:
        super().__init__()
        self.port = free_port()
        self._server: socket.socket | None = None
        self._client: socket.socket | None = None

    def _open(self) -> None:
        self._server = socket.socket()
        self._server.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._server.bind(("127.0.0.1", self.port))
        self._server.listen()

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
