"""TCP links: connecting to a server, and again whenever the connection is lost. IPv4 and IPv6."""

from __future__ import annotations

import errno
import logging
import math
import os
import random
import select
import socket

from mav_robot_status.link.base import Received
from mav_robot_status.link.resolve import ASK_AGAIN, Lookup, Target
from mav_robot_status.link.retry import Backoff, Chance, Changes
from mav_robot_status.link.stream import Reconnecting
from mav_robot_status.link.url import Url

log = logging.getLogger(__name__)

RETRY = 0.2, 10.0
"""Seconds between attempts to connect: the first wait, the longest."""
CONNECT_WAIT = 5.0
"""Seconds that one address has to answer."""
SEND_BUFFER = 1 << 16
"""Bytes that wait in the kernel for a peer that reads slowly; more would only be older."""

_OPTIONS = (
    (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),  # a heartbeat does not wait for company
    (socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER),
    # a peer that went without a word (power, cable, NAT) is noticed within about 20 s, whether we send or only listen
    (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1),
    (socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 10),
    (socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 5),
    (socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 2),
    (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 20_000),
)


def tuned(new: socket.socket) -> socket.socket:
    """The socket, made non-blocking and fit for telemetry."""
    new.setblocking(False)
    for level, option, value in _OPTIONS:
        new.setsockopt(level, option, value)
    return new


class TcpLink(Reconnecting):
    """Kind `tcp`: connects to a server. A host with several addresses is tried at each of them."""

    def __init__(self, url: Url, chance: Chance = random.random) -> None:
        """Nothing is connected yet: the first `service` starts it."""
        super().__init__(url.words(), f"{url.where()}/tcp", Backoff(*RETRY, chance), Changes(log))
        self._lookup = Lookup(url.host, url.port, socket.SOCK_STREAM)
        self._candidates: list[Target] = []
        self._socket: socket.socket | None = None
        """Connecting or connected."""
        self._give_up_at = math.inf

    def receive(self, limit: int = 64) -> list[Received]:
        """What is waiting. A socket that is connecting wakes whoever waits: `service` sees how that ended."""
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
        """Whether there are addresses to try; if not, what comes next is set."""
        found = self._lookup.ask()
        self._candidates = list(found or ())
        if found is None:
            self._due = now + ASK_AGAIN
        elif not found:
            self._retry("the name is not known", now)
        return bool(found)

    def _begin(self, now: float) -> int:
        """Start to connect to the next address; the outcome so far."""
        family, address = self._candidates.pop(0)
        try:
            self._socket = socket.socket(family, socket.SOCK_STREAM)
            code = tuned(self._socket).connect_ex(address)
        except OSError as error:  # no such kind of address here, no descriptors left
            code = error.errno or errno.EIO
        if self._socket is None or code not in (0, errno.EINPROGRESS):
            self._release()
            return code
        self._epoll.register(self._socket, select.EPOLLOUT)
        self._give_up_at = now + CONNECT_WAIT
        return self._outcome(now)

    def _outcome(self, now: float) -> int:
        """How connecting has ended: 0, an error number (the socket is closed then), or EINPROGRESS."""
        assert self._socket is not None
        code = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        try:
            if code == 0 and self._socket.getpeername() == self._socket.getsockname():
                code = errno.ECONNREFUSED  # nobody listens, and the system gave us the very port that we call
        except OSError:  # not connected
            code = errno.EINPROGRESS if now < self._give_up_at else errno.ETIMEDOUT
        if code not in (0, errno.EINPROGRESS):
            self._release()
        return code

    def _release(self) -> None:
        if self._socket is not None:
            self._socket.close()  # which also takes it out of the epoll
            self._socket = None
