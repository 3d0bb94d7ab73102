"""TCP server links, for a few clients. IPv4 and IPv6."""

from __future__ import annotations

import errno
import itertools
import logging
import math
import random
import select
import socket
import time
from collections import Counter
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from mav_robot_status.links.base import STAYS, Address, Received
from mav_robot_status.links.listen import LocalPort
from mav_robot_status.links.retry import Backoff, RandomFraction, StateLog
from mav_robot_status.links.senders import Senders
from mav_robot_status.links.stream import Stream, reason
from mav_robot_status.links.tcp import tuned
from mav_robot_status.links.url import Url, host_port
from mav_robot_status.paced_log import BURST, PacedLog

log = logging.getLogger(__name__)

MAX_CLIENTS = 8
"""The most clients at a time. Those that matter least give way to new ones."""
NEWCOMER: Final = 5.0
"""Seconds for which a client keeps its place in any case: a vehicle sends its heartbeat once a second."""
MAX_ACCEPTS = 16
"""The most connections that one `receive` accepts."""
RETRY = 0.2, 5.0
"""Seconds between attempts to listen on a missing address, or to accept without free descriptors: first, longest."""

_EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)


class Client(NamedTuple):
    """One connection."""

    socket: socket.socket
    stream: Stream
    where: str
    host: str
    since: float
    """When it connected, in monotonic seconds."""


class TcpServerLink:
    """Kind `tcpin`: listens, and serves at most MAX_CLIENTS clients.

    A client that does not read loses frames when its buffer is full. The other clients lose nothing.
    """

    stream = True

    def __init__(
        self, url: Url, fraction: RandomFraction = random.random, clock: Callable[[], float] = time.monotonic
    ) -> None:
        """Open it. Raises LinkError if the port is in use or not allowed, or the host is unknown.

        If this machine does not have the address, the link waits for it: the interface may come up later.
        """
        self.text = url.words()
        self.dropped = 0
        self.priority: Callable[[Address], int] = lambda source: STAYS
        self.refused = 0
        """How many clients were refused because there were MAX_CLIENTS."""
        self._clock = clock
        self._senders = Senders(url, "connection")
        self._tell_refused, self._tell_gives_way = PacedLog(log), PacedLog(log)
        self._tell_comes, self._tell_goes = PacedLog(log, *BURST), PacedLog(log, *BURST)
        self._backoff = Backoff(*RETRY, fraction)
        self._state_log = StateLog(log)
        self._clients: dict[int, Client] = {}
        self._numbers = itertools.count(1)
        self._exhausted = False
        """No free descriptor for a client since the last `service`."""
        self._local_port = LocalPort(url, _new_socket, socket.SOCK_STREAM, self._state_log)
        self._listener = self._local_port.bind()
        self._epoll = select.epoll()
        self._listen()
        self._due = math.inf if self._listener else -math.inf

    def fileno(self) -> int:
        """The descriptor of the epoll; -1 once closed."""
        return -1 if self._epoll.closed else self._epoll.fileno()

    def receive(self, limit: int = 64) -> list[Received]:
        """One piece of each client that has sent data; accepts new clients. `source` identifies the client."""
        pieces: list[Received] = []
        for descriptor, _ in () if self._epoll.closed else self._epoll.poll(0, limit):
            client = self._clients.get(descriptor)
            if client is None:
                self._accept()
                continue
            try:
                pieces.append(client.stream.read())
            except BlockingIOError:  # the event was EPOLLOUT: the send buffer has room
                pass
            except OSError as error:
                self._disconnect(client, error)
        return pieces

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send to one client, or to all. False if no send succeeded; `dropped` counts every client without the data."""
        clients = [client for client in self._clients.values() if to is None or client.stream.address == to]
        sent = sum(self._send(client, data) for client in clients)
        self.dropped += (len(clients) or 1) - sent
        return sent > 0

    def due(self) -> float:
        """When `service` has work."""
        return min(self._due, self._senders.due())

    def service(self, now: float) -> None:
        """Retry to listen or to accept; log who was refused."""
        self._senders.service(now, self.text)
        if now < self._due:
            return
        self._due = math.inf
        if self._exhausted:
            self._exhausted = False
            self._due = self._backoff.after(now)
            return
        if self._listener is None:
            self._listener = self._local_port.try_bind()
        self._listen()
        if self._listener is None:
            self._due = self._backoff.after(now)

    def close(self) -> None:
        """Close the port and all clients."""
        self._due = math.inf
        for client in list(self._clients.values()):
            self._drop(client)
        if self._listener is not None:
            self._listener.close()
        self._epoll.close()

    def _listen(self) -> None:
        """Register the listening socket in the epoll."""
        self.text = self._local_port.text
        if self._listener is not None:
            self._epoll.register(self._listener, select.EPOLLIN)

    def _accept(self) -> None:
        """Accept the clients that wait."""
        assert self._listener is not None
        try:
            for _ in range(MAX_ACCEPTS):
                self._add_client(*self._listener.accept())
        except OSError as error:  # no client waits, or the client has disconnected already
            if error.errno in _EXHAUSTED:  # the waiting clients would keep the descriptor readable
                self._state_log.down(f"{self.text}: cannot accept another client: {reason(error)}")
                self._epoll.unregister(self._listener)
                self._exhausted = True
                self._due = -math.inf

    def _add_client(self, new: socket.socket, address: tuple[Any, ...]) -> None:
        now, where = self._clock(), host_port(*address[:2])
        if not self._senders.admits(address[0]):
            new.close()
            return
        if len(self._clients) >= MAX_CLIENTS and not self._make_room(address[0], now):
            new.close()
            self.refused += 1
            line = f"{self.text}: {where} refused: already {MAX_CLIENTS} clients"
            self._tell_refused(logging.WARNING, now, line)
            return
        self._backoff.reset()
        stream = Stream(self._epoll, tuned(new).fileno(), (*address[:2], next(self._numbers)))
        self._clients[new.fileno()] = Client(new, stream, where, address[0], now)
        self._tell_comes(logging.INFO, now, f"{self.text}: {where} has connected")

    def _make_room(self, host: str, now: float) -> bool:
        """Drop the client that matters least, for a new one of this host.

        Among equals one of the host with the most clients, and of those the one that came first. A new client keeps its
        place for a while, unless its host has more than the new one.
        """
        clients = Counter(client.host for client in self._clients.values())
        dispensable = {
            client: priority
            for client in self._clients.values()
            if (now - client.since > NEWCOMER or clients[client.host] > clients[host] + 1)
            and (priority := self.priority(client.stream.address)) < STAYS
        }
        if not dispensable:
            return False
        client = min(dispensable, key=lambda client: (dispensable[client], -clients[client.host]))
        self._tell_gives_way(logging.WARNING, now, f"{self.text}: {client.where} makes room for a new client")
        self._drop(client)
        return True

    def _send(self, client: Client, data: bytes) -> bool:
        try:
            return client.stream.write(data)
        except OSError as error:
            self._disconnect(client, error)
            return False

    def _disconnect(self, client: Client, error: OSError) -> None:
        self._tell_goes(logging.INFO, self._clock(), f"{self.text}: {client.where} is gone: {reason(error)}")
        self._drop(client)

    def _drop(self, client: Client) -> None:
        del self._clients[client.socket.fileno()]
        client.stream.detach()
        client.socket.close()


def _new_socket(family: int) -> socket.socket:
    """A non-blocking socket. SO_REUSEADDR: connections in TIME_WAIT do not block the port."""
    new = socket.socket(family, socket.SOCK_STREAM)
    new.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    new.setblocking(False)
    return new
