"""Whether a multicopter lies on the ground although it reports to be in the air.

A multicopter without thrust falls. If it had none for a second and stood still, it lies on something, and it lies there
until it moves, whatever its motors do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from .state import Motion

LEAST_LIFT: Final = 10
"""VFR_HUD.throttle in percent below which hardly any aircraft hovers."""
IDLE: Final = 3
"""VFR_HUD.throttle in percent below which none hovers, however strong its motors are."""
FALL: Final = 1.0
"""Seconds without thrust after which an aircraft in the air falls at 10 m/s."""


@dataclass(slots=True)
class Lift:
    """A record that each VFR_HUD of a multicopter changes in place. Times are monotonic seconds."""

    idle_since: float | None = None
    """Since when the throttle is below IDLE."""
    lay_at: float | None = None
    """When it last lay on the ground for certain."""


def heard_throttle(lift: Lift, throttle: int, motion: Motion, now: float) -> None:
    """Process the throttle of one VFR_HUD, percent."""
    if throttle >= IDLE:
        lift.idle_since = None
        return
    if lift.idle_since is None:
        lift.idle_since = now
    still = motion.still_since
    if still is not None and now >= max(lift.idle_since, still) + FALL:
        lift.lay_at = now


def lies(lift: Lift, motion: Motion) -> bool:
    """Whether it has not moved since it lay on the ground."""
    return lift.lay_at is not None and motion.still_since is not None and motion.still_since <= lift.lay_at
