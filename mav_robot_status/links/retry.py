"""Retries: when the next one is due, and what the log says."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable

from mav_robot_status.paced_log import BURST, PacedLog

JITTER = 0.1
"""The fraction of a wait that is random, so that many clients of one server do not reconnect at the same time."""

RandomFraction = Callable[[], float]
"""A number from 0 to 1, such as random.random."""


class Backoff:
    """The wait before each attempt: `first` seconds, then twice as long each time, at most `longest`."""

    def __init__(self, first: float, longest: float, fraction: RandomFraction) -> None:
        self._first = self._wait = first
        self._longest = longest
        self._fraction = fraction

    def after(self, now: float) -> float:
        """When the next attempt is due after a failure at `now` (monotonic seconds)."""
        wait = self._wait * (1 - JITTER * self._fraction())
        self._wait = min(2 * self._wait, self._longest)
        return now + wait

    def reset(self) -> None:
        """Call this after a successful attempt: the next wait is `first` again."""
        self._wait = self._first


class StateLog:
    """Logs the state of a link: one line for each change, none for an attempt that ends like the last one.

    A peer can cause changes all the time. So a line may be left out, but never the end of a trouble that was told.
    """

    def __init__(self, log: logging.Logger, clock: Callable[[], float] = time.monotonic) -> None:
        self._log = log
        self._clock = clock
        self._tell = PacedLog(log, *BURST)
        self._last = ""
        self._is_down = False
        """Whether the last line told a trouble."""

    def up(self, line: str) -> None:
        """The link works."""
        self._log_change(logging.INFO, line)

    def recovered(self, line: str) -> None:
        """The link works again; logs nothing if it has never failed."""
        if self._last:
            self._log_change(logging.INFO, line)

    def down(self, line: str, error: Exception | None = None) -> None:
        """The link does not work. `error` adds its traceback."""
        self._log_change(logging.WARNING, line, error)

    def _log_change(self, level: int, line: str, error: Exception | None = None) -> None:
        if line == self._last:
            return
        ends = self._is_down and level == logging.INFO
        if ends:
            self._log.log(level, "%s", line)
        if ends or self._tell(level, self._clock(), line, error):
            self._last, self._is_down = line, level != logging.INFO
