"""A peer for each kind of link."""

from __future__ import annotations

import math
import os
import socket
import tty
from pathlib import Path

from mav_robot_status.links import Link
from mav_robot_status.testing.conformance.links import PATIENCE, LinkDriver, readable


class SocketPeer:
    """The common part of the peers with a socket."""

    url: str
    socket: socket.socket | None = None

    def disconnect(self) -> None:
        if self.socket is not None:
            self.socket.close()
            self.socket = None

    def receive(self) -> bytes:
        assert self.socket is not None
        return self.socket.recv(1 << 16) if readable(self.socket.fileno()) else b""


class UdpClient(SocketPeer):
    """Sends to a listening link, always from the same port."""

    url = "udpin:127.0.0.1:0"
    _address: tuple[str, int] = ("127.0.0.1", 0)
    _to: tuple[str, int] = ("127.0.0.1", 0)

    def connect(self, link: Link) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(self._address)
        self._address = self.socket.getsockname()
        self._to = ("127.0.0.1", port_of(link))

    def send(self, data: bytes) -> None:
        assert self.socket is not None
        self.socket.sendto(data, self._to)


class UdpServer(SocketPeer):
    """Receives from a link, and replies to the sender."""

    def __init__(self, scheme: str = "udpout", to: str = "127.0.0.1", bound_to: str = "127.0.0.1") -> None:
        self._bound_to = bound_to
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind((bound_to, 0))
            self._port = free.getsockname()[1]
        self.url = f"{scheme}:{to}:{self._port}"

    def connect(self, link: Link) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((self._bound_to, self._port))
        link.send(b"hello")
        readable(self.socket.fileno())
        _, self._to = self.socket.recvfrom(100)

    def send(self, data: bytes) -> None:
        assert self.socket is not None
        self.socket.sendto(data, self._to)


class TcpServer(SocketPeer):
    """Accepts the connection of a link."""

    def __init__(self, host: str = "127.0.0.1") -> None:
        self._family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.socket(self._family, socket.SOCK_STREAM) as free:
            free.bind((host, 0))
            self._address = free.getsockname()
        self.url = f"tcp:[{host}]:{self._address[1]}" if ":" in host else f"tcp:{host}:{self._address[1]}"

    def connect(self, link: Link) -> None:
        with socket.socket(self._family, socket.SOCK_STREAM) as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(self._address)
            listener.listen()
            listener.setblocking(False)
            assert LinkDriver(link).until(lambda: readable(listener.fileno(), 0))
            self.socket = listener.accept()[0]
        self.socket.setblocking(False)

    def send(self, data: bytes) -> None:
        assert self.socket is not None
        self.socket.send(data)


class TcpClient(SocketPeer):
    """Connects to a link."""

    url = "tcpin:127.0.0.1:0"

    def connect(self, link: Link) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port_of(link)), PATIENCE)

    def send(self, data: bytes) -> None:
        assert self.socket is not None
        self.socket.send(data)


class Terminal:
    """The master of a pseudo-terminal. Each `connect` makes a new one with the same name, like a USB device."""

    def __init__(self, folder: Path) -> None:
        self._name = folder / "ttyACM0"
        self._master = -1
        self.url = f"serial:{self._name},57600"

    def connect(self, link: Link) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self._name.symlink_to(os.ttyname(slave))
        os.close(slave)
        driver = LinkDriver(link)
        driver.turn()  # detects the loss of the last one
        assert driver.until(lambda: link.due() == math.inf)

    def disconnect(self) -> None:
        if self._master >= 0:
            self._name.unlink()
            os.close(self._master)
            self._master = -1

    def send(self, data: bytes) -> None:
        os.write(self._master, data)

    def receive(self) -> bytes:
        return os.read(self._master, 1 << 16) if readable(self._master) else b""


def port_of(link: Link) -> int:
    """The port of a listener."""
    return int(link.text.rpartition(":")[2].partition("/")[0])
