"""Time as a value: functions get an `Instant` as an argument; only the gateway reads a clock."""

from __future__ import annotations

import time
from datetime import datetime, timezone
from functools import lru_cache
from typing import Final, NamedTuple

FIRST_SECOND: Final = 0
LAST_SECOND: Final = 253_402_300_799  # 9999-12-31T23:59:59Z


class Instant(NamedTuple):
    """One moment on two clocks."""

    mono: float
    """Seconds on a clock that never steps, and that continues while the system is suspended. All durations use it."""
    unix_us: int
    """Microseconds since 1970 in UTC. Only time stamps use it."""


def now() -> Instant:
    """The present time, for the live gateway. A log has its own instants."""
    # called in every turn of the live loop
    return tuple.__new__(Instant, (time.clock_gettime(time.CLOCK_BOOTTIME), time.time_ns() // 1000))


def later(start: Instant, seconds: float) -> Instant:
    """The instant `seconds` after `start`, on both clocks."""
    return Instant(start.mono + seconds, start.unix_us + round(seconds * 1e6))


def rfc3339(unix_us: int) -> str:
    """`2026-11-20T18:49:07.123456Z`: always UTC with six decimals."""
    seconds, us = divmod(unix_us, 1_000_000)
    return f"{_second(seconds)}.{us:06d}Z"


@lru_cache(maxsize=64)
def _second(unix_s: int) -> str:
    if not FIRST_SECOND <= unix_s <= LAST_SECOND:  # a log may hold any number
        unix_s = min(max(unix_s, FIRST_SECOND), LAST_SECOND)
    return datetime.fromtimestamp(unix_s, timezone.utc).isoformat()[:19]
