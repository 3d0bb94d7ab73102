"""ArduPilot's modes: number -> (name, who decides the next motion).

Numbers and names are those of ardupilotmega.xml (COPTER_MODE, PLANE_MODE, ...) and of the enumerations in the
vehicles' `mode.h`; Blimp has no enumeration in any XML. AUTO: a program decides, or the vehicle is held and ignores the
sticks. MANUAL: a pilot's sticks set attitude, rate, velocity or climb, however much the autopilot stabilises.
"""

from __future__ import annotations

from typing import Final

from ...interface.status import RobotMode

MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN
ModeTable = dict[int, tuple[str, RobotMode]]

COPTER: Final[ModeTable] = {
    0: ("STABILIZE", MANUAL),
    1: ("ACRO", MANUAL),
    2: ("ALT_HOLD", MANUAL),
    3: ("AUTO", AUTO),
    4: ("GUIDED", AUTO),
    5: ("LOITER", MANUAL),  # the sticks command velocity; on Plane and Rover LOITER is a program
    6: ("RTL", AUTO),
    7: ("CIRCLE", AUTO),  # the sticks only trim
    8: ("POSITION", MANUAL),  # removed from the firmware
    9: ("LAND", AUTO),
    10: ("OF_LOITER", MANUAL),  # removed from the firmware
    11: ("DRIFT", MANUAL),
    13: ("SPORT", MANUAL),
    14: ("FLIP", MANUAL),  # seconds long, returns to the pilot's mode
    15: ("AUTOTUNE", MANUAL),  # the pilot positions, no remote motion
    16: ("POSHOLD", MANUAL),
    17: ("BRAKE", AUTO),  # stops and holds, no pilot input
    18: ("THROW", AUTO),  # no pilot input
    19: ("AVOID_ADSB", AUTO),
    20: ("GUIDED_NOGPS", AUTO),
    21: ("SMART_RTL", AUTO),
    22: ("FLOWHOLD", MANUAL),
    23: ("FOLLOW", AUTO),
    24: ("ZIGZAG", MANUAL),  # storing points is piloted, and the stage is not on the wire
    25: ("SYSTEMID", MANUAL),
    26: ("AUTOROTATE", AUTO),
    27: ("AUTO_RTL", AUTO),
    28: ("TURTLE", MANUAL),
    29: ("RATE_ACRO", MANUAL),
}

PLANE: Final[ModeTable] = {
    0: ("MANUAL", MANUAL),
    1: ("CIRCLE", AUTO),
    2: ("STABILIZE", MANUAL),
    3: ("TRAINING", MANUAL),
    4: ("ACRO", MANUAL),
    5: ("FLY_BY_WIRE_A", MANUAL),
    6: ("FLY_BY_WIRE_B", MANUAL),
    7: ("CRUISE", MANUAL),
    8: ("AUTOTUNE", MANUAL),
    10: ("AUTO", AUTO),
    11: ("RTL", AUTO),
    12: ("LOITER", AUTO),
    13: ("TAKEOFF", AUTO),
    14: ("AVOID_ADSB", AUTO),
    15: ("GUIDED", AUTO),
    16: ("INITIALIZING", UNKNOWN),
    17: ("QSTABILIZE", MANUAL),
    18: ("QHOVER", MANUAL),
    19: ("QLOITER", MANUAL),
    20: ("QLAND", AUTO),  # in base_mode's pilot group, but lands by itself
    21: ("QRTL", AUTO),
    22: ("QAUTOTUNE", MANUAL),
    23: ("QACRO", MANUAL),
    24: ("THERMAL", AUTO),
    25: ("LOITER_ALT_QLAND", AUTO),
    26: ("AUTOLAND", AUTO),
}

ROVER: Final[ModeTable] = {
    0: ("MANUAL", MANUAL),
    1: ("ACRO", MANUAL),
    2: ("LEARNING", MANUAL),  # removed from the firmware
    3: ("STEERING", MANUAL),
    4: ("HOLD", AUTO),  # sticks ignored, kept stopped
    5: ("LOITER", AUTO),
    6: ("FOLLOW", AUTO),
    7: ("SIMPLE", MANUAL),
    8: ("DOCK", AUTO),
    9: ("CIRCLE", AUTO),
    10: ("AUTO", AUTO),
    11: ("RTL", AUTO),
    12: ("SMART_RTL", AUTO),
    15: ("GUIDED", AUTO),
    16: ("INITIALIZING", UNKNOWN),
}

SUB: Final[ModeTable] = {
    0: ("STABILIZE", MANUAL),
    1: ("ACRO", MANUAL),
    2: ("ALT_HOLD", MANUAL),
    3: ("AUTO", AUTO),
    4: ("GUIDED", AUTO),
    7: ("CIRCLE", AUTO),
    9: ("SURFACE", AUTO),
    16: ("POSHOLD", MANUAL),  # the joystick flies it although the GUIDED bit is set
    19: ("MANUAL", MANUAL),
    20: ("MOTORDETECT", AUTO),
    21: ("SURFTRAK", MANUAL),
}

TRACKER: Final[ModeTable] = {
    0: ("MANUAL", MANUAL),
    1: ("STOP", AUTO),
    2: ("SCAN", AUTO),
    3: ("SERVO_TEST", MANUAL),
    4: ("GUIDED", AUTO),
    10: ("AUTO", AUTO),
    16: ("INITIALIZING", UNKNOWN),
}

BLIMP: Final[ModeTable] = {
    0: ("LAND", AUTO),
    1: ("MANUAL", MANUAL),
    2: ("VELOCITY", MANUAL),
    3: ("LOITER", MANUAL),
    4: ("RTL", AUTO),
}

INITIALISING: Final = 16  # Plane, Rover and Tracker; on Copter and Sub 16 is POSHOLD
