"""`ManualClock`: a clock that only a test advances."""

from __future__ import annotations

from ..clock import Instant, later

START = Instant(1000.0, 1_795_201_787_000_000)


class ManualClock:
    """A clock for tests: `now()`, or a call of the clock, returns the current `Instant`."""

    def __init__(self, start: Instant = START) -> None:
        self._start = start
        self._elapsed_us = 0

    def now(self) -> Instant:
        """The current time; it changes only by `advance`."""
        return later(self._start, self._elapsed_us / 1e6)

    __call__ = now

    def advance(self, seconds: float) -> Instant:
        """Advance by `seconds`, and return the new time. Raises ValueError if negative: `mono` never steps back."""
        if seconds < 0:
            raise ValueError(f"a clock cannot advance by {seconds} s; give 0 or more")
        self._elapsed_us += round(seconds * 1e6)  # whole microseconds, so that twenty times 0.05 s is one second
        return self.now()
