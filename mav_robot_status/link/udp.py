"""UDP links: listening on a port, sending to one, broadcasting until somebody answers. IPv4 and IPv6."""

from __future__ import annotations

import errno
import logging
import math
import os
import random
import socket
import struct
from contextlib import suppress
from typing import Any

from mav_robot_status.errors import LinkError
from mav_robot_status.link.base import Address, Received
from mav_robot_status.link.listen import Place
from mav_robot_status.link.resolve import ASK_AGAIN, Lookup, Target
from mav_robot_status.link.retry import Backoff, Chance, Changes
from mav_robot_status.link.url import Url, host_port

log = logging.getLogger(__name__)

RECEIVE_BUFFER = 4 << 20
"""Bytes that the kernel is asked to hold for us: seconds of traffic while the process is not scheduled."""
RESOLVE_WAIT = 0.2
"""Seconds that opening waits for a name, so that one that is known is there for the first send."""
RETRY = 0.2, 5.0
"""Seconds between attempts to resolve a name or to bind to an address that is not there: the first, the longest."""
ANSWER_SILENCE = 30.0
"""Seconds without a datagram of the peer that answered, after which it is looked for by broadcasting again."""

_LARGEST = 65535
_SO_RCVBUFFORCE = 33  # Linux; Python does not name these
_SO_MEMINFO = 55
_MEMINFO = struct.Struct("9I")  # the last word counts what the kernel dropped

_UNREACHABLE = dict.fromkeys((errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENETDOWN, errno.ENODEV, errno.EPERM), "")
"""Errors of sending that last until somebody does something, with words that say more than the system's. Others, such
as a full buffer, are of one datagram."""
_UNREACHABLE[errno.EACCES] = "that is a broadcast address, for which write udpbcast:"
_MOST_UNREACHABLE = 16

SocketAddress = tuple[Any, ...]


class UdpLink:
    """A UDP socket as a `Link`; what the kinds have in common."""

    stream = False

    def __init__(self, url: Url, chance: Chance = random.random) -> None:
        self.text = url.words()
        self._unsent = self._overflown = 0
        self._socket: socket.socket | None = None
        self._peer: SocketAddress | None = None
        self._unreachable: dict[SocketAddress, str] = {}
        self._due = math.inf
        self._backoff = Backoff(*RETRY, chance)
        self._changes = Changes(log)

    def fileno(self) -> int:
        """The socket's descriptor; -1 once closed, and before the peer's name is resolved."""
        return self._socket.fileno() if self._socket else -1

    @property
    def port(self) -> int:
        """The local port; 0 while there is none."""
        return int(self._socket.getsockname()[1]) if self._socket else 0

    @property
    def dropped(self) -> int:
        """What could not be sent, and what found no room in the socket's queue: the kernel counts that."""
        if self._socket is not None:
            with suppress(OSError, struct.error):  # closed, or a kernel that does not tell
                told = self._socket.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
                self._overflown = _MEMINFO.unpack(told)[-1]
        return self._unsent + self._overflown

    def receive(self, limit: int = 64) -> list[Received]:
        """The datagrams that are waiting, at most `limit`; `source` is the sender's socket address."""
        pieces: list[Received] = []
        if self._socket is None:
            return pieces
        receive, new = self._socket.recvfrom, tuple.__new__  # recvfrom's pair is what a Received holds
        try:
            for _ in range(limit):
                pieces.append(new(Received, receive(_LARGEST)))
        except OSError:  # nothing more; or an error that an earlier send left behind, which this read has cleared
            pass
        return pieces

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send to `to`, a source that `receive` gave, or to the peer. False if it was not sent."""
        target = to if isinstance(to, tuple) else self._peer
        if self._socket is not None and target is not None:
            try:
                self._socket.sendto(data, target)
            except OSError as error:  # full, refused, unreachable, too long: a datagram is lost, the link is not
                self._tell_unreachable(target, error)
            else:
                if self._unreachable:
                    self._tell_reachable(target)
                return True
        self._unsent += 1
        return False

    def due(self) -> float:
        """When `service` has something to do."""
        return self._due

    def service(self, now: float) -> None:
        """Do what is due at `now`."""
        if now >= self._due:
            self._due = math.inf
            self._serve(now)

    def close(self) -> None:
        """Close the socket."""
        self._due = math.inf
        if self._socket:
            self._unsent, self._overflown = self.dropped, 0  # the kernel cannot tell afterwards
            self._socket.close()

    def _serve(self, now: float) -> None:
        """What this kind does when its time has come."""

    def _tell_unreachable(self, target: SocketAddress, error: OSError) -> None:
        """Say once that a target cannot be reached. Bounded: there may be as many targets as there are addresses."""
        if error.errno in _UNREACHABLE:
            why = _UNREACHABLE[error.errno] or os.strerror(error.errno).lower()
            if self._unreachable.get(target) != why and len(self._unreachable) < _MOST_UNREACHABLE:
                self._unreachable[target] = why
                log.warning("%s: cannot send to %s: %s", self.text, host_port(*target[:2]), why)

    def _tell_reachable(self, target: SocketAddress) -> None:
        if self._unreachable.pop(target, None):
            log.info("%s: can send to %s again", self.text, host_port(*target[:2]))


class UdpListener(UdpLink):
    """Kind `udpin`: has a port for itself, by neither SO_REUSEADDR nor SO_REUSEPORT.

    An address that this machine does not have is waited for.
    """

    def __init__(self, url: Url, chance: Chance = random.random) -> None:
        """Open it. Raises LinkError if the port is taken or not allowed, or the host is not known."""
        super().__init__(url, chance)
        self._place = Place(url, _new_socket, socket.SOCK_DGRAM, self._changes)
        self._socket = self._place.take()
        self.text = self._place.text
        self._due = math.inf if self._socket else -math.inf

    def _serve(self, now: float) -> None:
        self._socket = self._place.take_late()
        self.text = self._place.text
        self._due = math.inf if self._socket else self._backoff.after(now)


class UdpSender(UdpLink):
    """Kind `udpout`: sends to one peer and hears whoever answers.

    A peer whose name does not resolve yet is no error; until it does, what is sent counts as dropped.
    """

    def __init__(self, url: Url, chance: Chance = random.random) -> None:
        """Open it. Raises LinkError for a kind of address that this machine cannot use."""
        super().__init__(url, chance)
        self._host = url.host
        self._lookup = Lookup(url.host, url.port, socket.SOCK_DGRAM)
        found = self._lookup.ask(RESOLVE_WAIT)
        if found:
            self._open(found[0])
        else:
            self._due = -math.inf

    def _open(self, target: Target) -> None:
        """Make the socket. It stays unconnected: an answer may come from another address."""
        try:
            self._socket = _new_socket(target[0])
        except OSError as error:
            raise LinkError(f"{self.text}: {error.strerror}") from None
        self._peer = target[1]
        self._changes.good_again(f"{self.text}: {self._host} is {self._peer[0]}")

    def _serve(self, now: float) -> None:
        found = self._lookup.ask()
        if found is None:
            self._due = now + ASK_AGAIN
            return
        try:
            if found:
                self._open(found[0])
                return
            self._changes.bad(f"{self.text}: the name {self._host} is not known yet, asking again")
        except LinkError as problem:
            self._changes.bad(str(problem))
        self._due = self._backoff.after(now)


class UdpBroadcaster(UdpSender):
    """Kind `udpbcast`: sends to everybody until somebody answers, then to that peer, until it is silent for long."""

    _everybody: SocketAddress | None = None
    _heard = False

    def receive(self, limit: int = 64) -> list[Received]:
        """The datagrams that are waiting; the first that answers becomes the peer."""
        pieces = super().receive(limit)
        if pieces and self._peer == self._everybody:
            peer: Any = pieces[0].source
            self._peer = peer
            self._changes.good(f"{self.text}: {host_port(*peer[:2])} answers, sending to it")
        if any(piece.source == self._peer for piece in pieces):
            self._heard = True
            self._due = -math.inf
        return pieces

    def _open(self, target: Target) -> None:
        super()._open(target)
        assert self._socket is not None
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._everybody = self._peer

    def _serve(self, now: float) -> None:
        if self._socket is None:
            super()._serve(now)
        elif self._heard:
            self._heard = False
            self._due = now + ANSWER_SILENCE
        else:
            assert self._peer is not None
            self._changes.bad(f"{self.text}: {host_port(*self._peer[:2])} is silent, broadcasting again")
            self._peer = self._everybody


def _new_socket(family: int) -> socket.socket:
    """A non-blocking socket with a large receive buffer: as large as the system allows."""
    new = socket.socket(family, socket.SOCK_DGRAM)
    new.setblocking(False)
    try:
        new.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER)  # above the system's limit: for root only
    except OSError:
        new.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    return new
