"""COMMAND_LONG and COMMAND_INT of others to this vehicle, and its COMMAND_ACK: what was commanded is so."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...mavlink.definitions import CommandAck, CommandInt, CommandLong
from .. import causes, commands, estop
from ..identity import ARDUPILOT, Family, Stack

if TYPE_CHECKING:
    from ...clock import Instant
    from ..memory import Memory
    from ..options import HardwareOptions

TERMINATES: dict[Stack, frozenset[Family]] = {
    # Copter, Sub and Blimp only disarm, and can be armed again at once; PX4 shows it as its state
    Stack.ARDUPILOT: frozenset({Family.PLANE, Family.ROVER}),
}


def overheard(memory: Memory, message: CommandLong | CommandInt, sender: tuple[int, int], now: Instant) -> None:
    """A command of `sender` to this vehicle passed by."""
    asked = commands.asked(message, sender, now)
    if asked is not None:
        memory.asked = asked


def command_ack(memory: Memory, message: CommandAck, now: Instant, options: HardwareOptions) -> None:
    """COMMAND_ACK: the vehicle has done what it was asked."""
    asked = memory.asked
    if asked is None or not commands.is_answered(asked, message, now):
        return
    memory.asked = None
    if message.result != commands.ACCEPTED:
        return
    source = f"COMMAND_ACK: accepted command {asked.command} of {asked.sender[0]}.{asked.sender[1]}"
    if asked.command == commands.DO_FLIGHTTERMINATION:
        if asked.param1 >= 0.5 and memory.family in TERMINATES.get(memory.stack, frozenset()):
            memory.latches = causes.announce(memory.latches, 1002, None, now, source)
        return
    honoured = memory.stack is ARDUPILOT and memory.family in estop.HONOURED_BY
    known = honoured and asked.param1 == commands.MOTOR_ESTOP
    if known and asked.param2 in (commands.LOW, commands.HIGH):
        memory.stop = estop.said(memory.stop, asked.param2 == commands.HIGH, None, now, source)
        memory.assumed_free = False
