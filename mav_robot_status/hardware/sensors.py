"""SYS_STATUS: which bits are faulty, what a faulty bit means, and how long it must be so before it counts.

Sources: `GCS::update_sensor_status_flags()` of ArduPilot and its vehicles; `fillOutComponent()` in PX4's
SYS_STATUS.hpp.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Final, NamedTuple

from .identity import PX4, Stack

if TYPE_CHECKING:
    from ..clock import Instant
    from ..mavlink.definitions import SysStatus

GPS: Final = 1 << 5
MOTOR_OUTPUTS: Final = 1 << 15
RC_RECEIVER: Final = 1 << 16
GEOFENCE: Final = 1 << 20
AHRS: Final = 1 << 21
PREARM_CHECK: Final = 1 << 28

DEBOUNCE_MESSAGES: Final = 2
DEBOUNCE_SECONDS: Final = 1.5


class Weight(Enum):
    """What a faulty bit means. A bit that is not in the table is ignored."""

    HARD = "an error, armed or not"
    SOFT = "an error while armed"


HARD, SOFT = Weight.HARD, Weight.SOFT

BITS: Final[dict[int, Weight]] = {
    **dict.fromkeys((0, 1, 2, 3), HARD),  # gyro, accelerometer, compass, barometer
    **dict.fromkeys((4, 5, 6, 7, 8), SOFT),  # airspeed, GPS, flow, vision, laser
    16: SOFT,  # RC receiver
    **dict.fromkeys((17, 18, 19), SOFT),  # second gyro, accelerometer, compass
    20: HARD,  # geofence
    21: SOFT,  # AHRS: unhealthy for 20 s after the boot of every Rover
    22: SOFT,  # terrain
    24: SOFT,  # logging
    25: HARD,  # battery
    **dict.fromkeys((26, 27, 29), SOFT),  # proximity, satcom, obstacle avoidance
    30: HARD,  # propulsion
}
CONTROL: Final = dict.fromkeys((10, 11, 12, 13, 14), SOFT)  # elsewhere listed as enabled and never healthy

WEIGHTS: Final[dict[Stack, dict[int, Weight]]] = {
    # ArduPlane lists terrain as unhealthy through every good flight; a loss of terrain data that matters is a text
    Stack.ARDUPILOT: {bit: weight for bit, weight in (BITS | CONTROL).items() if bit != 22},
    # PX4 shows failed motors in bit 15, and lists RC as unhealthy through a whole flight that needs none
    Stack.PX4: {bit: weight for bit, weight in (BITS | CONTROL | {15: HARD}).items() if bit != 16},
    Stack.INAV: BITS,
    Stack.OTHER: BITS,
}
EXTENDED_BITS: Final = range(6)  # all HARD


class Fault(NamedTuple):
    """A bit that is faulty now; the extended word's bits count from 32."""

    since: Instant
    messages: int
    """How many SYS_STATUS in a row said so."""


Faults = Mapping[int, Fault]
NO_FAULTS: Final[Faults] = {}


def is_empty(status: SysStatus) -> bool:
    """All-zero masks: the autopilot has not looked yet, so nothing was said (PX4's first message after boot)."""
    return not status.onboard_control_sensors_present and not status.onboard_control_sensors_enabled


def faulty_mask(status: SysStatus, stack: Stack) -> int:
    """The faulty bits, the extended word shifted up by 32.

    PX4 enables a required component that is missing, and leaves it out of *present*.
    """
    mask = status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health
    if stack is not PX4:
        mask &= status.onboard_control_sensors_present
    if status.onboard_control_sensors_enabled_extended:
        more = status.onboard_control_sensors_enabled_extended & ~status.onboard_control_sensors_health_extended
        if stack is not PX4:
            more &= status.onboard_control_sensors_present_extended
        mask |= more << 32
    return mask


def heard_faults(faults: Faults, mask: int, now: Instant) -> Faults:
    """The faults after one more SYS_STATUS: a bit that is healthy once is healthy."""
    if not mask:
        return NO_FAULTS
    after = {}
    while mask:
        bit = (mask & -mask).bit_length() - 1  # the lowest
        before = faults.get(bit)
        after[bit] = Fault(before.since, before.messages + 1) if before else Fault(now, 1)
        mask &= mask - 1
    return after


def standing(faults: Faults, stack: Stack, armed: bool, now: float) -> list[tuple[int, Weight, Fault]]:
    """The faults that count at `now`: (bit, weight, since), debounced, SOFT ones only while armed."""
    weights = WEIGHTS[stack]
    out = []
    for bit, fault in faults.items():
        weight = HARD if bit - 32 in EXTENDED_BITS else weights.get(bit)
        if weight is None or (weight is SOFT and not armed):
            continue
        if fault.messages >= DEBOUNCE_MESSAGES or now >= fault.since.mono + DEBOUNCE_SECONDS:
            out.append((bit, weight, fault))
    return out


def is_ready(status: SysStatus, stack: Stack) -> bool:
    """True if the pre-arm checks pass, as far as SYS_STATUS says so. PX4 sets the bit in *health* only."""
    ready = status.onboard_control_sensors_health & PREARM_CHECK
    if stack is not PX4:
        ready &= status.onboard_control_sensors_present & status.onboard_control_sensors_enabled
    return bool(ready)


def tells_readiness(status: SysStatus, stack: Stack) -> bool:
    """True if this SYS_STATUS says anything about the pre-arm checks."""
    if stack is PX4:
        return True
    return bool(status.onboard_control_sensors_present & status.onboard_control_sensors_enabled & PREARM_CHECK)


def safety_switch_on(status: SysStatus) -> bool:
    """True if ArduPilot's hardware safety switch holds the outputs: MOTOR_OUTPUTS present, not enabled."""
    present = status.onboard_control_sensors_present & MOTOR_OUTPUTS
    return bool(present) and not status.onboard_control_sensors_enabled & MOTOR_OUTPUTS


def estimate_is_healthy(status: SysStatus) -> bool:
    """True if the AHRS bit is enabled and healthy."""
    return bool(status.onboard_control_sensors_enabled & status.onboard_control_sensors_health & AHRS)


def estimate_is_faulty(status: SysStatus) -> bool:
    """True if the AHRS bit is enabled and unhealthy."""
    return bool(status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health & AHRS)
