"""TCP links: being a server for a few clients. IPv4 and IPv6."""

from __future__ import annotations

import errno
import itertools
import logging
import math
import random
import select
import socket
from typing import Any, NamedTuple

from mav_robot_status.link.base import Address, Received
from mav_robot_status.link.listen import Place
from mav_robot_status.link.retry import Backoff, Chance, Changes
from mav_robot_status.link.stream import Stream, reason
from mav_robot_status.link.tcp import tuned
from mav_robot_status.link.url import Url, host_port

log = logging.getLogger(__name__)

MOST_CLIENTS = 8
"""Clients at a time; more are turned away."""
MOST_AT_ONCE = 16
"""Connections accepted before anything else is done."""
RETRY = 0.2, 5.0
"""Seconds between attempts to listen on an address that is not there, or to accept without descriptors."""

_EXHAUSTED = (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM)


class Client(NamedTuple):
    """One connection."""

    socket: socket.socket
    stream: Stream
    where: str


class TcpServerLink:
    """Kind `tcpin`: listens, and speaks with at most MOST_CLIENTS clients.

    A client that does not read loses what its buffer has no room for, and costs the others nothing.
    """

    stream = True

    def __init__(self, url: Url, chance: Chance = random.random) -> None:
        """Open it. Raises LinkError if the port is taken or not allowed, or the host is not known.

        An address that this machine does not have is waited for: its interface may come up later.
        """
        self.text = url.words()
        self.dropped = 0
        self.turned_away = 0
        """Clients for whom there was no room."""
        self._backoff = Backoff(*RETRY, chance)
        self._changes = Changes(log)
        self._clients: dict[int, Client] = {}
        self._numbers = itertools.count(1)
        self._tired = False
        """Whether there was no descriptor for a client since `service` was last here."""
        self._place = Place(url, _new_socket, socket.SOCK_STREAM, self._changes)
        self._listener = self._place.take()
        self._epoll = select.epoll()
        self._listen()
        self._due = math.inf if self._listener else -math.inf

    def fileno(self) -> int:
        """The descriptor of the epoll; -1 once closed."""
        return -1 if self._epoll.closed else self._epoll.fileno()

    def receive(self, limit: int = 64) -> list[Received]:
        """A piece from each client that has sent something; takes in new ones. `source` is the client's own."""
        pieces: list[Received] = []
        for descriptor, _ in () if self._epoll.closed else self._epoll.poll(0, limit):
            client = self._clients.get(descriptor)
            if client is None:
                self._accept()
                continue
            try:
                pieces.append(client.stream.read())
            except BlockingIOError:  # there was room to send
                pass
            except OSError as error:
                self._lose(client, error)
        return pieces

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send to one client, or to all of them. False if nobody got it; counted for each who did not."""
        clients = [client for client in self._clients.values() if to is None or client.stream.address == to]
        sent = sum(self._send(client, data) for client in clients)
        self.dropped += (len(clients) or 1) - sent
        return sent > 0

    def due(self) -> float:
        """When `service` has something to do."""
        return self._due

    def service(self, now: float) -> None:
        """Try again to listen, or to accept."""
        if now < self._due:
            return
        self._due = math.inf
        if self._tired:
            self._tired = False
            self._due = self._backoff.after(now)
            return
        if self._listener is None:
            self._listener = self._place.take_late()
        self._listen()
        if self._listener is None:
            self._due = self._backoff.after(now)

    def close(self) -> None:
        """Let go of the port and of the clients."""
        self._due = math.inf
        for client in list(self._clients.values()):
            self._drop(client)
        if self._listener is not None:
            self._listener.close()
        self._epoll.close()

    def _listen(self) -> None:
        """Hear who wants to connect."""
        self.text = self._place.text
        if self._listener is not None:
            self._epoll.register(self._listener, select.EPOLLIN)

    def _accept(self) -> None:
        """Take in who waits, as far as there is room."""
        assert self._listener is not None
        try:
            for _ in range(MOST_AT_ONCE):
                self._welcome(*self._listener.accept())
        except OSError as error:  # nobody more, or one who has gone already
            if error.errno in _EXHAUSTED:  # those who wait would wake us without end
                self._changes.bad(f"{self.text}: cannot take another client: {reason(error)}")
                self._epoll.unregister(self._listener)
                self._tired = True
                self._due = -math.inf

    def _welcome(self, new: socket.socket, address: tuple[Any, ...]) -> None:
        where = host_port(*address[:2])
        if len(self._clients) >= MOST_CLIENTS:
            new.close()
            self.turned_away += 1
            if self.turned_away == 1:
                log.warning("%s: %s was turned away: there are %d clients already", self.text, where, MOST_CLIENTS)
            return
        self._backoff.reset()
        stream = Stream(self._epoll, tuned(new).fileno(), (*address[:2], next(self._numbers)))
        self._clients[new.fileno()] = Client(new, stream, where)
        log.info("%s: %s has connected", self.text, where)

    def _send(self, client: Client, data: bytes) -> bool:
        try:
            return client.stream.write(data)
        except OSError as error:
            self._lose(client, error)
            return False

    def _lose(self, client: Client, error: OSError) -> None:
        log.info("%s: %s is gone: %s", self.text, client.where, reason(error))
        self._drop(client)

    def _drop(self, client: Client) -> None:
        del self._clients[client.socket.fileno()]
        client.stream.detach()
        client.socket.close()


def _new_socket(family: int) -> socket.socket:
    """A non-blocking socket. A port whose last connections are still dying out may be had again: SO_REUSEADDR."""
    new = socket.socket(family, socket.SOCK_STREAM)
    new.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    new.setblocking(False)
    return new
