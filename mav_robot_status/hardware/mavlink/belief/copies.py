"""The memory of frames: has this one been heard already?"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Hashable

    from .counts import Count

REMEMBERED: Final = 10.0
"""Seconds within which the same bytes are a copy."""
MOST_REMEMBERED: Final = 4096
"""Frames in one of two generations. A memory that drops its oldest frame each time would search for it."""
PROOF: Final = 3
"""This many copies show that a channel repeats the frames of a speaker."""
AT_ONCE: Final = 0.2
"""Seconds within which the same bytes are a copy, even from a sender whose number never changes."""
STREAM: Final = 2.0
"""Seconds for which a channel that brought a copy is a stream of copies."""
SAME_DELAY: Final = 0.5
MOST_MISSED: Final = 48
"""Frames of such a stream that may be lost before the next one."""
NEAR: Final = 8
"""Numbers within which a frame belongs to such a stream."""


class Original(NamedTuple):
    """A frame that was heard: when, and in which count."""

    at: float
    heard_in: Count


class Echo(NamedTuple):
    """The copies that a channel brought: how many, and the latest one."""

    copies: int
    sequence: int
    delay: float
    at: float
    heard_in: Count
    """The count of the original."""

    def repeats(self, sequence: int, now: float) -> bool:
        """Whether a frame that continues no count is the next one of this stream, and not a copy itself."""
        ahead = (sequence - self.sequence - 1) & 255
        return self.copies >= PROOF and now - self.at <= REMEMBERED and ahead <= MOST_MISSED

    def is_next(self, sequence: int, delay: float, now: float) -> bool:
        """Whether a frame with known bytes is one more copy of this stream."""
        near = (sequence - self.sequence) & 255 <= NEAR
        return now - self.at < STREAM and near and abs(delay - self.delay) < SAME_DELAY


class Copies:
    """The frames of the last REMEMBERED to 2 REMEMBERED seconds, by the hash of their bytes, and copies by channel."""

    def __init__(self) -> None:
        self._recent: dict[int, Original] = {}
        self._former: dict[int, Original] = {}
        self._turns_at = -math.inf
        self.echoes: dict[Hashable, Echo] = {}

    def original(self, key: int, now: float) -> Original | None:
        """The same bytes, if they were heard within REMEMBERED seconds."""
        found = self._recent.get(key) or self._former.get(key)
        return found if found is not None and now - found.at <= REMEMBERED else None

    def remember(self, key: int, original: Original) -> None:
        """Note a frame that was heard."""
        if original.at >= self._turns_at or len(self._recent) >= MOST_REMEMBERED:
            self._recent, self._former, self._turns_at = {}, self._recent, original.at + REMEMBERED
        self._recent[key] = original

    def copied(self, channel: Hashable, sequence: int, original: Original, now: float) -> None:
        """Note a copy on a channel."""
        echo = self.echoes.get(channel)
        copies = 1 if echo is None or now - echo.at > REMEMBERED else echo.copies + 1
        self.echoes[channel] = Echo(copies, sequence, now - original.at, now, original.heard_in)

    def is_said_anew(self, channel: Hashable, sequence: int, original: Original, ahead: int | None, now: float) -> bool:
        """Whether known bytes without a clock are said anew. `ahead`: their place in a count of the channel."""
        if ahead is None or ahead <= 0:
            return False
        age = now - original.at
        if age < AT_ONCE or (age < AT_ONCE + 0.1 and original.heard_in.changes):
            return False
        echo = self.echoes.get(channel)
        return echo is None or not echo.is_next(sequence, age, now)
