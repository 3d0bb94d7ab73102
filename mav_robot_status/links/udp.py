"""UDP links: listen on a port, send to a port, broadcast until a peer answers. IPv4 and IPv6."""

from __future__ import annotations

import errno
import logging
import math
import os
import random
import socket
import struct
import time
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, TypeVar

from mav_robot_status.errors import LinkError
from mav_robot_status.links.base import Address, Dated, Received
from mav_robot_status.links.listen import LocalPort
from mav_robot_status.links.resolve import CHECK_AGAIN, Lookup, Target
from mav_robot_status.links.retry import Backoff, RandomFraction, StateLog
from mav_robot_status.links.senders import Senders
from mav_robot_status.links.url import Url, host_port
from mav_robot_status.paced_log import BURST, PacedLog

log = logging.getLogger(__name__)

RECEIVE_BUFFER = 4 << 20
"""Bytes of the receive buffer that we request: seconds of traffic while the process is not scheduled."""
RESOLVE_WAIT = 0.2
"""Seconds that opening waits for a name, so that a name that resolves is ready for the first send."""
RETRY = 0.2, 5.0
"""Seconds between attempts to resolve a name or to bind to a missing address: first, longest."""
OTHER_SILENCE = 3.5
"""Seconds of silence of the peer that answered, after which another address may answer: the heartbeat timeout."""
ANSWER_SILENCE = 30.0
"""Seconds of silence of the peer that answered, after which the link broadcasts again."""

EXACT = 2
_MAX_DATAGRAM = 65535
_SO_TIMESTAMPNS = 35
_TIMESPEC = struct.Struct("@qq")
_CONTROL = socket.CMSG_SPACE(_TIMESPEC.size)
_SO_RCVBUFFORCE = 33  # Linux; Python has no names for these
_SO_MEMINFO = 55
_MEMINFO = struct.Struct("9I")  # the last word counts the datagrams that the kernel dropped

_UNREACHABLE = dict.fromkeys((errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENETDOWN, errno.ENODEV, errno.EPERM), "")
"""Send errors that persist until a person acts, with a text where the system's text is not clear. All other errors,
such as a full buffer, concern one datagram."""
_UNREACHABLE[errno.EACCES] = "that is a broadcast address; write udpbcast: to send to it"
_MAX_UNREACHABLE = 16

SocketAddress = tuple[Any, ...]
P = TypeVar("P", Received, Dated)


class UdpLink:
    """A UDP socket as a `Link`: the common part of the kinds."""

    stream = False

    def __init__(self, url: Url, fraction: RandomFraction = random.random) -> None:
        self.text = url.words()
        self._unsent = self._overflowed = 0
        self._socket: socket.socket | None = None
        self._peer: SocketAddress | None = None
        self._unreachable: dict[SocketAddress, str] = {}
        self._due = math.inf
        self._backoff = Backoff(*RETRY, fraction)
        self._state_log = StateLog(log)
        self._tell_unreachable, self._tell_answers = PacedLog(log, *BURST), PacedLog(log, *BURST)

    def fileno(self) -> int:
        """The descriptor of the socket; -1 after `close`, and before the name of the peer is resolved."""
        return self._socket.fileno() if self._socket else -1

    @property
    def port(self) -> int:
        """The local port; 0 without a socket."""
        return int(self._socket.getsockname()[1]) if self._socket else 0

    @property
    def dropped(self) -> int:
        """How many sends failed, plus how many datagrams the kernel dropped because the receive buffer was full."""
        if self._socket is not None:
            with suppress(OSError, struct.error):  # closed, or the kernel does not support this
                meminfo = self._socket.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
                self._overflowed = int(_MEMINFO.unpack(meminfo)[-1])
        return self._unsent + self._overflowed

    def receive(self, limit: int = 64) -> list[Received]:
        """The datagrams that wait, at most `limit`; `source` is the socket address of the sender."""
        pieces: list[Received] = []
        if self._socket is None:
            return pieces
        receive, new = self._socket.recvfrom, tuple.__new__  # recvfrom's pair is what a Received holds
        try:
            for _ in range(limit):
                pieces.append(new(Received, receive(_MAX_DATAGRAM)))
        except OSError:  # nothing waits; or the error of an earlier send, which this read has cleared
            pass
        return pieces

    def receive_dated(self, limit: int = 64) -> list[Dated]:
        """As `receive`, with the kernel's time stamps."""
        pieces: list[Dated] = []
        if self._socket is None:
            return pieces
        with suppress(OSError):
            while len(pieces) < limit:
                data, control, _, source = self._socket.recvmsg(_MAX_DATAGRAM, _CONTROL)
                pieces.append(Dated(data, source, _stamp(control)))
        return pieces

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send to `to`, a source from `receive`, or to the peer. False if it was not sent."""
        target = to if isinstance(to, tuple) else self._peer
        if self._socket is not None and target is not None:
            try:
                self._socket.sendto(data, target)
            except OSError as error:  # full, refused, unreachable, too long: a datagram is lost, the link is not
                self._log_unreachable(target, error)
            else:
                if self._unreachable:
                    self._log_reachable(target)
                return True
        self._unsent += 1
        return False

    def due(self) -> float:
        """When `service` has work."""
        return self._due

    def service(self, now: float) -> None:
        """Do the work that is due at `now`."""
        if now >= self._due:
            self._due = math.inf
            self._do_due(now)

    def close(self) -> None:
        """Close the socket."""
        self._due = math.inf
        if self._socket:
            self._unsent, self._overflowed = self.dropped, 0  # the kernel has no count after closing
            self._socket.close()

    def _do_due(self, now: float) -> None:
        """The work of this kind when it is due."""

    def _log_unreachable(self, target: SocketAddress, error: OSError) -> None:
        """Log once that a target is unreachable. Bounded, because there may be a target for every address."""
        if error.errno in _UNREACHABLE:
            why = _UNREACHABLE[error.errno] or os.strerror(error.errno).lower()
            now = time.monotonic()
            known = self._unreachable.get(target) == why or len(self._unreachable) >= _MAX_UNREACHABLE
            if not known and now >= self._tell_unreachable.due:
                self._unreachable[target] = why
                line = f"{self.text}: cannot send to {host_port(*target[:2])}: {why}"
                self._tell_unreachable(logging.WARNING, now, line)

    def _log_reachable(self, target: SocketAddress) -> None:
        if self._unreachable.pop(target, None):
            log.info("%s: can send to %s again", self.text, host_port(*target[:2]))


class UdpListener(UdpLink):
    """Kind `udpin`: binds a port exclusively, without SO_REUSEADDR and SO_REUSEPORT.

    If this machine does not have the address, the link waits for it.
    """

    def __init__(self, url: Url, fraction: RandomFraction = random.random) -> None:
        """Open it. Raises LinkError if the port is in use or not allowed, or the host is unknown."""
        super().__init__(url, fraction)
        self._local_port = LocalPort(url, _new_socket, socket.SOCK_DGRAM, self._state_log)
        self._socket = self._local_port.bind()
        self.text = self._local_port.text
        self._senders = Senders(url, "datagram")
        self._due = math.inf if self._socket else -math.inf

    def receive(self, limit: int = 64) -> list[Received]:
        """The datagrams that wait, without those of other addresses than `from=` names."""
        pieces = super().receive(limit)
        return pieces if self._senders.everybody else self._admitted(pieces)

    def receive_dated(self, limit: int = 64) -> list[Dated]:
        """The same with stamps."""
        return self._admitted(super().receive_dated(limit))

    def _admitted(self, pieces: list[P]) -> list[P]:
        return [piece for piece in pieces if self._senders.admits(piece.source[0])]  # type: ignore[index]  # a host and a port

    def due(self) -> float:
        """When `service` has work."""
        return min(self._due, self._senders.due())

    def service(self, now: float) -> None:
        """Try to bind again; log what was refused."""
        super().service(now)
        self._senders.service(now, self.text)

    def _do_due(self, now: float) -> None:
        self._socket = self._local_port.try_bind()
        self.text = self._local_port.text
        self._due = math.inf if self._socket else self._backoff.after(now)


class UdpSender(UdpLink):
    """Kind `udpout`: sends to one peer, and receives from every address.

    The owner tells which address answers with MAVLink. Only that one counts until it is silent, or until an address
    that is nearer to the target answers: a router may answer from another port.
    A name that does not resolve yet is not an error; until it does, every send counts as dropped.
    """

    def __init__(self, url: Url, fraction: RandomFraction = random.random) -> None:
        """Open it. Raises LinkError if this machine does not support the address family."""
        super().__init__(url, fraction)
        self._host = url.host
        self._lookup = Lookup(url.host, url.port, socket.SOCK_DGRAM)
        found = self._lookup.result(RESOLVE_WAIT)
        if found:
            self._open(found[0])
        else:
            self._due = -math.inf

    def may_answer(self, source: Address, current: Address, silent: float) -> bool:
        """Whether this address may answer. `current` last answered `silent` seconds ago; None: no address has."""
        return current is None or silent > OTHER_SILENCE or self._nearness(source) > self._nearness(current)

    def answered(self, source: Address) -> None:
        """Note that this address answered with MAVLink. The log names it if it is not the target."""
        if isinstance(source, tuple) and self._peer is not None and self._nearness(source) < EXACT:
            line = f"{self.text}: {host_port(*source[:2])} answers"
            self._tell_answers(logging.INFO, time.monotonic(), line)

    def _nearness(self, source: Address) -> int:
        """How much this address has in common with the target: everything (EXACT), the host, or nothing."""
        if not isinstance(source, tuple) or self._peer is None or source[0] != self._peer[0]:
            return 0
        return EXACT if source[1] == self._peer[1] else 1

    def _open(self, target: Target) -> None:
        """Create the socket. It stays unconnected: the peer may answer from another address."""
        try:
            self._socket = _new_socket(target[0])
        except OSError as error:
            raise LinkError(f"{self.text}: {error.strerror}") from None
        self._peer = target[1]
        self._state_log.recovered(f"{self.text}: {self._host} is {self._peer[0]}")

    def _do_due(self, now: float) -> None:
        found = self._lookup.result()
        if found is None:
            self._due = now + CHECK_AGAIN
            return
        try:
            if found:
                self._open(found[0])
                return
            self._state_log.down(f"{self.text}: the name {self._host} does not resolve yet, trying again")
        except LinkError as problem:
            self._state_log.down(str(problem))
        self._due = self._backoff.after(now)


class UdpBroadcaster(UdpSender):
    """Kind `udpbcast`: broadcasts until a peer answers, then sends to that peer until it falls silent."""

    _broadcast_address: SocketAddress | None = None
    _answerer: SocketAddress | None = None
    _answered = False

    def receive(self, limit: int = 64) -> list[Received]:
        """The datagrams that wait."""
        pieces = super().receive(limit)
        self._hear(pieces)
        return pieces

    def receive_dated(self, limit: int = 64) -> list[Dated]:
        """The same with stamps."""
        pieces = super().receive_dated(limit)
        self._hear(pieces)
        return pieces

    def _hear(self, pieces: Sequence[Received | Dated]) -> None:
        if self._answerer is not None and any(piece.source == self._answerer for piece in pieces):
            self._send_to(self._answerer)

    def may_answer(self, source: Address, current: Address, silent: float) -> bool:
        """Whether this address may answer: the first one, and another one after a silence."""
        return current is None or silent > OTHER_SILENCE

    def answered(self, source: Address) -> None:
        """Send to this address from now on."""
        if isinstance(source, tuple):
            self._answerer = source
            self._send_to(source)

    def _send_to(self, peer: SocketAddress) -> None:
        if self._peer != peer:
            self._peer = peer
            self._state_log.up(f"{self.text}: {host_port(*peer[:2])} answers, sending to it")
        self._answered = True
        self._due = -math.inf

    def _open(self, target: Target) -> None:
        super()._open(target)
        assert self._socket is not None
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._broadcast_address = self._peer

    def _do_due(self, now: float) -> None:
        if self._socket is None:
            super()._do_due(now)
        elif self._answered:
            self._answered = False
            self._due = now + ANSWER_SILENCE
        else:
            assert self._peer is not None
            self._state_log.down(f"{self.text}: {host_port(*self._peer[:2])} is silent, broadcasting again")
            self._peer = self._broadcast_address


def _stamp(control: list[tuple[int, int, bytes]]) -> int | None:
    """The kernel's time stamp of a datagram, in microseconds since 1970."""
    for level, kind, value in control:
        if level == socket.SOL_SOCKET and kind == _SO_TIMESTAMPNS and len(value) == _TIMESPEC.size:
            seconds, nanoseconds = _TIMESPEC.unpack(value)
            return int(seconds) * 1_000_000 + int(nanoseconds) // 1000
    return None


def _new_socket(family: int) -> socket.socket:
    """A non-blocking socket with time stamps. Its receive buffer is as large as the system allows."""
    new = socket.socket(family, socket.SOCK_DGRAM)
    new.setblocking(False)
    with suppress(OSError):  # without stamps input counts as old after a pause
        new.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
    try:
        new.setsockopt(
            socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER
        )  # beyond the limit of the system: only for root
    except OSError:
        new.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    return new
