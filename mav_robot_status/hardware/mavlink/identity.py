"""Identifies senders: which heartbeats are from an autopilot, and which kind of vehicle it controls.

`autopilots/` identifies its software. Sources: MAVLink developer guide, heartbeat and id assignment; GCS_MAVLINK
frame_type() of ArduPilot's vehicles; INAV and Betaflight telemetry/mavlink.c. ArduPilot's definitions name some types
differently from MAVLink's; the names here are MAVLink's.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Final

from ...mavlink import enumerations as mavlink
from ...mavlink.definitions import EXTENDED_SENSOR_NAMES, SENSOR_NAMES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...mavlink.definitions import Heartbeat

RADIO: Final = 49  # MAV_TYPE_RADIO, which pymavlink's definitions do not have yet

NOT_AUTOPILOTS: Final = frozenset({mavlink.MAV_AUTOPILOT_RESERVED, mavlink.MAV_AUTOPILOT_INVALID})
NOT_VEHICLES: Final = frozenset(
    {
        mavlink.MAV_TYPE_GCS,
        mavlink.MAV_TYPE_ONBOARD_CONTROLLER,
        mavlink.MAV_TYPE_GIMBAL,
        mavlink.MAV_TYPE_ADSB,
        mavlink.MAV_TYPE_CAMERA,
        mavlink.MAV_TYPE_CHARGING_STATION,
        mavlink.MAV_TYPE_FLARM,
        mavlink.MAV_TYPE_SERVO,
        mavlink.MAV_TYPE_ODID,
        mavlink.MAV_TYPE_BATTERY,
        mavlink.MAV_TYPE_PARACHUTE,
        mavlink.MAV_TYPE_LOG,
        mavlink.MAV_TYPE_OSD,
        mavlink.MAV_TYPE_IMU,
        mavlink.MAV_TYPE_GPS,
        mavlink.MAV_TYPE_WINCH,
        mavlink.MAV_TYPE_ILLUMINATOR,
        mavlink.MAV_TYPE_GRIPPER,
        RADIO,
    }
)
"""MAV_TYPE of ground stations, companion computers and peripherals."""


class Family(Enum):
    """The kind of vehicle: it selects ArduPilot's mode table and what counts as motion. Values are YAML names."""

    COPTER = "copter"
    PLANE = "plane"
    ROVER = "rover"
    SUB = "sub"
    TRACKER = "tracker"
    BLIMP = "blimp"
    OTHER = "other"


# Module constants for code that runs many times a second: Python 3.11 is slow to look up a member of an enumeration.
PLANE, ROVER = Family.PLANE, Family.ROVER

MULTIROTORS: Final = (
    mavlink.MAV_TYPE_QUADROTOR,
    mavlink.MAV_TYPE_COAXIAL,
    mavlink.MAV_TYPE_HELICOPTER,
    mavlink.MAV_TYPE_HEXAROTOR,
    mavlink.MAV_TYPE_OCTOROTOR,
    mavlink.MAV_TYPE_TRICOPTER,
    mavlink.MAV_TYPE_DODECAROTOR,
    mavlink.MAV_TYPE_DECAROTOR,
    mavlink.MAV_TYPE_GENERIC_MULTIROTOR,
)
FIXED_PITCH: Final = frozenset(MULTIROTORS) - {mavlink.MAV_TYPE_HELICOPTER}
"""The multirotors whose throttle alone is their thrust."""
WINGED: Final = (
    mavlink.MAV_TYPE_FIXED_WING,
    mavlink.MAV_TYPE_FLAPPING_WING,
    mavlink.MAV_TYPE_VTOL_DUOROTOR,
    mavlink.MAV_TYPE_VTOL_QUADROTOR,
    mavlink.MAV_TYPE_VTOL_TILTROTOR,
    mavlink.MAV_TYPE_VTOL_RESERVED2,
    mavlink.MAV_TYPE_VTOL_RESERVED3,
    mavlink.MAV_TYPE_VTOL_RESERVED4,
    mavlink.MAV_TYPE_VTOL_RESERVED5,
)
GROUND_VEHICLES: Final = (
    mavlink.MAV_TYPE_GROUND_ROVER,
    mavlink.MAV_TYPE_SURFACE_BOAT,
    mavlink.MAV_TYPE_GROUND_QUADRUPED,
)

FAMILIES: Final[dict[int, Family]] = {
    **dict.fromkeys(MULTIROTORS, Family.COPTER),
    **dict.fromkeys(WINGED, Family.PLANE),
    **dict.fromkeys(GROUND_VEHICLES, Family.ROVER),
    mavlink.MAV_TYPE_SUBMARINE: Family.SUB,
    mavlink.MAV_TYPE_ANTENNA_TRACKER: Family.TRACKER,
    mavlink.MAV_TYPE_AIRSHIP: Family.BLIMP,
}

AIRCRAFT: Final = frozenset({*MULTIROTORS, *WINGED, mavlink.MAV_TYPE_AIRSHIP})
"""Types with a meaningful landed_state that must move to stay in the air."""
IN_THE_AIR: Final = frozenset(
    {mavlink.MAV_LANDED_STATE_IN_AIR, mavlink.MAV_LANDED_STATE_TAKEOFF, mavlink.MAV_LANDED_STATE_LANDING}
)
"""The landed_state of an aircraft that flies."""


def is_autopilot(heartbeat: Heartbeat, component: int) -> bool:
    """Whether this is the heartbeat of a vehicle's autopilot, not of a ground station, gimbal, companion or sensor.

    Type GENERIC counts only from component 1: an optical flow sensor was seen claiming GENERIC and PX4.
    """
    return (
        heartbeat.autopilot not in NOT_AUTOPILOTS
        and heartbeat.type not in NOT_VEHICLES
        and (heartbeat.type != mavlink.MAV_TYPE_GENERIC or component == mavlink.MAV_COMP_ID_AUTOPILOT1)
    )


def family_of(vehicle_type: int) -> Family:
    """The family of a MAV_TYPE."""
    return FAMILIES.get(vehicle_type, Family.OTHER)


def named(names: Mapping[int, str], number: int) -> str:
    """MAVLink's name of a number, or the number as text."""
    return names.get(number, str(number))


def sensor_name(bit: int) -> str:
    """MAVLink's name of a SYS_STATUS bit; bits of the extended word count from 32."""
    if bit < 32:
        return SENSOR_NAMES.get(bit, str(bit))
    return EXTENDED_SENSOR_NAMES.get(bit - 32, str(bit - 32))
