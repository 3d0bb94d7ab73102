"""A link that another package could add: datagrams over a Unix socket, `unixgram:PATH`."""

import contextlib
import math
import socket

from mav_robot_status.links import Address, LinkKind, Received, Url


class UnixLink:
    stream = False

    def __init__(self, url: Url) -> None:
        self.text, self.dropped, self._peer = url.words(), 0, url.device + ".peer"
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK)
        self._socket.bind(url.device)

    def fileno(self) -> int:
        return self._socket.fileno()

    def receive(self, limit: int = 64) -> list[Received]:
        pieces: list[Received] = []
        with contextlib.suppress(OSError):
            while len(pieces) < limit:
                pieces.append(Received(*self._socket.recvfrom(65535)))
        return pieces

    def send(self, data: bytes, to: Address = None) -> bool:
        with contextlib.suppress(OSError):
            return self._socket.sendto(data, self._peer) == len(data)
        self.dropped += 1
        return False

    def due(self) -> float:
        return math.inf

    def service(self, now: float) -> None: ...

    def close(self) -> None:
        self._socket.close()


UNIX = LinkKind("unixgram", ("unixgram",), "unixgram:PATH", "unix datagrams at {device}",
                "unixgram:/run/mavlink", "datagrams at a Unix socket", UnixLink)  # fmt: skip
