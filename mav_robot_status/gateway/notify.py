"""What systemd is told: ready, reloading, stopping, and that the loop still turns. See sd_notify(3).

Nothing happens where no one listens: without NOTIFY_SOCKET in the environment.
"""

from __future__ import annotations

import math
import os
import socket
from contextlib import suppress
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

FED_EARLY: Final = 0.5
"""Part of the watchdog's time after which it is fed again: sd_watchdog_enabled(3) recommends half."""

RETRY: Final = 0.1  # s until a watchdog that found no room for its food is fed again


class Notifier:
    """The socket of the service manager. It never waits and never raises: a message that finds no room is lost.

    The watchdog is fed by `turn` only, which is the loop's: a loop that hangs is one that systemd restarts.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket: socket.socket | None = None
        if address.startswith(("/", "@")):
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            self._socket.setblocking(False)
        self._period = _watchdog(environment) * FED_EARLY if self._socket else math.inf
        self._feed_at = -math.inf

    def ready(self) -> None:
        """The links are open; or they are again after a reload."""
        self._tell("READY=1")

    def reloading(self, now: float) -> None:
        """The configuration is being read again; `now` is in monotonic seconds."""
        self._tell("RELOADING=1", f"MONOTONIC_USEC={round(now * 1e6)}")

    def stopping(self) -> None:
        """The end has begun."""
        self._tell("STOPPING=1")

    def turn(self, now: float) -> None:
        """The loop turns: feed the watchdog if it is time."""
        if now >= self._feed_at and self._period < math.inf:
            self._feed_at = now + (self._period if self._tell("WATCHDOG=1") else min(self._period, RETRY))

    def next_due(self) -> float:
        """When (monotonic seconds) `turn` has something to do; infinite without a watchdog."""
        return self._feed_at if self._period < math.inf else math.inf

    def close(self) -> None:
        """Let go of the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _tell(self, *lines: str) -> bool:
        with suppress(OSError):  # nobody listens any more, or not now
            return self._socket is not None and self._socket.sendto("\n".join(lines).encode(), self._address) > 0
        return False


def _watchdog(environment: Mapping[str, str]) -> float:
    """Seconds after which a watchdog that is not fed bites; infinite if there is none, or it is another process's."""
    period, process = environment.get("WATCHDOG_USEC", ""), environment.get("WATCHDOG_PID", "")
    if not (period.isascii() and period.isdigit() and int(period)) or process not in ("", str(os.getpid())):
        return math.inf
    return int(period) / 1e6
