"""in_motion: airborne, or measured speed and rotation with hysteresis.

The measured part is a value that each sample replaces; the last sample holds until the next.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from ..interface.status import TriState

if TYPE_CHECKING:
    from .options import HardwareOptions

RATE_ON, RATE_OFF = 0.15, 0.08  # rad/s
SUSTAIN_ON, SUSTAIN_OFF = 0.3, 1.0  # seconds
FRESH: Final = 2.5  # seconds, or three measured intervals


class Motion(NamedTuple):
    """What speed and rotation have said so far."""

    value: TriState = TriState.UNKNOWN
    fast_since: float | None = None
    """Since when above the upper thresholds."""
    slow_since: float | None = None
    """Since when below the lower thresholds."""
    speed: float | None = None
    """The latest sample, m/s; None while there is no estimate."""


UNKNOWN: Final = Motion()


def settle(motion: Motion, now: float) -> Motion:
    """The motion at `now` if no sample came since."""
    if motion.fast_since is not None and now >= motion.fast_since + SUSTAIN_ON:
        return motion if motion.value is TriState.TRUE else motion._replace(value=TriState.TRUE)
    if motion.slow_since is not None and now >= motion.slow_since + SUSTAIN_OFF:
        return motion if motion.value is TriState.FALSE else motion._replace(value=TriState.FALSE)
    return motion


def settles_at(motion: Motion) -> float:
    """When (monotonic seconds) `settle` will find another value if no sample comes; infinity: never."""
    if motion.fast_since is not None:
        return math.inf if motion.value is TriState.TRUE else motion.fast_since + SUSTAIN_ON
    if motion.slow_since is not None and motion.value is not TriState.FALSE:
        return motion.slow_since + SUSTAIN_OFF
    return math.inf


def moved(
    motion: Motion, speed: float | None, rate: float, armed: bool, options: HardwareOptions, now: float
) -> Motion:
    """The motion after a sample: `speed` in m/s (None: not measured), `rate` in rad/s."""
    motion = settle(motion, now)
    if speed is None:
        return UNKNOWN
    on = options.v_on if armed else options.v_on_disarmed
    off = options.v_off if armed else options.v_off_disarmed
    fast = speed > on or rate > RATE_ON
    slow = speed < off and rate < RATE_OFF
    return Motion(
        motion.value,
        (motion.fast_since if motion.fast_since is not None else now) if fast else None,
        (motion.slow_since if motion.slow_since is not None else now) if slow else None,
        speed,
    )
