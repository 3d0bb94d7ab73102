"""Commands of others, seen on the link: a ground station's COMMAND_LONG and the autopilot's acknowledgement.

ArduPilot shows an emergency stop that was commanded (MAV_CMD_DO_AUX_FUNCTION) in no status message while armed, so a
gateway that hears both halves knows more than the status messages say. Only an ACCEPTED command counts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from ..clock import Instant
    from ..mavlink.definitions import CommandAck, CommandInt, CommandLong

DO_FLIGHTTERMINATION: Final = 185
DO_AUX_FUNCTION: Final = 218
COMMANDS: Final = frozenset({DO_FLIGHTTERMINATION, DO_AUX_FUNCTION})
MOTOR_ESTOP: Final = 31  # the auxiliary function
LOW, HIGH = 0, 2  # the positions of its switch
ACCEPTED, IN_PROGRESS = 0, 5  # MAV_RESULT
PATIENCE: Final = 5.0  # s for an acknowledgement


class Asked(NamedTuple):
    """A command to this vehicle that waits for its acknowledgement."""

    command: int
    param1: float
    param2: float
    sender: tuple[int, int]
    """(system, component)."""
    at: float


def asked(message: CommandLong | CommandInt, sender: tuple[int, int], now: Instant) -> Asked | None:
    """The command, if it is one that tells something; NaN parameters tell nothing."""
    if message.command not in COMMANDS:
        return None
    return Asked(message.command, message.param1, message.param2, sender, now.mono)


def is_answered(asked: Asked | None, ack: CommandAck, now: Instant) -> bool:
    """True if `ack` is the last word on the command that was asked, be it accepted or refused."""
    return (
        asked is not None
        and ack.command == asked.command
        and ack.result != IN_PROGRESS
        and ack.target_system in (0, asked.sender[0])
        and now.mono - asked.at <= PATIENCE
    )
