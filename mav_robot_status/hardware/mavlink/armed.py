"""Armed, and able to move: what a HEARTBEAT says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...mavlink.enumerations import (
    MAV_MODE_FLAG_HIL_ENABLED,
    MAV_MODE_FLAG_SAFETY_ARMED,
    MAV_STATE_BOOT,
    MAV_STATE_CALIBRATING,
    MAV_STATE_EMERGENCY,
    MAV_STATE_FLIGHT_TERMINATION,
    MAV_STATE_POWEROFF,
)

if TYPE_CHECKING:
    from ...mavlink.definitions import Heartbeat

NOT_MOVING_STATES: Final = frozenset(
    {MAV_STATE_BOOT, MAV_STATE_CALIBRATING, MAV_STATE_EMERGENCY, MAV_STATE_POWEROFF, MAV_STATE_FLIGHT_TERMINATION}
)
"""In these states a command does not move a vehicle, although it is armed."""


def is_armed(heartbeat: Heartbeat) -> bool:
    """Whether a heartbeat says armed."""
    return bool(heartbeat.base_mode & MAV_MODE_FLAG_SAFETY_ARMED)


def may_move(heartbeat: Heartbeat) -> bool:
    """Whether a heartbeat says armed, and nothing that makes motion impossible."""
    flags = heartbeat.base_mode & (MAV_MODE_FLAG_SAFETY_ARMED | MAV_MODE_FLAG_HIL_ENABLED)
    return flags == MAV_MODE_FLAG_SAFETY_ARMED and heartbeat.system_status not in NOT_MOVING_STATES
