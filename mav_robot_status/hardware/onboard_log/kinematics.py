"""Speed and rotation in an onboard log, by the rule and the thresholds of the wire."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ..mavlink.motion import state as motion
from .state import FALSE, TRUE

if TYPE_CHECKING:
    from ...clock import Instant
    from ..mavlink.options import HardwareOptions
    from .state import LogState

FRESH: Final = 2.5
"""Seconds for which a speed or a rotation counts."""


def angle_between(one: float, other: float) -> float:
    """The smaller angle between two, in degrees."""
    return (other - one + 180.0) % 360.0 - 180.0


class Kinematics:
    """Keeps the motion in the state of a log."""

    def __init__(self, state: LogState, options: HardwareOptions) -> None:
        self._state = state
        self._options = options
        self._rate = 0.0
        self._turned_at = -math.inf

    def moved(self, speed: float | None, source: str, now: Instant) -> bool:
        """A speed in m/s; None: there is none. True if nothing has changed."""
        state = self._state
        if speed is not None and not math.isfinite(speed):
            return True
        if source != state.motion_from and state.motion_from is not None and speed is None:
            return True
        state.motion_from = source
        rate = self._rate if now.mono - self._turned_at < FRESH else 0.0
        seen = state.motion
        before = seen.speed is None, seen.value, seen.fast_since, seen.slow_since
        motion.moved(seen, speed, rate, state.armed.value is TRUE, self._options, now.mono)
        return before == (seen.speed is None, seen.value, seen.fast_since, seen.slow_since)

    def proved(self, speed: float, now: Instant) -> bool:
        """A speed that can show motion, and not rest."""
        options, armed = self._options, self._state.armed.value is TRUE
        fast = speed > (options.v_on if armed else options.v_on_disarmed)
        return self.moved(speed, self._state.motion_from or "THR.Speed", now) if fast else True

    def turned(self, rate: float, now: Instant) -> bool:
        """A rotation in rad/s. True: it counts with the next speed."""
        self._rate, self._turned_at = rate, now.mono
        return True

    def words(self, now: float) -> str:
        """How it moves, for a sentence: ` while it moved at 4.1 m/s`, ` in the air`; empty if it does not move."""
        state, seen = self._state, self._state.motion
        flies = state.aircraft and state.armed.value is TRUE and state.landed.value is FALSE
        moves = seen.speed is not None and now - seen.at < FRESH and motion.settled(seen, now) is TRUE
        speed = f"{'at' if flies else 'while it moved at'} {seen.speed:.1f} m/s" if moves else ""
        return "".join(f" {part}" for part in ("in the air" if flies else "", speed) if part)
