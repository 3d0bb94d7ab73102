"""UDP links: listening on a port, or sending to one. IPv4 and IPv6."""

from __future__ import annotations

import errno
import glob
import os
import socket
import struct
import threading
from contextlib import suppress
from typing import Any

from mav_robot_status.errors import LinkError
from mav_robot_status.link.base import Address, Received
from mav_robot_status.link.url import Url

RECEIVE_BUFFER = 4 << 20
"""Bytes that the kernel is asked to hold for us: seconds of traffic while the process is not scheduled."""
RESOLVE_EVERY = 5.0
"""Seconds between two attempts to resolve the name of a peer."""
RESOLVE_WAIT = 0.2
"""Seconds that opening waits for the first attempt, so that a name that is known is there for the first send."""

_LARGEST = 65535
_SO_RCVBUFFORCE = 33  # Linux; Python does not name these
_SO_MEMINFO = 55
_MEMINFO = struct.Struct("9I")  # the last word counts what the kernel dropped

_Info = tuple[int, tuple[Any, ...]]  # address family, socket address


class UdpLink:
    """A UDP socket as a `Link`: kind `udpin` listens, kind `udpout` sends to one peer and hears whoever answers.

    The kernel's drop counter is read when a `receive` reached its limit, and only then: a queue that overflowed is
    longer than that. It costs nothing at ordinary rates; SO_RXQ_OVFL needs recvmsg, a third more for every datagram.
    """

    stream = False

    def __init__(self, url: Url) -> None:
        """Open it. Raises LinkError if the port is taken or not allowed, or the address is not this machine's.

        A peer whose name does not resolve yet is no error: it is asked for again every RESOLVE_EVERY seconds, by a
        thread because resolving can block. Until then `fileno` is -1 and what is sent counts as dropped.
        """
        self.text = url.words()
        self.dropped = 0
        self._kernel_dropped = 0
        self._socket: socket.socket | None = None
        self._peer: tuple[Any, ...] | None = None
        self._resolved: _Info | None = None
        self._closed = threading.Event()
        if url.kind == "udpin":
            self._socket = _listen(url)
            port = int(self._socket.getsockname()[1])
            self.text = url._replace(port=port).words()
        else:
            self._start_resolving(url)
            self._connect()

    def fileno(self) -> int:
        """The socket's descriptor; -1 once closed, and before the peer's name is resolved."""
        return self._socket.fileno() if self._socket else -1

    @property
    def port(self) -> int:
        """The local port; 0 while there is none."""
        return int(self._socket.getsockname()[1]) if self._socket else 0

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
            return pieces
        self._count_kernel_drops()
        return pieces

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send to `to`, a source that `receive` gave, or to the peer. False if it was not sent.

        Raises LinkError if a name resolved to a kind of address that this machine cannot use.
        """
        if self._socket is None:
            self._connect()
        target = to if isinstance(to, tuple) else self._peer
        if self._socket is not None and target is not None:
            with suppress(OSError):  # full, refused, unreachable, too long: a datagram is lost, the link is not
                self._socket.sendto(data, target)
                return True
        self.dropped += 1
        return False

    def close(self) -> None:
        """Close the socket and stop asking for the peer's name."""
        self._closed.set()
        if self._socket:
            self._socket.close()

    def _count_kernel_drops(self) -> None:
        with suppress(OSError, struct.error):  # a kernel that does not tell
            assert self._socket is not None
            total = _MEMINFO.unpack(self._socket.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size))[-1]
            self.dropped += (total - self._kernel_dropped) & 0xFFFFFFFF
            self._kernel_dropped = total

    def _start_resolving(self, url: Url) -> None:
        """A numeric address at once, a name in a thread of its own."""
        try:
            self._resolved = _resolve(url, socket.AI_NUMERICHOST)
        except (OSError, ValueError):
            thread = threading.Thread(target=self._keep_resolving, args=(url,), name=f"resolve {url.host}", daemon=True)
            thread.start()
            thread.join(RESOLVE_WAIT)

    def _keep_resolving(self, url: Url) -> None:
        while not self._closed.is_set():
            with suppress(OSError, ValueError):
                self._resolved = _resolve(url)
                return
            self._closed.wait(RESOLVE_EVERY)

    def _connect(self) -> None:
        """Make the socket once the address is known. It stays unconnected: an answer may come from another address."""
        if self._resolved is not None and not self._closed.is_set():
            family, self._peer = self._resolved
            try:
                self._socket = _new_socket(family)
            except OSError as error:
                raise LinkError(f"{self.text}: {error.strerror}") from None


def _resolve(url: Url, flags: int = 0) -> _Info:
    """The first address of the host. Raises OSError (unknown) or ValueError (no possible name)."""
    family, _, _, _, address = socket.getaddrinfo(url.host, url.port, type=socket.SOCK_DGRAM, flags=flags)[0]
    return family, address


def _new_socket(family: int) -> socket.socket:
    """A non-blocking socket with a large receive buffer: as large as the system allows."""
    new = socket.socket(family, socket.SOCK_DGRAM)
    new.setblocking(False)
    try:
        new.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, RECEIVE_BUFFER)  # above the system's limit: for root only
    except OSError:
        new.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
    return new


def _listen(url: Url) -> socket.socket:
    """A socket bound to the port, for us alone: neither SO_REUSEADDR nor SO_REUSEPORT."""
    where = f"udp port {url.port} on {url.host}"
    try:
        family, address = _resolve(url, socket.AI_PASSIVE)
    except (OSError, ValueError):
        raise LinkError(f"{url.host!r} is not a known host; to listen write an address of this machine") from None
    new = _new_socket(family)
    try:
        new.bind(address)
    except OSError as error:
        new.close()
        raise LinkError(_why_not(error, where, url.port)) from None
    return new


def _why_not(error: OSError, where: str, port: int) -> str:
    """One line for a person whose port could not be had."""
    if error.errno == errno.EADDRINUSE:
        return f"{where} is taken by {port_owner(port) or 'another program'}; stop it or listen on another port"
    if error.errno == errno.EACCES:
        return f"{where}: no permission; ports below 1024 are the system's, listen on another one"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"{where}: this machine has no such address; listen on one of its own, or on 0.0.0.0 for all"
    return f"{where}: {error.strerror}"


def port_owner(port: int) -> str:
    """Who holds a UDP port, `mavproxy.py (pid 1234)`, as far as /proc tells this user; else empty. Never raises."""
    sockets = {f"socket:[{inode}]" for table in ("/proc/net/udp", "/proc/net/udp6") for inode in _inodes(table, port)}
    for link in glob.iglob("/proc/[0-9]*/fd/*") if sockets else ():
        with suppress(OSError):  # gone meanwhile, or another user's
            if os.readlink(link) in sockets:
                pid = link.split("/")[2]
                with open(f"/proc/{pid}/comm", encoding="utf-8", errors="replace") as comm:
                    return f"{comm.read().strip()} (pid {pid})"
    return ""


def _inodes(table: str, port: int) -> list[str]:
    """The inodes of the sockets bound to a port, in a table of /proc/net: `sl address:PORT ... inode`."""
    with suppress(OSError, IndexError), open(table, encoding="ascii", errors="replace") as lines:
        rows = [line.split() for line in lines][1:]
        return [row[9] for row in rows if row[1].endswith(f":{port:04X}")]
    return []
