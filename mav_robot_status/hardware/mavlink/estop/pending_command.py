"""Commands of others, seen on the link: a ground station's COMMAND_LONG and the autopilot's acknowledgement.

While armed, ArduPilot shows a commanded emergency stop (MAV_CMD_DO_AUX_FUNCTION) in no status message. The command and
its acknowledgement show it. Only an ACCEPTED command counts. An acknowledgement names the command and its sender, but
neither the function nor the position: it counts only if all outstanding commands that it may answer say the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ....mavlink.definitions import CommandLong
from ....mavlink.enumerations import (
    MAV_CMD_COMPONENT_ARM_DISARM,
    MAV_CMD_DO_AUX_FUNCTION,
    MAV_CMD_DO_FLIGHTTERMINATION,
    MAV_CMD_DO_MOTOR_TEST,
    MAV_RESULT_IN_PROGRESS,
)
from .motor_test import COMMANDS as MOTOR_TESTS
from .state import ARM_EMERGENCY_STOP, MOTOR_ESTOP

if TYPE_CHECKING:
    from ....clock import Instant
    from ....mavlink.definitions import CommandAck, CommandInt
    from .state import Stop

COMMANDS: Final = (
    frozenset({MAV_CMD_COMPONENT_ARM_DISARM, MAV_CMD_DO_FLIGHTTERMINATION, MAV_CMD_DO_AUX_FUNCTION}) | MOTOR_TESTS
)
LOW, MIDDLE, HIGH = 0, 1, 2  # the positions of a switch
ENGAGES: Final[dict[tuple[float, float], bool]] = {
    (MOTOR_ESTOP, LOW): False,
    (MOTOR_ESTOP, HIGH): True,
    (ARM_EMERGENCY_STOP, LOW): True,
    (ARM_EMERGENCY_STOP, MIDDLE): False,
    (ARM_EMERGENCY_STOP, HIGH): False,
}
"""Whether a function in a position engages (True) or releases the emergency stop: RC_Channel.cpp."""
PATIENCE: Final = 5.0  # s for an acknowledgement
MOST: Final = 8
"""Outstanding commands that are remembered."""


class PendingCommand(NamedTuple):
    """A command to this vehicle that waits for its acknowledgement."""

    command: int
    param1: float
    param2: float
    sender: tuple[int, int]
    """(system, component)."""
    at: float
    before: Stop
    """What was known of a stop before it."""
    after: Stop
    """What is known while it is outstanding."""
    lasts: float = 0.0
    """Of a motor test: its seconds, for all of its motors; 0 if it does not say them."""

    @property
    def engages(self) -> bool | None:
        """Whether it engages (True) or releases (False) the motor emergency stop. None: neither."""
        if self.command != MAV_CMD_DO_AUX_FUNCTION:
            return None
        return ENGAGES.get((self.param1, self.param2))


Pending = tuple[PendingCommand, ...]
"""The outstanding commands, the latest last."""
NONE: Final[Pending] = ()


def asked(
    message: CommandLong | CommandInt, sender: tuple[int, int], stop: Stop, now: Instant
) -> PendingCommand | None:
    """The command, if a status depends on it. NaN parameters match nothing."""
    if message.command not in COMMANDS:
        return None
    lasts = 0.0
    if message.command == MAV_CMD_DO_MOTOR_TEST:
        lasts = message.param4 * max(message.param5 if isinstance(message, CommandLong) else message.x, 1)
    return PendingCommand(message.command, message.param1, message.param2, sender, now.mono, stop, stop, lasts)


def remembered(pending: Pending, asked: PendingCommand) -> Pending:
    """The outstanding commands with one more."""
    return (*(old for old in pending if asked.at - old.at <= PATIENCE), asked)[-MOST:]


def answered(pending: Pending, ack: CommandAck, now: Instant) -> tuple[PendingCommand | None, Pending]:
    """The command whose final result is `ack`, and those that it leaves outstanding. None: it is not clear which."""
    if ack.result == MAV_RESULT_IN_PROGRESS:
        return None, pending
    to = ack.target_system, ack.target_component
    meant = [
        one
        for one in pending
        if one.command == ack.command
        and now.mono - one.at <= PATIENCE
        and all(mine in (0, its) for mine, its in zip(to, one.sender, strict=True))
    ]
    left = tuple(one for one in pending if one not in meant)
    alike = len({(one.param1, one.param2, one.sender) for one in meant}) == 1
    return (meant[-1]._replace(before=meant[0].before) if alike else None), left
