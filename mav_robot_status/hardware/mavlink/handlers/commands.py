"""COMMAND_LONG and COMMAND_INT of others to this vehicle, and its COMMAND_ACK: an accepted command has taken effect."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....mavlink.definitions import CommandAck, CommandInt, CommandLong
from ....mavlink.enumerations import MAV_CMD_DO_FLIGHTTERMINATION, MAV_RESULT_ACCEPTED
from ..causes import TERMINATION_ANNOUNCED
from ..state import estop, latches, pending_command

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState


def overheard(state: VehicleState, message: CommandLong | CommandInt, sender: tuple[int, int], now: Instant) -> None:
    """A command of `sender` to this vehicle."""
    asked = pending_command.asked(message, sender, now)
    if asked is not None:
        state.asked = asked


def command_ack(state: VehicleState, message: CommandAck, now: Instant, options: HardwareOptions) -> None:
    """COMMAND_ACK: apply the command if the vehicle accepted it."""
    asked = state.asked
    if asked is None or not pending_command.is_answered(asked, message, now):
        return
    state.asked = None
    if message.result != MAV_RESULT_ACCEPTED:
        return
    stops = state.profile.stops
    source = f"COMMAND_ACK: accepted command {asked.command} of {asked.sender[0]}.{asked.sender[1]}"
    if asked.command == MAV_CMD_DO_FLIGHTTERMINATION:
        if asked.param1 >= 0.5 and state.family in stops.command_terminates:
            state.latches = latches.announce(state.latches, TERMINATION_ANNOUNCED, None, now, source)
        return
    honoured = stops.honoured_by is not None and state.family in stops.honoured_by
    known = honoured and asked.param1 == pending_command.MOTOR_ESTOP
    if known and asked.param2 in (pending_command.LOW, pending_command.HIGH):
        state.stop = estop.said(state.stop, asked.param2 == pending_command.HIGH, None, now, source)
        state.assumed_free = False
