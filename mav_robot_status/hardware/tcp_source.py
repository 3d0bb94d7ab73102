"""One TCP connection of a hardware interface to the controller of a robot, and what it logs about it."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from typing import Final

from ..clock import Instant
from ..links.tcp import TcpLink
from ..links.url import parse

log = logging.getLogger(__name__)

MINUTE: Final = 60.0  # s
PAUSE: Final = 2.0
"""This many seconds between two turns mean that this program was stopped: a running gateway turns every second."""

MOST_PIECES: Final = 4
"""Pieces of 8 kB that one turn reads, however much waits: a controller that floods does not delay a vehicle."""


class TcpSource:
    """One TCP connection, as a source. What it receives goes to `heard`."""

    def __init__(self, host: str, port: float, heard: Callable[[bytes, Instant], None]) -> None:
        """Connects later, and again after each loss."""
        self.link = TcpLink(parse(f"tcp:{_bracketed(host)}:{int(port)}"))
        self._heard = heard
        self._known = 0
        self._turn_at = math.inf

    def turn(self, now: Instant) -> None:
        """Note that the gateway runs. A hardware interface calls this in `read`."""
        self._turn_at = now.mono

    def is_new(self) -> bool:
        """Whether there is a new connection since this last returned True."""
        if not self.link.connected or self.link.connections == self._known:
            return False
        self._known = self.link.connections
        return True

    def fileno(self) -> int:
        """The descriptor to poll."""
        return self.link.fileno()

    def receive(self, now: Instant, limit: int) -> None:
        """Read the pending input. After a pause it has no date: it is dropped, with its connection."""
        if now.mono - self._turn_at > PAUSE:
            self._turn_at = now.mono
            self.link.reconnect()
        for data, _ in self.link.receive(min(limit, MOST_PIECES)):
            self._heard(data, now)

    def next_due(self) -> float:
        """When to connect."""
        return self.link.due()

    def service(self, now: Instant) -> None:
        """Connect or reconnect."""
        self.link.service(now.mono)

    def close(self) -> None:
        """Close the connection."""
        self.link.close()


class FaultLog:
    """Logs the faults of a controller: one line until data arrives again, and at most one a minute."""

    def __init__(self, name: str) -> None:
        """`name` is that of the hardware interface."""
        self._name = name
        self._again_at = -math.inf
        self._told = False

    def fault(self, line: str, now: float) -> None:
        """There is a fault at `now`, monotonic seconds."""
        if not self._told and now >= self._again_at:
            self._told, self._again_at = True, now + MINUTE
            log.warning("%s: %s", self._name, line)

    def works(self) -> None:
        """Data has arrived."""
        self._told = False


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host and not host.startswith("[") else host
