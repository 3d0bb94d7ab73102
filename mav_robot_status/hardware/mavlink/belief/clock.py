"""The boot clock of one speaker: when it booted, and how late a frame is.

Sources: MAVLink developer guide, routing: a `time_boot_ms` that goes back means a reboot. Transport only delays, so the
fastest frame gives the offset of the clock (the minimum-delay filter of NTP). A simulation slower or faster than real
time changes the delay in small steps; a link that holds frames back does so in one step.
"""

from __future__ import annotations

from enum import Enum
from math import inf
from typing import Final

WRAP: Final = 2**32 / 1000  # seconds, of a clock of 32 bits in milliseconds
STEP: Final = 1.0
"""Seconds by which the lag grows from one frame to the next if a frame was held back. Less is the rate of the clock."""
NOT_LATE: Final = 0.3
"""Seconds of lag below which lateness ends."""
JUMP: Final = 2.0
"""Seconds by which boot times of one boot differ at most."""
SAMPLES, SPAN = 3, 1.0
"""This many samples over this many seconds prove a boot time."""
CHUNK: Final = 2.0
"""Seconds of which the least lag counts for the rate of the clock."""
DOUBT: Final = 5.0
"""Seconds after which an unconfirmed boot time is forgotten."""
NEAR: Final = 2.0
"""Seconds for which frames without a clock have the lag of the latest one with a clock."""


class Change(Enum):
    """What a sample shows beside the lag."""

    BOOT = "boot"
    """The clock began after the last frame of the run before."""
    EXCHANGE = "exchange"
    """The clock is ahead of every one before: of a vehicle that has run for longer."""


def turned(seconds: float) -> float:
    """A difference of two times of a clock that wraps, as the shorter way round."""
    return (seconds + WRAP / 2) % WRAP - WRAP / 2


class Lag:
    """How late the frames of one count are. Times are monotonic seconds of arrival, lags seconds."""

    def __init__(self) -> None:
        self.seconds, self.at = 0.0, -inf
        """How late the latest frame with a clock was, and when it arrived."""
        self._before, self._late = 0.0, False
        self._chunk_at, self._least, self._former, self._steps = -inf, 0.0, inf, 0.0

    def near(self, now: float) -> float:
        """The lag of a frame without a clock."""
        return self.seconds if now - self.at <= NEAR else 0.0

    def hear(self, lag: float, now: float) -> float:
        """Note the delay of a frame. Returns by how much the boot time moves.

        Lateness begins with a step, and ends when it is small again.
        """
        step = lag - self._before if lag - self._before > STEP else 0.0
        moves = self._follow_rate(lag, now)
        self._steps += step
        self._before = lag = lag - moves
        self._late = lag > NOT_LATE and (self._late or step > 0)
        self.seconds, self.at = lag if self._late else 0.0, now
        return moves

    def _follow_rate(self, lag: float, now: float) -> float:
        """How much the least delay of a CHUNK has grown, but for steps: that is the rate of the clock."""
        age = now - self._chunk_at
        if age <= CHUNK:
            self._least = min(self._least, lag)
            return 0.0
        follows = age < 2 * CHUNK and not self._late
        moves = max(0.0, self._least - self._former - self._steps) if follows else 0.0
        self._former = self._least - moves if age < 2 * CHUNK else inf
        self._chunk_at, self._least, self._steps = now, lag - moves, 0.0
        return moves

    def faster(self, gained: float) -> None:
        """Note that a frame of this count was faster than all before: the delays before it were greater."""
        self._least += gained
        self._former += gained

    def hold(self, seconds: float, now: float) -> None:
        """Note that the frames since the latest one were held back."""
        self.seconds, self.at = seconds, now

    def shift(self, seconds: float) -> None:
        """Count from a boot time that is earlier by so much: then the frames are later."""
        self._before += seconds
        if self._before > NOT_LATE and (self._late or seconds > STEP):
            self._late, self.seconds = True, self._before


class Clock:
    """The clock of one speaker. All times are monotonic seconds of arrival."""

    def __init__(self) -> None:
        self.booted: float | None = None
        """When it booted, by the fastest frame. None: no sample yet."""
        self.heard_at = self.last = -inf
        """When the latest sample arrived, and when the latest frame with a sample was said."""
        self.samples, self.since = 0, -inf
        self._new_samples, self._new, self._new_at, self._new_since = 0, 0.0, -inf, -inf

    def begin(self, booted: float, now: float) -> None:
        """Start with a first sample."""
        self.booted = self._earliest = booted
        self.heard_at = self.last = self.since = now
        self.samples, self._new_samples = 1, 0

    def fits(self, clock: float, now: float) -> bool:
        """Whether a sample (seconds since boot) continues this clock."""
        return self.booted is None or self._jumps(now - clock) is None

    def is_proven(self, now: float) -> bool:
        """Whether enough samples agree to compare this boot time with another."""
        return self.samples >= SAMPLES and now - self.since >= SPAN

    def _jumps(self, booted: float) -> Change | None:
        assert self.booted is not None
        if turned(booted - self._earliest) < -JUMP:
            return Change.EXCHANGE
        return Change.BOOT if turned(booted - self.booted) > JUMP and booted > self.last - JUMP else None

    def hear(self, clock: float, now: float, lag: Lag, known: float = 0.0) -> Change | None:
        """Process a sample, seconds since boot, and set the lag of its count. SAMPLES confirm a changed boot time.

        `known`: how late the first sample is by other means.
        """
        booted = now - clock
        self.heard_at = now
        if self.booted is None:
            self.begin(booted - known, now)
            lag.hear(known, now)
            return None
        change = self._jumps(booted)
        if change is not None:
            return change if self._confirms(booted, now) else None
        self._new_samples = 0
        self.samples += 1
        late = turned(booted - self.booted)
        if late < 0:
            self._faster(-late)
            lag.faster(-late)
        self.booted += lag.hear(max(late, 0.0), now)
        self.last = max(self.last, now - lag.seconds)
        return None

    def _confirms(self, booted: float, now: float) -> bool:
        if not self._new_samples or now - self._new_at > DOUBT or abs(turned(booted - self._new)) > JUMP:
            self._new_samples, self._new, self._new_since = 0, booted, now
        self._new_samples += 1
        self._new_at = now
        if self._new_samples < SAMPLES or now - self._new_since < SPAN:
            return False
        self.begin(booted, now)
        return True

    def _faster(self, gained: float) -> None:
        """A frame was faster than all before: it corrects the boot time."""
        assert self.booted is not None
        self.booted -= gained
        if turned(self.booted - self._earliest) < 0:
            self._earliest = self.booted

    def adopt(self, other: Clock) -> float:
        """Join the samples of another clock of the same boot. Returns how much later its frames are by this one."""
        if self.booted is None or other.booted is None:
            return 0.0
        apart = turned(other.booted - self.booted)
        if apart < 0:
            self._faster(-apart)
        self.heard_at = max(self.heard_at, other.heard_at)
        return max(apart, 0.0)
