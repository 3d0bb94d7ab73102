"""The other end of each kind of link, which can go away and come back, and a loop that turns a link by hand."""

from __future__ import annotations

import math
import os
import select
import socket
import tty
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from mav_robot_status.link import open_link
from mav_robot_status.link.base import Link, Received
from mav_robot_status.link.url import parse

PATIENCE = 5.0  # s that a test waits for a descriptor; used up only by a test that fails


class End(Protocol):
    """The other end of one link."""

    url: str

    def come(self, link: Link) -> None:
        """Be there, or be there again."""

    def go(self) -> None:
        """Be gone."""

    def say(self, data: bytes) -> None:
        """Send to the link."""

    def hear(self) -> bytes:
        """What has come from the link; waits for it; empty if nothing comes."""


def wait(descriptor: int, seconds: float = PATIENCE) -> bool:
    """Wait until there is something to read."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(seconds * 1000))


class SocketEnd:
    """What the ends that are sockets have in common."""

    url: str
    socket: socket.socket | None = None

    def go(self) -> None:
        if self.socket is not None:
            self.socket.close()
            self.socket = None

    def hear(self) -> bytes:
        assert self.socket is not None
        return self.socket.recv(1 << 16) if wait(self.socket.fileno()) else b""


class UdpClientEnd(SocketEnd):
    """Sends to a link that listens, and always from the same port."""

    url = "udpin:127.0.0.1:0"
    _address: tuple[str, int] = ("127.0.0.1", 0)
    _to: tuple[str, int] = ("127.0.0.1", 0)

    def come(self, link: Link) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(self._address)
        self._address = self.socket.getsockname()
        self._to = ("127.0.0.1", port_of(link))

    def say(self, data: bytes) -> None:
        assert self.socket is not None
        self.socket.sendto(data, self._to)


class UdpServerEnd(SocketEnd):
    """Is sent to, and answers whoever sent something."""

    def __init__(self, scheme: str = "udpout", to: str = "127.0.0.1", bound_to: str = "127.0.0.1") -> None:
        self._bound_to = bound_to
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind((bound_to, 0))
            self._port = free.getsockname()[1]
        self.url = f"{scheme}:{to}:{self._port}"

    def come(self, link: Link) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind((self._bound_to, self._port))
        link.send(b"hello")
        wait(self.socket.fileno())
        _, self._to = self.socket.recvfrom(100)

    def say(self, data: bytes) -> None:
        assert self.socket is not None
        self.socket.sendto(data, self._to)


class TcpServerEnd(SocketEnd):
    """Is connected to."""

    def __init__(self, host: str = "127.0.0.1") -> None:
        self._family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.socket(self._family, socket.SOCK_STREAM) as free:
            free.bind((host, 0))
            self._address = free.getsockname()
        self.url = f"tcp:[{host}]:{self._address[1]}" if ":" in host else f"tcp:{host}:{self._address[1]}"

    def come(self, link: Link) -> None:
        with socket.socket(self._family, socket.SOCK_STREAM) as listener:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(self._address)
            listener.listen()
            listener.setblocking(False)
            assert Turner(link).until(lambda: wait(listener.fileno(), 0))
            self.socket = listener.accept()[0]
        self.socket.setblocking(False)

    def say(self, data: bytes) -> None:
        assert self.socket is not None
        self.socket.send(data)


class TcpClientEnd(SocketEnd):
    """Connects."""

    url = "tcpin:127.0.0.1:0"

    def come(self, link: Link) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port_of(link)), PATIENCE)

    def say(self, data: bytes) -> None:
        assert self.socket is not None
        self.socket.send(data)


class TerminalEnd:
    """The master of a pseudo-terminal; under the same name there is a new one each time, as when it is plugged in."""

    def __init__(self, folder: Path) -> None:
        self._name = folder / "ttyACM0"
        self._master = -1
        self.url = f"serial:{self._name},57600"

    def come(self, link: Link) -> None:
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self._name.symlink_to(os.ttyname(slave))
        os.close(slave)
        turner = Turner(link)
        turner.turn()  # sees that the last one is gone
        assert turner.until(lambda: link.due() == math.inf)

    def go(self) -> None:
        if self._master >= 0:
            self._name.unlink()
            os.close(self._master)
            self._master = -1

    def say(self, data: bytes) -> None:
        os.write(self._master, data)

    def hear(self) -> bytes:
        return os.read(self._master, 1 << 16) if wait(self._master) else b""


class Turner:
    """Turns a link as a gateway does, but time jumps to whatever is due."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.now = 0.0
        self.turns = 0
        self.pieces: list[Received] = []

    def turn(self, seconds: float = 0.01) -> None:
        """Do what is due, take what has come."""
        self.turns += 1
        due = self.link.due()
        if due < math.inf:
            self.now = max(self.now, due)
            self.link.service(self.now)
        descriptor = self.link.fileno()
        if descriptor >= 0 and wait(descriptor, seconds):
            self.pieces += self.link.receive()

    def until(self, condition: Callable[[], bool]) -> bool:
        """Turn until a condition holds; False if it does not within PATIENCE."""
        for _ in range(round(PATIENCE / 0.01)):
            if condition():
                return True
            self.turn()
        return False

    def heard(self, size: int = 1) -> bytes:
        """Turn until so many bytes have come since the last call."""
        assert self.until(lambda: sum(len(piece.data) for piece in self.pieces) >= size)
        data = b"".join(piece.data for piece in self.pieces)
        self.pieces.clear()
        return data


def port_of(link: Link) -> int:
    """The port that a listener got."""
    return int(link.text.rpartition(":")[2].partition("/")[0])


def open_at(end: End) -> Link:
    """The link to this end."""
    return open_link(parse(end.url))
