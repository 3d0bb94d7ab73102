"""SYS_STATUS: which bits are faulty, and for how long before they count.

The profile defines the meaning of a faulty bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import TriState
from ....mavlink import enumerations as mavlink
from ..autopilots.sensor_weights import EXTENDED_BITS, HARD, SOFT, Weight, bit_of

if TYPE_CHECKING:
    from ....clock import Instant
    from ....mavlink.definitions import SysStatus
    from ..autopilots import Autopilot
    from ..autopilots.firmware import Firmware
    from ..autopilots.profile import Version

GPS: Final = mavlink.MAV_SYS_STATUS_SENSOR_GPS
MOTOR_OUTPUTS: Final = mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
RC_RECEIVER: Final = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
GEOFENCE: Final = mavlink.MAV_SYS_STATUS_GEOFENCE
AHRS: Final = mavlink.MAV_SYS_STATUS_AHRS
PREARM_CHECK: Final = mavlink.MAV_SYS_STATUS_PREARM_CHECK

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN

GRACE: Final = 10.0
"""Seconds after boot during which sensor bits raise no error."""
DEBOUNCE_MESSAGES: Final = 2
DEBOUNCE_SECONDS: Final = 1.5


class Fault(NamedTuple):
    """A bit that is faulty now; bits of the extended word count from 32."""

    since: Instant
    messages: int
    """The number of consecutive SYS_STATUS that report it."""


Faults = Mapping[int, Fault]
NO_FAULTS: Final[Faults] = {}


def is_empty(status: SysStatus) -> bool:
    """All-zero masks: the autopilot has not checked its sensors yet (PX4's first message after boot)."""
    return not status.onboard_control_sensors_present and not status.onboard_control_sensors_enabled


def faulty_mask(status: SysStatus, profile: Autopilot) -> int:
    """The faulty bits, the extended word shifted up by 32."""
    mask = status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health
    if profile.sensors.faulty_needs_present:
        mask &= status.onboard_control_sensors_present
    if status.onboard_control_sensors_enabled_extended:
        more = status.onboard_control_sensors_enabled_extended & ~status.onboard_control_sensors_health_extended
        if profile.sensors.faulty_needs_present:
            more &= status.onboard_control_sensors_present_extended
        mask |= more << 32
    return mask


def unhealthy_mask(status: SysStatus) -> int:
    """The bits that are enabled and not healthy, present or not, without PREARM_CHECK; the extended word from 32 up."""
    mask = status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health & ~PREARM_CHECK
    more = status.onboard_control_sensors_enabled_extended & ~status.onboard_control_sensors_health_extended
    return mask | more << 32


def heard_faults(faults: Faults, mask: int, now: Instant) -> Faults:
    """The faults after one more SYS_STATUS: one healthy report ends a fault."""
    if not mask:
        return NO_FAULTS
    after = {}
    while mask:
        bit = bit_of(mask & -mask)  # the lowest
        before = faults.get(bit)
        after[bit] = Fault(before.since, before.messages + 1) if before else Fault(now, 1)
        mask &= mask - 1
    return after


def counting(
    faults: Faults, profile: Autopilot, firmware: Firmware | Version | None, armed: bool
) -> list[tuple[int, Weight, Fault]]:
    """The faults with a meaning: (bit, weight, fault); SOFT ones only while armed.

    A bit whose health means something else in older firmware has none there, nor while the least version of the
    `firmware` is unknown.
    """
    weights, since = profile.sensors.weights, profile.sensors.since
    out = []
    for bit, fault in faults.items():
        weight = HARD if bit - 32 in EXTENDED_BITS else weights.get(bit)
        if bit in since and (firmware is None or firmware < since[bit]):
            continue
        if weight is HARD or (weight is SOFT and armed):
            out.append((bit, weight, fault))
    return out


def readiness(status: SysStatus, profile: Autopilot) -> TriState:
    """Whether the pre-arm checks pass; UNKNOWN if this SYS_STATUS does not report them."""
    if profile.sensors.readiness_in_health_alone:
        return TRUE if status.onboard_control_sensors_health & PREARM_CHECK else FALSE
    told = status.onboard_control_sensors_present & status.onboard_control_sensors_enabled & PREARM_CHECK
    if not told:
        return UNKNOWN
    return TRUE if status.onboard_control_sensors_health & told else FALSE


def has_prearm_check(status: SysStatus) -> bool:
    """Whether it reports the pre-arm checks at all: only firmware from a known version on does."""
    return bool(status.onboard_control_sensors_present & PREARM_CHECK)


def safety_switch_on(status: SysStatus) -> bool:
    """True if the hardware safety switch holds the outputs: MOTOR_OUTPUTS present, not enabled."""
    present = status.onboard_control_sensors_present & MOTOR_OUTPUTS
    return bool(present) and not status.onboard_control_sensors_enabled & MOTOR_OUTPUTS


def estimate_is_healthy(status: SysStatus) -> bool:
    """True if the AHRS bit is enabled and healthy."""
    return bool(status.onboard_control_sensors_enabled & status.onboard_control_sensors_health & AHRS)


def estimate_is_faulty(status: SysStatus) -> bool:
    """True if the AHRS bit is enabled and unhealthy."""
    return bool(status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health & AHRS)
