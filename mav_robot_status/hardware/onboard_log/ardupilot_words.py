"""The numbers in ArduPilot's records in words. Sources: AP_Arming.h, ModeReason.h, AP_Logger.h of 4.5."""

from __future__ import annotations

from typing import Final

from ...mavlink.enumerations import MAV_TYPE_SURFACE_BOAT
from ..mavlink.faults import causes
from ..mavlink.identity import Family

METHODS: Final = {
    0: "the rudder stick",
    1: "a MAVLink command",
    2: "a switch of the radio",
    3: "a motor test",
    4: "a script",
    5: "the flight termination",
    6: "the failsafe of its processor",
    7: "the battery failsafe",
    8: "the pause button",
    9: "the advanced failsafe (AFS)",
    10: "the avoidance of traffic",
    11: "the release of the parachute",
    12: "the crash check",
    13: "the landing",
    14: "the end of the mission",
    15: "the fence",
    16: "the radio failsafe",
    17: "the disarm delay",
    18: "the ground station failsafe",
    19: "the terrain failsafe",
    20: "a failsafe that terminates",
    21: "the terrain failsafe",
    22: "the end of the motor detection",
    23: "an error of its software",
    24: "the EKF failsafe",
    25: "the ground station failsafe, which could not surface",
    26: "the ground station failsafe, which could not hold",
    27: "a takeoff that took too long",
    28: "the automatic landing",
    29: "the pilot input failsafe",
    30: "the toy mode",
    31: "the toy mode",
    32: "the landing",
    33: "the dead reckoning failsafe",
    34: "the black box mode",
    35: "a companion over DDS",
    36: "its start (arm once)",
    37: "the turtle mode",
    38: "the toy mode",
    100: "an unknown method",
}
"""ARM.Method: who armed or disarmed it."""
BY_ITSELF: Final = frozenset({5, 6, 7, *range(9, 13), 15, 16, *range(18, 22), *range(23, 28), 29, 33})
"""Methods with which the autopilot disarms on its own because something is wrong."""

REASONS: Final = {
    0: "an unknown reason",
    1: "the radio",
    2: "a ground station or companion",
    3: "the radio failsafe",
    4: "the battery failsafe",
    5: "the ground station failsafe",
    6: "the EKF failsafe",
    7: "a GPS glitch",
    8: "the end of the mission",
    9: "the pilot, who left the landing with the throttle",
    10: "the fence",
    11: "the terrain failsafe",
    12: "the end of BRAKE",
    13: "the end of the flip",
    14: "the avoidance of traffic",
    15: "the end of the avoidance",
    16: "the end of the throw",
    17: "the flight termination",
    18: "the toy mode",
    19: "the crash check",
    20: "soaring",
    21: "soaring",
    22: "soaring",
    23: "a failed transition",
    24: "a failed takeoff",
    25: "a failsafe",
    26: "the start of the autopilot",
    27: "the end of surfacing",
    28: "a bad depth",
    29: "the leak failsafe",
    30: "the servo test",
    31: "the start of the autopilot",
    32: "a script",
    33: "a mode that is not available",
    34: "the start of the autorotation",
    35: "the end of the autorotation",
    36: "soaring",
    37: "soaring",
    38: "soaring",
    39: "the return, which goes on as a VTOL",
    40: "the return, which goes on as an automatic landing",
    41: "the mission",
    42: "a telemetry radio",
    43: "the end of the fence's action",
    44: "the return of a QuadPlane",
    45: "the end of the return",
    46: "the altitude of the landing",
    47: "the altitude of the landing",
    48: "the end of the radio failsafe",
    49: "a landing in place of a return",
    50: "the dead reckoning failsafe",
    51: "a failed takeoff",
    52: "a companion over DDS",
    53: "a switch",
    54: "the automatic landing",
    55: "the fence",
}
"""MODE.Rsn: why the mode changed."""

SWITCH_SOURCES: Final = {
    0: "its start",
    1: "a switch of the radio",
    2: "a button",
    3: "a MAVLink command",
    4: "the mission",
    5: "a script",
}
"""AUXF.source."""

ANY: Final = -1
"""Every ECode but 0, which ends the error."""
SUBSYSTEMS: Final[dict[int, dict[int, tuple[int, ...]]]] = {
    3: {4: (causes.SENSOR + 2,)},  # compass
    5: {ANY: (causes.RC_LOST,)},  # radio failsafe
    6: {ANY: (causes.BATTERY_LOW,)},  # battery failsafe
    7: {ANY: (causes.GPS,)},  # GPS failsafe
    8: {ANY: (causes.GCS_LOST,)},  # ground station failsafe
    9: {ANY: (causes.GEOFENCE,)},  # fence
    11: {2: (causes.GPS,)},  # GPS glitch
    12: {ANY: (causes.CRASH,)},  # crash check
    16: {2: (causes.ESTIMATOR,)},  # EKF check
    17: {ANY: (causes.ESTIMATOR,)},  # EKF failsafe
    18: {4: (causes.SENSOR + 3,)},  # barometer
    20: {ANY: (causes.TRAFFIC,)},  # traffic
    23: {ANY: (causes.TERRAIN,)},  # terrain failsafe
    25: {ANY: (causes.THRUST_LOSS,)},  # thrust loss check
    27: {ANY: (causes.LEAK,)},  # leak failsafe
    30: {ANY: (causes.INTERNAL_ERROR,)},  # internal error
    31: {ANY: (causes.GPS,)},  # dead reckoning failsafe
}
"""ERR.Subsys: the causes by ECode."""
PARTS: Final = {3: "ompass", 11: "GPS", 18: "aro"}
"""ERR.Subsys of a part that texts against arming name."""
MOTOR_TESTS: Final = {"starting motor test": True, "finished motor test": False}
"""MSG of a Copter at the begin and at the end of a motor test."""
FRAMES: Final = {
    Family.COPTER: {
        1: 2, 2: 13, 3: 14, 4: 14, 5: 13, 6: 4, 7: 15, 8: 3, 9: 3, 10: 2, 11: 4, 12: 29, 13: 4, 14: 35,
    },
    Family.PLANE: {}, Family.ROVER: {2: MAV_TYPE_SURFACE_BOAT}, Family.SUB: {}, Family.TRACKER: {}, Family.BLIMP: {},
}  # fmt: skip
"""MAV_TYPE by FRAME_CLASS."""
TYPES: Final = {
    Family.COPTER: 2, Family.PLANE: 1, Family.ROVER: 10, Family.SUB: 12, Family.TRACKER: 5, Family.BLIMP: 7,
}  # fmt: skip
"""MAV_TYPE without a FRAME_CLASS."""
