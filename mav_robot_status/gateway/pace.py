"""When the event loop looks for input, and how much it reads: at once while little arrives, in batches in a flood.

A wake-up costs as much as ten frames. Any input may be urgent, and only a read shows whether it is. So all input is
read at once, as long as no more than RATE pieces arrive a second. Above that it gathers for PACE.
"""

from __future__ import annotations

import math
from typing import Final

RATE: Final = 2000.0
"""Pieces a second up to which nothing is delayed."""
PACE: Final = 0.002
"""Seconds between two looks while more than that arrive."""
BURST: Final = 16
"""Pieces that may arrive at any rate without a delay."""
EACH: Final = 1 / RATE
EMPTIED: Final = BURST / RATE
"""Seconds until a bucket with one piece is empty; the same for a full bucket."""
UNCOUNTED: Final = round(RATE * PACE)
"""A source that does not count its pieces is paced if it wakes the process more than 500 times a second."""
MOST_AT_ONCE: Final = 1024
"""Datagrams of usual length read in one wake-up of each link; bounded, so that a flood does not stop the rest."""


class Pace:
    """A bucket that holds BURST pieces and empties at RATE. Times are monotonic seconds."""

    __slots__ = ("gather", "rests_until")

    def __init__(self, gather: float = 0.0) -> None:
        """`gather`: seconds for which input always gathers, see `coalesce` of the configuration."""
        self.gather = gather
        self.rests_until = -math.inf
        """The loop does not look before this time."""

    def count(self, pieces: int, now: float) -> None:
        """Note that so many pieces were read at `now`."""
        if self.gather:
            self.rests_until = now + self.gather
            return
        full = max(self.rests_until, now - EMPTIED) + pieces * EACH
        self.rests_until = min(full, now + PACE)
