"""Messages to systemd: ready, reloading, stopping, and the watchdog. See sd_notify(3).

Without NOTIFY_SOCKET in the environment nothing is sent.
"""

from __future__ import annotations

import math
import os
import socket
from contextlib import suppress
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Mapping

NOTIFY_AFTER: Final = 0.5
"""Fraction of the watchdog period between two notifications. sd_watchdog_enabled(3) recommends half."""

RETRY: Final = 0.1  # s until a failed watchdog message is sent again


class SystemdNotifier:
    """The socket of the service manager. It never blocks or raises: if the socket is full, a message is lost.

    Only `turn` notifies the watchdog. The event loop calls it, so systemd restarts a loop that hangs.
    """

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = "\0" + address[1:] if address.startswith("@") else address
        self._socket: socket.socket | None = None
        if address.startswith(("/", "@")):
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
            self._socket.setblocking(False)
        self._period = _watchdog(environment) * NOTIFY_AFTER if self._socket else math.inf
        self._watchdog_at = -math.inf

    def ready(self) -> None:
        """The links are open, at the start or after a reload."""
        self._send("READY=1")

    def reloading(self, now: float) -> None:
        """The configuration is being read again; `now` is in monotonic seconds."""
        self._send("RELOADING=1", f"MONOTONIC_USEC={round(now * 1e6)}")

    def stopping(self) -> None:
        """The gateway is stopping."""
        self._send("STOPPING=1")

    def turn(self, now: float) -> None:
        """Notify the watchdog if it is due."""
        if now >= self._watchdog_at and self._period < math.inf:
            self._watchdog_at = now + (self._period if self._send("WATCHDOG=1") else min(self._period, RETRY))

    def next_due(self) -> float:
        """When (monotonic seconds) `turn` has something to do; infinite without a watchdog."""
        return self._watchdog_at if self._period < math.inf else math.inf

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _send(self, *lines: str) -> bool:
        with suppress(OSError):  # the receiver is gone, or its queue is full
            return self._socket is not None and self._socket.sendto("\n".join(lines).encode(), self._address) > 0
        return False


def _watchdog(environment: Mapping[str, str]) -> float:
    """The watchdog period in seconds; infinite without a watchdog, or if it is for another process."""
    period, process = environment.get("WATCHDOG_USEC", ""), environment.get("WATCHDOG_PID", "")
    if not (period.isascii() and period.isdigit() and int(period)) or process not in ("", str(os.getpid())):
        return math.inf
    return int(period) / 1e6
