"""`ManualClock`: time that passes only when a test says so."""

from __future__ import annotations

from ..clock import Instant, later

START = Instant(1000.0, 1_795_201_787_000_000)


class ManualClock:
    """A clock for tests: calling it, or `now()`, gives the present `Instant`; `advance` moves both of its times."""

    def __init__(self, start: Instant = START) -> None:
        self._start = start
        self._elapsed_us = 0

    def now(self) -> Instant:
        """The present, the same until `advance` is called."""
        return later(self._start, self._elapsed_us / 1e6)

    __call__ = now

    def advance(self, seconds: float) -> Instant:
        """Let `seconds` pass; the new present. Raises ValueError for a negative number: `mono` never steps back."""
        if seconds < 0:
            raise ValueError(f"a clock cannot advance by {seconds} s; give 0 or more")
        self._elapsed_us += round(seconds * 1e6)  # whole microseconds: twenty times 0.05 s are one second
        return self.now()
