"""From a host and a port to socket addresses, without waiting for a name server."""

from __future__ import annotations

import socket
import threading
from contextlib import suppress
from typing import Any

CHECK_AGAIN = 0.2
"""Seconds between two checks of a running lookup."""

Target = tuple[int, tuple[Any, ...]]  # address family, socket address


def addresses(host: str, port: int, kind: socket.SocketKind, flags: int = 0) -> list[Target]:
    """The addresses of a host, IPv4 first: most autopilots speak only IPv4, even if their name also has IPv6 addresses.

    May block for a name. Raises OSError (unknown name) or ValueError (invalid name).
    """
    name = host.encode("ascii") if host.isascii() else host  # a str loads the tables of IDNA, a megabyte
    found = socket.getaddrinfo(name, port, type=kind, flags=flags)
    return sorted(((family, where) for family, _, _, _, where in found), key=lambda target: target[0] != socket.AF_INET)


class Lookup:
    """Resolves a host in a thread, because a lookup can take many seconds and cannot be interrupted."""

    def __init__(self, host: str, port: int, kind: socket.SocketKind) -> None:
        """Starts no lookup yet."""
        self._query = host, port, kind
        self._found: list[Target] = []
        self._thread: threading.Thread | None = None
        self._numeric: list[Target] = []
        with suppress(OSError, ValueError):
            self._numeric = addresses(host, port, kind, socket.AI_NUMERICHOST)

    def result(self, wait: float = 0.0) -> list[Target] | None:
        """The addresses; empty if the host is not known at present. The next call starts a new lookup.

        None if the lookup has not finished after `wait` seconds: call again after CHECK_AGAIN.
        """
        if self._numeric:
            return self._numeric
        if self._thread is None:
            self._found = []
            self._thread = threading.Thread(target=self._run, name=f"resolve {self._query[0]}", daemon=True)
            self._thread.start()
        self._thread.join(wait)
        if self._thread.is_alive():
            return None
        self._thread = None
        return self._found

    def _run(self) -> None:
        with suppress(OSError, ValueError):
            self._found = addresses(*self._query)
