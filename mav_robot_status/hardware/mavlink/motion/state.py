"""in_motion: airborne, or measured speed and rotation with hysteresis.

The last sample holds until the next.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from ....interface.status import TriState

if TYPE_CHECKING:
    from ..options import HardwareOptions

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
RATE_ON, RATE_OFF = 0.15, 0.08  # rad/s
SUSTAIN_ON, SUSTAIN_OFF = 0.3, 1.0  # seconds
GAP: Final = 2.5  # seconds in which a vehicle may move and stop again unseen


@dataclass(slots=True)
class Motion:
    """The motion according to speed and rotation: a record that each sample changes in place."""

    value: TriState = UNKNOWN
    fast_since: float | None = None
    """Since when above the upper thresholds."""
    slow_since: float | None = None
    """Since when below the lower thresholds."""
    still_since: float | None = None
    """Since when below the lower thresholds, by samples that are not further apart than GAP."""
    speed: float | None = None
    """The latest sample, m/s; None while there is no estimate."""
    at: float = -math.inf
    """When it arrived."""


def settled(motion: Motion, now: float) -> TriState:
    """The value at `now` without a further sample."""
    if motion.fast_since is not None and now >= motion.fast_since + SUSTAIN_ON:
        return TRUE
    if motion.slow_since is not None and now >= motion.slow_since + SUSTAIN_OFF:
        return FALSE
    return motion.value


def settle(motion: Motion, now: float) -> None:
    """Advance to `now`, so that the next sample starts from the value in the status."""
    motion.value = settled(motion, now)


def moved(motion: Motion, speed: float | None, rate: float, armed: bool, options: HardwareOptions, now: float) -> None:
    """Process one sample: `speed` in m/s (None: not measured, which ends all that was known), `rate` in rad/s."""
    motion.speed = speed
    if speed is None:
        motion.value, motion.fast_since, motion.slow_since, motion.still_since = UNKNOWN, None, None, None
        return
    motion.value = settled(motion, now)
    on, off = (options.v_on, options.v_off) if armed else (options.v_on_disarmed, options.v_off_disarmed)
    if not (speed > on or rate > RATE_ON):
        motion.fast_since = None
    elif motion.fast_since is None:
        motion.fast_since = now
    if not (speed < off and rate < RATE_OFF):
        motion.slow_since = motion.still_since = None
    elif motion.slow_since is None:
        motion.slow_since = motion.still_since = now
    elif now - motion.at > GAP:
        motion.still_since = now
    motion.at = now
