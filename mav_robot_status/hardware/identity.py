"""Who is speaking: which heartbeats are an autopilot's, which software it runs, what kind of vehicle it moves.

Sources: MAVLink developer guide, heartbeat and id assignment; GCS_MAVLINK frame_type() of ArduPilot's vehicles; INAV
and Betaflight telemetry/mavlink.c. Numbers, not names, because ArduPilot's definitions name some types differently.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from ..mavlink.definitions import Heartbeat

ARMED: Final = 0x80  # MAV_MODE_FLAG_SAFETY_ARMED
HIL: Final = 0x20
CUSTOM_MODE: Final = 0x01

AUTOPILOT_ARDUPILOT: Final = 3
AUTOPILOT_PX4: Final = 12

# MAV_AUTOPILOT RESERVED and INVALID; MAV_TYPE of ground stations, companions and peripherals.
NOT_AUTOPILOTS: Final = frozenset({1, 8})
NOT_VEHICLES: Final = frozenset(
    {6, 18, 26, 27, 30, 31, 32, 33, 34, 36, 37, 38, 39, 40, 41, 42, 44, 48, 49},
)  # fmt: skip


class Stack(Enum):
    """The software on the autopilot, as far as a rule depends on it."""

    ARDUPILOT = "ArduPilot"
    PX4 = "PX4"
    INAV = "INAV"  # speaking as ArduPilot; as itself it is OTHER
    OTHER = "other"


class Family(Enum):
    """The kind of vehicle: it picks ArduPilot's mode table, and says what counts as motion. Values name it in YAML."""

    COPTER = "copter"
    PLANE = "plane"
    ROVER = "rover"
    SUB = "sub"
    TRACKER = "tracker"
    BLIMP = "blimp"
    OTHER = "other"


# Names of their own, for what runs many times a second: Python 3.11 takes long to find a member in its enumeration.
ARDUPILOT, PX4, INAV, OTHER = Stack.ARDUPILOT, Stack.PX4, Stack.INAV, Stack.OTHER
PLANE, ROVER = Family.PLANE, Family.ROVER

FAMILIES: Final[dict[int, Family]] = {
    **dict.fromkeys((2, 3, 4, 13, 14, 15, 29, 35, 43), Family.COPTER),
    **dict.fromkeys((1, 16, *range(19, 26)), Family.PLANE),
    **dict.fromkeys((10, 11, 46), Family.ROVER),
    12: Family.SUB,
    5: Family.TRACKER,
    7: Family.BLIMP,
}

SURFACE_BOAT: Final = 11
HELICOPTER: Final = 4

# Types for which landed_state means something, and which stay in the air only by moving.
AIRCRAFT: Final = frozenset({1, 2, 3, 4, 7, 13, 14, 15, 16, *range(19, 26), 29, 35, 43})


def is_autopilot(heartbeat: Heartbeat, component: int) -> bool:
    """True for the heartbeat of a vehicle's autopilot, false for ground stations, gimbals, companions, sensors.

    Type GENERIC counts only from component 1: an optical flow sensor was seen claiming GENERIC and PX4.
    """
    return (
        heartbeat.autopilot not in NOT_AUTOPILOTS
        and heartbeat.type not in NOT_VEHICLES
        and (heartbeat.type != 0 or component == 1)
    )


def family_of(vehicle_type: int) -> Family:
    """The family of a MAV_TYPE."""
    return FAMILIES.get(vehicle_type, Family.OTHER)


def stack_of(autopilot: int, impostor: bool) -> Stack:
    """The software behind a MAV_AUTOPILOT; `impostor` once an ArduPilot has shown that it is INAV."""
    if autopilot == AUTOPILOT_ARDUPILOT:
        return Stack.INAV if impostor else Stack.ARDUPILOT
    return Stack.PX4 if autopilot == AUTOPILOT_PX4 else Stack.OTHER
