"""Commands of others, seen on the link: a ground station's COMMAND_LONG and the autopilot's acknowledgement.

While armed, ArduPilot shows a commanded emergency stop (MAV_CMD_DO_AUX_FUNCTION) in no status message. The command and
its acknowledgement show it. Only an ACCEPTED command counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ....mavlink.enumerations import (
    MAV_CMD_DO_AUX_FUNCTION,
    MAV_CMD_DO_FLIGHTTERMINATION,
    MAV_RESULT_IN_PROGRESS,
)

if TYPE_CHECKING:
    from ....clock import Instant
    from ....mavlink.definitions import CommandAck, CommandInt, CommandLong

COMMANDS: Final = frozenset({MAV_CMD_DO_FLIGHTTERMINATION, MAV_CMD_DO_AUX_FUNCTION})
MOTOR_ESTOP: Final = 31  # the auxiliary function
LOW, HIGH = 0, 2  # the positions of its switch
PATIENCE: Final = 5.0  # s for an acknowledgement


class PendingCommand(NamedTuple):
    """A command to this vehicle that waits for its acknowledgement."""

    command: int
    param1: float
    param2: float
    sender: tuple[int, int]
    """(system, component)."""
    at: float


def asked(message: CommandLong | CommandInt, sender: tuple[int, int], now: Instant) -> PendingCommand | None:
    """The command, if a status depends on it. NaN parameters match nothing."""
    if message.command not in COMMANDS:
        return None
    return PendingCommand(message.command, message.param1, message.param2, sender, now.mono)


def is_answered(asked: PendingCommand | None, ack: CommandAck, now: Instant) -> bool:
    """True if `ack` is the final result of the pending command, accepted or refused."""
    return (
        asked is not None
        and ack.command == asked.command
        and ack.result != MAV_RESULT_IN_PROGRESS
        and ack.target_system in (0, asked.sender[0])
        and now.mono - asked.at <= PATIENCE
    )
