"""The failure flags of HIGH_LATENCY2: the cause of each, and when it is an error.

Sources: HL_FAILURE_FLAG of common.xml; `GCS_MAVLINK::send_high_latency2` of ArduPilot, which sets a flag if the bit of
SYS_STATUS is not *healthy*, so also for a sensor that the vehicle does not have; `HIGH_LATENCY2.hpp` of PX4.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from enum import Enum
from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import TriState
from ....mavlink import enumerations as mavlink
from ..autopilots.sensor_weights import bit_of
from ..faults import causes
from ..faults.sensors import GRACE
from ..identity import sensor_name
from .state import is_ardupilots_own

if TYPE_CHECKING:
    from ....mavlink.definitions import Heartbeat
    from ..options import HardwareOptions
    from .state import HighLatency


class When(Enum):
    """When a flag is an error."""

    ALWAYS = "always"
    NOT_DISARMED = "unless the vehicle says that it is disarmed"
    ONCE_CLEAR = "once the flag was clear: the vehicle has such a sensor, or a geofence"
    NOT_DISARMED_ONCE_CLEAR = "once it was clear, unless the vehicle says that it is disarmed"
    IN_OFFBOARD = "in PX4's mode OFFBOARD: in any other it is set while nobody wants to control the vehicle"


ALWAYS, NOT_DISARMED, ONCE_CLEAR = When.ALWAYS, When.NOT_DISARMED, When.ONCE_CLEAR
NOT_DISARMED_ONCE_CLEAR = When.NOT_DISARMED_ONCE_CLEAR


class Row(NamedTuple):
    """The meaning of one flag."""

    code: int
    """The code of the cause."""
    when: When


Flags = Mapping[int, Row]
"""By HL_FAILURE_FLAG. A flag without a row is no error."""


def _sensor(mask: int) -> int:
    """The code of a bit of SYS_STATUS."""
    return causes.of_sensor(bit_of(mask))


DEFINED: Final[Flags] = {
    mavlink.HL_FAILURE_FLAG_GPS: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_GPS), NOT_DISARMED),
    mavlink.HL_FAILURE_FLAG_DIFFERENTIAL_PRESSURE: Row(
        _sensor(mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE), NOT_DISARMED
    ),
    mavlink.HL_FAILURE_FLAG_ABSOLUTE_PRESSURE: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE), ALWAYS),
    mavlink.HL_FAILURE_FLAG_3D_ACCEL: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL), ALWAYS),
    mavlink.HL_FAILURE_FLAG_3D_GYRO: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO), ALWAYS),
    mavlink.HL_FAILURE_FLAG_3D_MAG: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG), ALWAYS),
    mavlink.HL_FAILURE_FLAG_TERRAIN: Row(_sensor(mavlink.MAV_SYS_STATUS_TERRAIN), NOT_DISARMED),
    mavlink.HL_FAILURE_FLAG_BATTERY: Row(causes.BATTERY_CRITICAL, ALWAYS),
    mavlink.HL_FAILURE_FLAG_RC_RECEIVER: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER), NOT_DISARMED),
    mavlink.HL_FAILURE_FLAG_OFFBOARD_LINK: Row(causes.OFFBOARD_LOST, ALWAYS),
    mavlink.HL_FAILURE_FLAG_ENGINE: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS), ALWAYS),
    mavlink.HL_FAILURE_FLAG_GEOFENCE: Row(_sensor(mavlink.MAV_SYS_STATUS_GEOFENCE), ALWAYS),
    mavlink.HL_FAILURE_FLAG_ESTIMATOR: Row(causes.ESTIMATOR, NOT_DISARMED),
    mavlink.HL_FAILURE_FLAG_MISSION: Row(causes.MISSION, ALWAYS),
}
"""As MAVLink defines them."""
PX4: Final[Flags] = {
    # set during a whole flight without a remote control
    **{flag: row for flag, row in DEFINED.items() if flag != mavlink.HL_FAILURE_FLAG_RC_RECEIVER},
    mavlink.HL_FAILURE_FLAG_OFFBOARD_LINK: Row(causes.OFFBOARD_LOST, When.IN_OFFBOARD),
}
ARDUPILOT: Final[Flags] = {
    **{
        flag: DEFINED[flag]
        for flag in (
            mavlink.HL_FAILURE_FLAG_3D_GYRO,
            mavlink.HL_FAILURE_FLAG_3D_ACCEL,
            mavlink.HL_FAILURE_FLAG_ABSOLUTE_PRESSURE,
        )
    },
    # a flag that repeats a bit of SYS_STATUS has the code of the bit
    mavlink.HL_FAILURE_FLAG_BATTERY: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_BATTERY), ALWAYS),
    mavlink.HL_FAILURE_FLAG_ESTIMATOR: Row(_sensor(mavlink.MAV_SYS_STATUS_AHRS), NOT_DISARMED),
    mavlink.HL_FAILURE_FLAG_3D_MAG: Row(_sensor(mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG), ONCE_CLEAR),
    mavlink.HL_FAILURE_FLAG_GEOFENCE: Row(_sensor(mavlink.MAV_SYS_STATUS_GEOFENCE), ONCE_CLEAR),
    **{
        flag: DEFINED[flag]._replace(when=NOT_DISARMED_ONCE_CLEAR)
        for flag in (
            mavlink.HL_FAILURE_FLAG_GPS,
            mavlink.HL_FAILURE_FLAG_DIFFERENTIAL_PRESSURE,
            mavlink.HL_FAILURE_FLAG_RC_RECEIVER,
        )
    },
}
"""Without TERRAIN: ArduPlane reports it as unhealthy during every good flight."""
UNDEFINED: Final[Flags] = {}
"""Senders that announce ArduPilot and are not: UV Radio Room sets the flags of all healthy sensors."""
OFFBOARD: Final = 6  # PX4's main mode


def flags_of(known: HighLatency) -> Flags:
    """The meaning of the flags of this sender."""
    if known.message.autopilot == mavlink.MAV_AUTOPILOT_PX4:
        return PX4
    if known.message.autopilot != mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA:
        return DEFINED
    return ARDUPILOT if is_ardupilots_own(known.message) else UNDEFINED


def failures(known: HighLatency, options: HardwareOptions) -> Iterator[tuple[int, int]]:
    """The errors in the latest message: code, and since when in Unix microseconds."""
    rows = flags_of(known)
    if rows is not DEFINED and known.message.timestamp < GRACE * 1000:  # PX4 and ArduPilot send the time since the boot
        return
    for flag, since in known.flagged.items():
        row = rows.get(flag)
        if row is not None and _counts(row.when, flag, known) and not _is_ignored(row.code, options):
            yield row.code, since


def _counts(when: When, flag: int, known: HighLatency) -> bool:
    """Whether a flag that is set is an error now."""
    if when is When.IN_OFFBOARD:
        return _is_offboard(known.statement)
    if when in (NOT_DISARMED, NOT_DISARMED_ONCE_CLEAR) and known.armed is TriState.FALSE:
        return False
    return when in (ALWAYS, NOT_DISARMED) or bool(known.seen_clear & flag)


def _is_offboard(statement: Heartbeat) -> bool:
    return statement.custom_mode >> 16 & 0xFF == OFFBOARD


def _is_ignored(code: int, options: HardwareOptions) -> bool:
    """Whether the site ignores the sensor of this cause."""
    is_sensor = causes.SENSOR <= code < causes.EXTENDED_SENSOR
    return is_sensor and sensor_name(code - causes.SENSOR) in options.ignore_sensors
