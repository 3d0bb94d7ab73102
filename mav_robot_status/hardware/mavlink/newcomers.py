"""Who gets a place among the vehicles while their table is full, or while somebody floods it with ids.

A vehicle sends its HEARTBEAT once a second. A flood of forged ids rarely repeats one. While newcomers crowd, an id gets
a place only after heartbeats in several seconds. Bounded: a byte for each pair of ids.
"""

from __future__ import annotations

import logging
import math
from typing import Final

log = logging.getLogger(__name__)

SECONDS: Final = 3
"""A newcomer must have sent a HEARTBEAT in this many different seconds of a WINDOW."""
WINDOW: Final = 10.0
LOG_PERIOD: Final = 60.0  # s between two log lines
PAIRS: Final = 1 << 16


class Newcomers:
    """Counts the heartbeats of ids without a place, while newcomers crowd."""

    def __init__(self) -> None:
        self._crowded_until = self._second_ends = self._window_ends = self._log_at = -math.inf
        self._second = self._seconds = bytearray()
        """Which ids sent a heartbeat in this second, and in how many seconds of this window."""

    def admits(self, ids: tuple[int, int], full: bool, now: float) -> bool:
        """Whether an id without a place, which sends a heartbeat, gets one. `full`: no place is free."""
        if full and now >= self._log_at:
            self._log_at = now + LOG_PERIOD
            log.warning(
                "no place for vehicle %d.%d: the table of vehicles is full. A newcomer gets the place of a vehicle "
                "that is silent; vehicles in the configuration always have theirs",
                *ids,
            )
        if not full and now >= self._crowded_until:
            self._second = self._seconds = bytearray()
            return True
        self._crowded_until = now + WINDOW
        if now >= self._window_ends or not self._seconds:
            self._seconds, self._window_ends = bytearray(PAIRS), now + WINDOW
        if now >= self._second_ends or not self._second:
            self._second, self._second_ends = bytearray(PAIRS), now + 1.0
        pair = ids[0] << 8 | ids[1]
        if not self._second[pair]:
            self._second[pair] = 1
            self._seconds[pair] += 1
        return self._seconds[pair] >= SECONDS
