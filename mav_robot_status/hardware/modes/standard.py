"""MAVLink's own answers for every other autopilot: standard modes, mode properties, base_mode flags.

MAV_STANDARD_MODE and MAV_MODE_FLAG of common.xml. Each gives who decides the next motion.
"""

from __future__ import annotations

from typing import Final

from ...interface.status import RobotMode

MANUAL, AUTO = RobotMode.MANUAL, RobotMode.AUTO

STANDARD_MODES: Final[dict[int, tuple[str, RobotMode]]] = {
    1: ("POSITION_HOLD", MANUAL),
    2: ("ORBIT", AUTO),
    3: ("CRUISE", MANUAL),
    4: ("ALTITUDE_HOLD", MANUAL),
    5: ("SAFE_RECOVERY", AUTO),
    6: ("MISSION", AUTO),
    7: ("LAND", AUTO),
    8: ("TAKEOFF", AUTO),
}

PROPERTY_AUTO_MODE: Final = 4  # MAV_MODE_PROPERTY_AUTO_MODE

# MAV_MODE_FLAG, in the order in which they decide.
BASE_MODE_FLAGS: Final[tuple[tuple[int, str, RobotMode], ...]] = (
    (0x04 | 0x08, "AUTO or GUIDED", AUTO),
    (0x40 | 0x10, "MANUAL_INPUT or STABILIZE", MANUAL),
)
