"""Log lines that a peer can cause: a bounded number of each kind, and a count of those left out."""

from __future__ import annotations

import logging
import math
from collections import deque
from typing import Final

PERIOD: Final = 30.0
"""Seconds in which there is one line of a kind."""
BURST: Final = 8, 8 * PERIOD
"""As many on average, for a kind of which several lines at once are usual."""


class PacedLog:
    """At most `most` lines in `period` seconds. The next line says how many were left out."""

    def __init__(self, log: logging.Logger, most: int = 1, period: float = PERIOD) -> None:
        self._log = log
        self._period = period
        self._times: deque[float] = deque(maxlen=most)
        self._left_out = 0

    @property
    def due(self) -> float:
        """From when on another line is logged, in seconds on the clock of the caller."""
        times = self._times
        return times[0] + self._period if len(times) == times.maxlen else -math.inf

    def __call__(self, level: int, now: float, line: str, error: Exception | None = None) -> bool:
        """Log a line at `now` (seconds), with the traceback of `error`, if it is not one too many.

        Returns whether it was logged.
        """
        if now < self.due:
            self._left_out += 1
            return False
        self._times.append(now)
        more = f" ({self._left_out} lines before it were left out)" if self._left_out else ""
        self._log.log(level, "%s%s", line, more, exc_info=error)
        self._left_out = 0
        return True
