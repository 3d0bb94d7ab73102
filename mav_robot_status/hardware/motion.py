"""in_motion: airborne, or measured speed and rotation with hysteresis.

The measured part is a value that each sample replaces; the last sample holds until the next.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from ..interface.status import TriState

if TYPE_CHECKING:
    from .options import HardwareOptions

TRUE, FALSE = TriState.TRUE, TriState.FALSE
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
new: Final = tuple.__new__  # a NamedTuple of as many values as it has fields, in a third of the time of its own name


def settle(motion: Motion, now: float) -> Motion:
    """The motion at `now` if no sample came since."""
    if motion.fast_since is not None and now >= motion.fast_since + SUSTAIN_ON:
        return motion if motion.value is TRUE else motion._replace(value=TRUE)
    if motion.slow_since is not None and now >= motion.slow_since + SUSTAIN_OFF:
        return motion if motion.value is FALSE else motion._replace(value=FALSE)
    return motion


def settles_at(motion: Motion) -> float:
    """When (monotonic seconds) `settle` will find another value if no sample comes; infinity: never."""
    if motion.fast_since is not None:
        return math.inf if motion.value is TRUE else motion.fast_since + SUSTAIN_ON
    if motion.slow_since is not None and motion.value is not FALSE:
        return motion.slow_since + SUSTAIN_OFF
    return math.inf


def moved(
    motion: Motion, speed: float | None, rate: float, armed: bool, options: HardwareOptions, now: float
) -> Motion:
    """The motion after a sample: `speed` in m/s (None: not measured), `rate` in rad/s."""
    if speed is None:
        return UNKNOWN
    motion = settle(motion, now)
    on = options.v_on if armed else options.v_on_disarmed
    off = options.v_off if armed else options.v_off_disarmed
    fast = speed > on or rate > RATE_ON
    slow = speed < off and rate < RATE_OFF
    fast_since = (motion.fast_since if motion.fast_since is not None else now) if fast else None
    slow_since = (motion.slow_since if motion.slow_since is not None else now) if slow else None
    return new(Motion, (motion.value, fast_since, slow_since, speed))
