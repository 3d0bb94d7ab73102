"""Trying again: when, and what is said of it in the log."""

from __future__ import annotations

import logging
from collections.abc import Callable

JITTER = 0.1
"""The part of a wait that chance may take off, so that many who lost the same peer do not return in step."""

Chance = Callable[[], float]
"""A number from 0 to 1, such as random.random."""


class Backoff:
    """How long to wait before each attempt: `first` seconds, twice as long each time, at most `longest`."""

    def __init__(self, first: float, longest: float, chance: Chance) -> None:
        self._first = self._wait = first
        self._longest = longest
        self._chance = chance

    def after(self, now: float) -> float:
        """When the next attempt is due if one has failed at `now` (monotonic seconds)."""
        wait = self._wait * (1 - JITTER * self._chance())
        self._wait = min(2 * self._wait, self._longest)
        return now + wait

    def reset(self) -> None:
        """It went well: the next wait is short again."""
        self._wait = self._first


class Changes:
    """The state of a link in the log: a line where it changes, none where an attempt ends like the last one."""

    def __init__(self, log: logging.Logger) -> None:
        self._log = log
        self._last = ""

    def good(self, line: str) -> None:
        """It works."""
        self._say(logging.INFO, line)

    def good_again(self, line: str) -> None:
        """It works; nothing to say if there was never any trouble."""
        if self._last:
            self._say(logging.INFO, line)

    def bad(self, line: str) -> None:
        """It does not work, or not any more."""
        self._say(logging.WARNING, line)

    def _say(self, level: int, line: str) -> None:
        if line != self._last:
            self._last = line
            self._log.log(level, "%s", line)
