"""The messages that a status needs, with their rates, for use in the profiles."""

from __future__ import annotations

from typing import Final, NamedTuple

from ....mavlink import definitions as mav
from ....mavlink import enumerations as mavlink


class Wanted(NamedTuple):
    """One message that a status needs."""

    id: int
    name: str
    rate: float
    """Hz."""
    size: int
    """Bytes of a complete MAVLink 2 frame."""
    instead: int | None = None
    """A message that replaces it."""


def wanted(message_id: int, rate: float, instead: int | None = None) -> Wanted:
    """A message at `rate` Hz."""
    definition = mav.MESSAGES[message_id]
    return Wanted(message_id, definition.name, rate, definition.size + 12, instead)


class Once(NamedTuple):
    """One message that is requested once: after the first heartbeat, and after a reboot."""

    id: int
    name: str
    older: int | None = None
    """The command, with 1 as its first parameter, for firmware that does not know MAV_CMD_REQUEST_MESSAGE."""
    again: bool = False
    """Whether it is requested again until the message arrives or the autopilot refuses a second time."""


VERSION: Final = Once(
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, "AUTOPILOT_VERSION", mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES
)
MODES: Final = Once(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES, "AVAILABLE_MODES")
METADATA: Final = Once(mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA, "COMPONENT_METADATA", again=True)
"""Where the table of PX4's events is. Requested only if a table is wanted."""

COMMON: Final = (
    wanted(mavlink.MAVLINK_MSG_ID_SYS_STATUS, 1.0),
    wanted(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 2.0),
    wanted(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 4.0, instead=mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED),
    wanted(mavlink.MAVLINK_MSG_ID_ATTITUDE, 4.0),
    wanted(mavlink.MAVLINK_MSG_ID_SYSTEM_TIME, 1.0),
)
OUTPUTS: Final = (wanted(mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, 2.0),)
"""They show a motor that turns, also while the vehicle is disarmed."""
OUTPUT_WATCH: Final = (*OUTPUTS, wanted(mavlink.MAVLINK_MSG_ID_VFR_HUD, 2.0))
"""The additional messages for the output watch."""
ESTIMATOR: Final = (wanted(mavlink.MAVLINK_MSG_ID_EKF_STATUS_REPORT, 0.5),)
"""It is valid for ten seconds."""
CURRENT_MODE: Final = (wanted(mavlink.MAVLINK_MSG_ID_CURRENT_MODE, 1.0),)
