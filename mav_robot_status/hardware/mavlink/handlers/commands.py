"""COMMAND_LONG and COMMAND_INT of others to this vehicle, and its COMMAND_ACK: an accepted command has taken effect."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....interface.status import TriState
from ....mavlink.definitions import CommandAck, CommandInt, CommandLong
from ....mavlink.enumerations import (
    MAV_CMD_COMPONENT_ARM_DISARM,
    MAV_CMD_DO_FLIGHTTERMINATION,
    MAV_RESULT_ACCEPTED,
)
from ..causes import TERMINATION_ANNOUNCED
from ..state import estop, latches, pending_command
from ..state.vehicle_state import honours_stop

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState


def overheard(state: VehicleState, message: CommandLong | CommandInt, sender: tuple[int, int], now: Instant) -> None:
    """A command of `sender` that was delivered to this vehicle.

    Until it is acknowledged, a command that changes the stop leaves a doubt: its acknowledgement may get lost.
    """
    asked = pending_command.asked(message, sender, state.stop, now)
    if asked is None:
        return
    engages = asked.engages if honours_stop(state) else None
    if engages is not None and state.stop.said is not (TriState.TRUE if engages else TriState.FALSE):
        state.stop = estop.doubted(state.stop, estop.UNANSWERED, now.mono)
        asked = asked._replace(after=state.stop)
    state.asked = pending_command.remembered(state.asked, asked)


def command_ack(state: VehicleState, message: CommandAck, now: Instant, options: HardwareOptions) -> None:
    """COMMAND_ACK: apply the command if the vehicle accepted it."""
    asked, state.asked = pending_command.answered(state.asked, message, now)
    if message.command == MAV_CMD_COMPONENT_ARM_DISARM:
        if message.result == MAV_RESULT_ACCEPTED and (asked is None or asked.param1 != 0):
            state.told_armed = max(state.told_armed, now.mono)
        return
    if asked is None:
        return
    if message.result != MAV_RESULT_ACCEPTED:
        if state.stop is asked.after:
            state.stop = asked.before
        return
    source = f"COMMAND_ACK: accepted command {asked.command} of {asked.sender[0]}.{asked.sender[1]}"
    if asked.command == MAV_CMD_DO_FLIGHTTERMINATION:
        if asked.param1 >= 0.5 and state.family in state.profile.stops.command_terminates:
            state.latches = latches.announce(state.latches, TERMINATION_ANNOUNCED, None, now, source)
        return
    engages = asked.engages
    if engages is not None and honours_stop(state):
        state.stop = estop.said(state.stop, engages, None, now, source)
        state.assumed_free = False
