"""One count of sequence numbers: which number is next, missing, late or lost."""

from __future__ import annotations

from collections import deque
from math import inf
from typing import TYPE_CHECKING, Any, Final

from .clock import Lag

if TYPE_CHECKING:
    from collections.abc import Hashable

MAX_DROPOUT: Final = 48
"""A frame continues the count if it is ahead of it by at most this many lost frames."""
MAX_MISORDER: Final = 48
"""A late frame is at most this many numbers behind, and LATE_FOR seconds."""
LATE_FOR: Final = 5.0
SETTLES: Final = 1.0
"""Seconds after which a missing number is lost."""
LOOK: Final = 0.2
"""Seconds between two looks at the missing numbers."""
STANDS_STILL: Final = 10.0
"""Seconds within which a sender whose number never changes is heard again."""
SAME: Final = 256
"""The place of a frame of a sender whose number never changes."""
JUST_BEFORE: Final = 1e-4  # s
HELD: Final = 3
"""A frame at most this many numbers ahead after a silence was held back: the count shows that nothing was lost."""


class Count:
    """A count on one channel. Numbers are unwrapped: they rise for ever. Times are monotonic seconds."""

    def __init__(self, speaker: Any, channel: Hashable, sequence: int, now: float, source: Count | None = None) -> None:
        """`sequence` is that of its first frame. `source`: the count whose frames this channel repeats."""
        self.speaker, self.channel, self.source = speaker, channel, source
        self.index = sequence + 255  # of the newest frame; the first one advances it by one
        self.at = self.began = now
        self.lag = Lag()
        self.ticked_at = -inf
        """When its newest frame with a clock was said."""
        self.changes = False
        """Whether its numbers change at all."""
        self._first = self.index + 1
        self._told = self._first
        self._missing: dict[int, tuple[float, float]] = {}
        """By number: when it was found missing, and when the frame before the gap arrived."""
        self._used: set[int] = set()
        self._said: deque[tuple[int, float]] = deque(maxlen=64)
        self._pace = self._look_at = 0.0

    def place(self, sequence: int, now: float) -> int | None:
        """How far a frame is ahead (> 0) of the newest one, or behind (< 0). None: it does not continue the count."""
        ahead = (sequence - self.index) & 255
        if 0 < ahead <= MAX_DROPOUT + 1:
            return ahead
        if ahead == 0:
            return None if self.changes or now - self.at > STANDS_STILL else SAME
        behind = 256 - ahead
        if behind > MAX_MISORDER or now - self.at > LATE_FOR:
            return None
        number = self.index - behind
        before_first = number < self._first and now - self.began < SETTLES
        return -behind if number in self._missing or before_first else None

    def distance(self, sequence: int) -> int:
        """How far a number is from the newest one, ahead or behind."""
        return min((sequence - self.index) & 255, (self.index - sequence) & 255)

    def is_silent(self, since: float) -> bool:
        """Whether it fell silent before a time: for longer than its frames are apart."""
        return since - self.at > min(SETTLES, 10 * self._pace or SETTLES)

    def held_for(self, ahead: int, now: float) -> float:
        """Seconds for which a frame was held back: it follows a silence in which hardly a number was used."""
        silent = now - self.at
        if silent > SETTLES and ahead <= HELD and self._pace and silent > 10 * self._pace * ahead:
            return silent - ahead * self._pace
        return 0.0

    def advance(self, ahead: int, now: float, said: float) -> float | None:
        """Note the newest frame. Returns the time since which frames are lost, once for each gap."""
        if ahead != SAME:
            gap = (now - self.at) / ahead
            if gap < SETTLES:
                self._pace = self._pace + 0.05 * (gap - self._pace) if self._pace else gap
            for number in range(self.index + 1, self.index + ahead):
                if number not in self._used:
                    self._missing[number] = now, self.at
            if self._used:
                self._used = {number for number in self._used if number > self.index + ahead}
            self.changes = self.changes or self.index >= self._first
        self.index += ahead
        self.at = now
        self._said.append((self.index, said))
        if self.source is not None:
            self.source.fill(self.index & 255)
        return self._lost(now) if self._missing and now >= self._look_at else None

    @property
    def last_said(self) -> float:
        """When its newest frame was said; -inf before the first one."""
        return self._said[-1][1] if self._said else -inf

    def said_after(self, behind: int) -> float:
        """When the next number after that of a late frame was said."""
        number = self.index - behind
        return next((said for n, said in self._said if n > number), inf)

    def fill(self, sequence: int) -> None:
        """Note that a number is used by a frame that does not advance the count: it is not missing."""
        ahead = (sequence - self.index) & 255
        if ahead <= MAX_DROPOUT:
            self._used.add(self.index + ahead)
        self._missing.pop(self.index + ahead - 256, None)

    def _lost(self, now: float) -> float | None:
        self._look_at = now + LOOK
        repeats = self.source is not None and now - self.source.at < SETTLES  # then the source tells what is lost
        since = None
        for number, (found, before) in list(self._missing.items()):
            if now - found <= SETTLES and number >= self.index - MAX_MISORDER:
                break
            if number >= self._told and not repeats:
                since, self._told = before, number + 1
            if now - found > LATE_FOR or number < self.index - MAX_MISORDER:
                del self._missing[number]
        return since

    def said_behind(self, behind: int, latest: float) -> float:
        """When a late frame was said: just before the next number, at `latest`."""
        number = self.index - behind
        self._missing.pop(number, None)
        said = min(latest, self.said_after(behind) - JUST_BEFORE)
        self._said = deque(sorted((*self._said, (number, said))), maxlen=self._said.maxlen)
        return said
