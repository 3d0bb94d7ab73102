"""PX4's modes: (main mode, sub mode) -> (name, who decides the next motion).

From `px4_custom_mode.h` of 1.17: custom_mode holds the main mode in bits 16-23 and the sub mode in bits 24-31.
AUTO sub modes from 11 up are external (ROS 2) modes whose numbers moved between versions, so they have no name here.
"""

from __future__ import annotations

from typing import Final

from ...interface.status import RobotMode

MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN

MAIN: Final[dict[int, tuple[str, RobotMode]]] = {
    1: ("MANUAL", MANUAL),
    2: ("ALTCTL", MANUAL),
    3: ("POSCTL", MANUAL),
    4: ("AUTO", AUTO),
    5: ("ACRO", MANUAL),
    6: ("OFFBOARD", AUTO),
    7: ("STABILIZED", MANUAL),
    8: ("RATTITUDE", MANUAL),
    9: ("SIMPLE", MANUAL),  # reserved
    10: ("TERMINATION", UNKNOWN),  # nobody decides
    11: ("ALTITUDE_CRUISE", MANUAL),
}

SUB: Final[dict[tuple[int, int], tuple[str, RobotMode]]] = {
    (3, 1): ("POSCTL.ORBIT", AUTO),  # circles by itself
    (3, 2): ("POSCTL.SLOW", MANUAL),
    (4, 1): ("AUTO.READY", AUTO),
    (4, 2): ("AUTO.TAKEOFF", AUTO),
    (4, 3): ("AUTO.LOITER", AUTO),
    (4, 4): ("AUTO.MISSION", AUTO),
    (4, 5): ("AUTO.RTL", AUTO),
    (4, 6): ("AUTO.LAND", AUTO),
    (4, 7): ("AUTO.RTGS", AUTO),  # reserved
    (4, 8): ("AUTO.FOLLOW_TARGET", AUTO),
    (4, 9): ("AUTO.PRECLAND", AUTO),
    (4, 10): ("AUTO.VTOL_TAKEOFF", AUTO),
}
