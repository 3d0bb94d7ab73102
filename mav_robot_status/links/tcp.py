"""TCP client links: connect to a server, and reconnect after every loss. IPv4 and IPv6."""

from __future__ import annotations

import errno
import logging
import math
import os
import random
import select
import socket

from mav_robot_status.links.base import Received
from mav_robot_status.links.resolve import CHECK_AGAIN, Lookup, Target
from mav_robot_status.links.retry import Backoff, RandomFraction, StateLog
from mav_robot_status.links.stream import Reconnecting
from mav_robot_status.links.url import Url

log = logging.getLogger(__name__)

RETRY = 0.2, 10.0
"""Seconds between attempts to connect: the first wait, the longest."""
CONNECT_WAIT = 5.0
"""Seconds until an attempt to connect to one address times out."""
SEND_BUFFER = 1 << 16
"""Bytes that the kernel buffers for a slow peer. A larger buffer would only deliver older data."""

_OPTIONS = (
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),  # a heartbeat does not wait for more data
    (socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER),
    # detects within about 20 s that a peer is gone (power, cable, NAT), also if the link only receives
    (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 10),
    (socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 5),
    (socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 2),
    (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 20_000),
)


def tuned(new: socket.socket) -> socket.socket:
    """The socket, non-blocking and with the options above."""
    new.setblocking(False)
    for level, option, value in _OPTIONS:
        new.setsockopt(level, option, value)
    return new


class TcpLink(Reconnecting):
    """Kind `tcp`: connects to a server. Tries each address of the host."""

    def __init__(self, url: Url, fraction: RandomFraction = random.random) -> None:
        """Does not connect yet: the first `service` does."""
        super().__init__(url.words(), f"{url.where()}/tcp", Backoff(*RETRY, fraction), StateLog(log))
        self._lookup = Lookup(url.host, url.port, socket.SOCK_STREAM)
        self._candidates: list[Target] = []
        self._socket: socket.socket | None = None
        """Connecting or connected."""
        self._give_up_at = math.inf

    def receive(self, limit: int = 64) -> list[Received]:
        """The pieces that wait. A socket that connects makes the descriptor readable: `service` reads the outcome."""
        if self._stream is None and self._socket is not None:
            self._due = -math.inf
        return super().receive(limit)

    def _connect(self, now: float) -> None:
        if self._socket is not None:
            code = self._outcome(now)
        elif self._find(now):
            code = self._begin(now)
        else:
            return
        while code not in (0, errno.EINPROGRESS) and self._candidates:
            code = self._begin(now)
        if code == 0 and self._socket is not None:
            self._epoll.unregister(self._socket)
            self._connected(self._socket.fileno(), now)
        elif code == errno.EINPROGRESS:
            self._due = self._give_up_at
        else:
            self._retry(os.strerror(code).lower(), now)

    def _find(self, now: float) -> bool:
        """Whether the lookup has addresses to try; if not, the next step is scheduled."""
        found = self._lookup.result()
        self._candidates = list(found or ())
        if found is None:
            self._due = now + CHECK_AGAIN
        elif not found:
            self._retry("the name is not known", now)
        return bool(found)

    def _begin(self, now: float) -> int:
        """Start to connect to the next address; the result of `_outcome`."""
        family, address = self._candidates.pop(0)
        try:
            self._socket = socket.socket(family, socket.SOCK_STREAM)
            code = tuned(self._socket).connect_ex(address)
        except OSError as error:  # address family not supported, or no descriptors left
            code = error.errno or errno.EIO
        if self._socket is None or code not in (0, errno.EINPROGRESS):
            self._release()
            return code
        self._epoll.register(self._socket, select.EPOLLOUT)
        self._give_up_at = now + CONNECT_WAIT
        return self._outcome(now)

    def _outcome(self, now: float) -> int:
        """The result of connecting: 0, EINPROGRESS, or another error number, after which the socket is closed."""
        assert self._socket is not None
        code = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        try:
            if code == 0 and self._socket.getpeername() == self._socket.getsockname():
                code = (
                    errno.ECONNREFUSED
                )  # connected to itself: nothing listens, and the system picked the same local port
        except OSError:  # not connected
            code = errno.EINPROGRESS if now < self._give_up_at else errno.ETIMEDOUT
        if code not in (0, errno.EINPROGRESS):
            self._release()
        return code

    def _release(self) -> None:
        if self._socket is not None:
            self._socket.close()  # this also removes it from the epoll
            self._socket = None
