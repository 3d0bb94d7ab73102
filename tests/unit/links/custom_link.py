"""The peer of the link in `unix_link`, and the entry point that adds it."""

import socket
from pathlib import Path

from mav_robot_status.links import Link
from mav_robot_status.testing.conformance.links import readable

NAME = "unix_link"


class UnixPeer:
    def __init__(self, folder: Path) -> None:
        self.url = f"unixgram:{folder / 'link'}"
        self._link, self._own = str(folder / "link"), folder / "link.peer"
        self._socket: socket.socket | None = None

    def connect(self, link: Link | None = None) -> None:
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(self._own))

    def disconnect(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
            self._own.unlink()

    def send(self, data: bytes) -> None:
        assert self._socket is not None
        self._socket.sendto(data, self._link)

    def receive(self) -> bytes:
        assert self._socket is not None
        return self._socket.recv(65535) if readable(self._socket.fileno()) else b""


def install(folder: Path) -> None:
    """Make a folder with a package that adds the link, as pip does."""
    source = Path(__file__).with_name(f"{NAME}.py")
    (folder / source.name).write_text(source.read_text())
    info = folder / "unix_link-1.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: unix-link\nVersion: 1\n")
    (info / "entry_points.txt").write_text(
        "[mav_robot_status.links]\nunixgram = unix_link:UNIX\nbroken = unix_link_that_is_not_there:X\n"
        "wrong = unix_link:UnixLink\n"
    )
