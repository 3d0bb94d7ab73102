"""The messages that are decoded, and those that are in the status at once."""

from __future__ import annotations

from typing import Final

from ...mavlink import enumerations as mavlink
from .belief.belief import CLOCKED
from .handlers import HANDLERS_BY_ID

HEARTBEAT_ID: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
APPLET_ID: Final = mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT
ARM_STATUS_ID: Final = mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_ARM_STATUS
COMMAND_IDS: Final = frozenset({mavlink.MAVLINK_MSG_ID_COMMAND_INT, mavlink.MAVLINK_MSG_ID_COMMAND_LONG})
"""Messages from other senders."""
HIGH_LATENCY_ID: Final = mavlink.MAVLINK_MSG_ID_HIGH_LATENCY2
"""It says what a HEARTBEAT says, so its sender is checked first."""
METADATA_ID: Final = mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA
FILE_ID: Final = mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
FILE_IDS: Final = frozenset({METADATA_ID, FILE_ID})
"""Messages that no rule needs: they bring the table of PX4's events."""
WANTED_IDS: Final = frozenset(HANDLERS_BY_ID) | CLOCKED | COMMAND_IDS | {HIGH_LATENCY_ID, METADATA_ID}
IDS_WITH_FILES: Final = WANTED_IDS | FILE_IDS
"""The same while a file is read. At other times files are those of other programs, and are not decoded."""

EDGES: Final = frozenset(
    {
        HEARTBEAT_ID,
        HIGH_LATENCY_ID,
        mavlink.MAVLINK_MSG_ID_SYS_STATUS,
        mavlink.MAVLINK_MSG_ID_STATUSTEXT,
        mavlink.MAVLINK_MSG_ID_EVENT,
        mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
        mavlink.MAVLINK_MSG_ID_CURRENT_MODE,
        APPLET_ID,
    }
)
"""Messages that are in the status at once. All others are streams."""
