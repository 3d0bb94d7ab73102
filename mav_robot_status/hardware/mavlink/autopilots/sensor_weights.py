"""The meanings of faulty SYS_STATUS bits, for use in the profiles.

Sources: `GCS::update_sensor_status_flags()` of ArduPilot and its vehicles; `fillOutComponent()` in PX4's
SYS_STATUS.hpp.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from typing import Final

from ....mavlink import enumerations as mavlink


class Weight(Enum):
    """The meaning of a faulty bit. Bits outside the table are ignored."""

    HARD = "an error, armed or not"
    SOFT = "an error while armed"


HARD, SOFT = Weight.HARD, Weight.SOFT
Weights = Mapping[int, Weight]
"""By the number of the bit."""


def bit_of(mask: int) -> int:
    """The number of the bit in a mask of one bit."""
    return mask.bit_length() - 1


def weights(hard: tuple[int, ...] = (), soft: tuple[int, ...] = ()) -> dict[int, Weight]:
    """The table of these MAV_SYS_STATUS_SENSOR."""
    return {bit_of(mask): HARD for mask in hard} | {bit_of(mask): SOFT for mask in soft}


def without(table: Weights, mask: int) -> dict[int, Weight]:
    """The table without one bit."""
    return {bit: weight for bit, weight in table.items() if bit != bit_of(mask)}


COMMON: Final = weights(
    hard=(
        mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO,
        mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL,
        mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
        mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
        mavlink.MAV_SYS_STATUS_GEOFENCE,
        mavlink.MAV_SYS_STATUS_SENSOR_BATTERY,
        mavlink.MAV_SYS_STATUS_SENSOR_PROPULSION,
    ),
    soft=(
        mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE,
        mavlink.MAV_SYS_STATUS_SENSOR_GPS,
        mavlink.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW,
        mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION,
        mavlink.MAV_SYS_STATUS_SENSOR_LASER_POSITION,
        mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER,
        mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO2,
        mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL2,
        mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG2,
        mavlink.MAV_SYS_STATUS_AHRS,  # unhealthy for 20 s after the boot of every Rover
        mavlink.MAV_SYS_STATUS_TERRAIN,
        mavlink.MAV_SYS_STATUS_LOGGING,
        mavlink.MAV_SYS_STATUS_SENSOR_PROXIMITY,
        mavlink.MAV_SYS_STATUS_SENSOR_SATCOM,
        mavlink.MAV_SYS_STATUS_OBSTACLE_AVOIDANCE,
    ),
)
CONTROL: Final = weights(
    soft=(
        mavlink.MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL,
        mavlink.MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION,
        mavlink.MAV_SYS_STATUS_SENSOR_YAW_POSITION,
        mavlink.MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL,
        mavlink.MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL,
    )
)
"""Enabled and never healthy on autopilots other than ArduPilot and PX4."""
EXTENDED_BITS: Final = range(6)
"""Bits of the extended word; all are HARD."""
