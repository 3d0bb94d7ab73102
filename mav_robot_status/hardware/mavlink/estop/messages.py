"""Motor outputs and ESC telemetry, and the parameters that assign outputs and switches."""

from __future__ import annotations

import math
import re
from struct import unpack
from typing import TYPE_CHECKING, Any, Final

from ....interface.status import TriState
from ....mavlink import definitions as mav
from ....mavlink.definitions import CommandAck, CommandInt, CommandLong
from ....mavlink.enumerations import (
    MAV_CMD_COMPONENT_ARM_DISARM,
    MAV_CMD_DO_FLIGHTTERMINATION,
    MAV_RESULT_ACCEPTED,
    MAV_STATE_FLIGHT_TERMINATION,
    MAV_TYPE_FIXED_WING,
)
from ..faults import latches
from ..faults.causes import TERMINATION_ANNOUNCED
from ..faults.sensors import safety_switch_on
from ..motion.estimate import hud_speeds
from ..state import FRESH, heard, honours_stop, is_fresh, vtol_state
from . import applet as applet_rules
from . import motor_test, outputs, pending_command
from . import state as estop

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state import VehicleState

STOP_POSITION: Final = 1800
"""Pulse of an RC channel (us) from which ArduPilot takes its switch as high."""

NO_PULSE: Final = 0xFFFF
COASTING: Final = 3.0
"""Seconds after the report of a stop for which a vehicle may still move, and its motors may still turn."""

_NUMBERED: Final = re.compile(rb"SERVO(\d{1,2})_FUNCTION|RC(\d{1,2})_OPTION")


def servo_output_raw(state: VehicleState, message: mav.ServoOutputRaw, now: Instant, options: HardwareOptions) -> None:
    """SERVO_OUTPUT_RAW: the output watch of ArduPilot. A driven motor ends every evidence of a stop."""
    if not options.watch_outputs or message.port != 0:
        return
    if not state.heartbeats.armed:
        _heard_disarmed(state, message[:8] + message[9:], now.mono)
    if not state.profile.stops.outputs_show:
        return
    hud, at, watch = state.latest.vfr_hud, now.mono, state.watch
    family, vehicle_type = state.family, state.vehicle_type
    outputs.heard_outputs(
        watch,
        message[:8] + message[9:],
        vehicle_type,
        state.heartbeats,
        hud.message.throttle if hud is not None and is_fresh(hud, at, FRESH) else None,
        -math.inf if hud is None else hud.at,
        hud_speeds(state.latest)[0],
        at,
        outputs.hovers(family, vehicle_type, vtol_state(state)),
    )
    if state.applet is not None:
        state.applet = applet_rules.driven(state.applet, watch.driven, at)
    before = state.stop
    if watch.driven:
        state.stop = estop.ended(before)
    elif before.said is not TriState.TRUE:
        off = watch.off_since
        if watch.held and outputs.may_be_held(family, vehicle_type):
            state.stop = estop.doubted(before, estop.HELD, at)
        elif off is not None and at >= off + outputs.SWITCHED_OFF:
            state.stop = estop.doubted(before, estop.SHUT_DOWN, at)


def _heard_disarmed(state: VehicleState, values: outputs.Outputs, now: float) -> None:
    """The outputs of a disarmed vehicle: a motor test drives them."""
    status = state.latest.sys_status
    held = (
        status is not None
        and is_fresh(status, now, FRESH)
        and state.profile.sensors.has_safety_switch
        and safety_switch_on(status.message)
    )
    if held or now < state.heartbeats.edge.mono + motor_test.AFTER_DISARM:
        return
    if state.profile.stops.outputs_show:
        motors, assumed = outputs.channels(state.watch, state.vehicle_type)
        if assumed and state.vehicle_type == MAV_TYPE_FIXED_WING:
            motors += outputs.LIFT
    else:  # of a PX4 any output may be a motor: those count that stand at a stop value of a motor
        state.watch.at, state.watch.values = now, values
        low, high = outputs.LOW_END
        known = state.test.stop
        motors = tuple(c for c, value in enumerate(values, 1) if c in known or low <= value <= high)
        assumed = False
        if state.heartbeats.state == MAV_STATE_FLIGHT_TERMINATION and state.test.until < now:
            return  # its outputs stand at their failsafe values
    motor_test.heard_outputs(state.test, values, motors, assumed, state.family, now)


def param_value(state: VehicleState, message: mav.ParamValue, now: Instant, options: HardwareOptions) -> None:
    """PARAM_VALUE: SERVOn_FUNCTION gives the outputs that drive motors, RCn_OPTION the functions of the switches."""
    found, value = _NUMBERED.fullmatch(message.param_id.split(b"\0")[0]), message.param_value
    if found is None or not math.isfinite(value) or not state.profile.stops.outputs_show:
        return
    channel = int(found[1] or found[2])
    if not 1 <= channel <= 32:
        return
    if found[1]:
        state.watch.name({**state.watch.functions, channel: int(value)})
    else:
        state.switches = {**state.switches, channel: int(value)}


def rc_channels(state: VehicleState, message: mav.RcChannels, now: Instant, options: HardwareOptions) -> None:
    """RC_CHANNELS: whether a switch of option 31 is in its stop position."""
    if not state.switches:
        return
    seen = False
    for channel, option in state.switches.items():
        if option == estop.MOTOR_ESTOP and channel <= len(message) and 0 < message[channel - 1] < NO_PULSE:
            if message[channel - 1] >= STOP_POSITION:
                state.stop_switch_at = now.mono
                return
            seen = True
    state.stop_switch_at = -math.inf
    if seen:
        state.stop = estop.switched_back(state.stop, now.mono)


def named_value_float(
    state: VehicleState, message: mav.NamedValueFloat, now: Instant, options: HardwareOptions
) -> None:
    """NAMED_VALUE_FLOAT: the word of the applet. A value without a meaning is ignored and counted."""
    if not applet_rules.is_word(message) or not state.profile.stops.outputs_show:
        return
    value = applet_rules.value_of(message)
    if value is None:
        state.applet_ignored += 1
        return
    state.applet = applet_rules.heard(state.applet, value, now.mono)
    if not value:
        state.stop = estop.ended(state.stop)


def mission_current(state: VehicleState, message: mav.MissionCurrent, now: Instant, options: HardwareOptions) -> None:
    """MISSION_CURRENT: older firmware sends it without a mission_state."""
    if message.mission_state:
        state.reports_mission = True


def look_again(state: VehicleState, now: float) -> None:
    """At each heartbeat: end what was said, if the vehicle has power or shows its stops; note a silent applet."""
    stop, word, shown_from = state.stop, state.applet, state.profile.stops.shown_from
    if word is not None and not applet_rules.is_fresh(word, now):
        state.applet = None
        if applet_rules.stops(word, honours_stop(state)):
            stop = estop.doubted(stop, estop.APPLET_SILENT, now)
    if stop.said is TriState.TRUE and state.heartbeats.armed and _has_power(state, now):
        stop = estop.doubted(stop, estop.UNDER_POWER, now)
    if shown_from is not None and state.version is not None and state.version >= shown_from:
        stop = estop.NOTHING  # its state shows its stops, so what it said is not needed
    state.stop = stop


def _has_power(state: VehicleState, now: float) -> bool:
    """Whether there are signs of power, some time after a stop was reported: a stopped vehicle coasts first."""
    latest, watch, since = state.latest, state.watch, state.stop.last
    if now < since + COASTING:
        return False
    if watch.at is not None and now <= watch.at + FRESH:
        if outputs.is_at_stop(watch, state.vehicle_type):
            return False
        if outputs.may_drive(watch, state.family, state.vehicle_type):
            return True
    if is_fresh(latest.esc, now, FRESH):
        return True
    fast, hud = state.motion.fast_since, latest.vfr_hud
    moves = fast is not None and now >= max(fast, since) + COASTING
    return moves and hud is not None and is_fresh(hud, now, FRESH) and hud.message.throttle >= outputs.DEMAND


def esc_telemetry(state: VehicleState, message: Any, now: Instant, options: HardwareOptions) -> None:
    """ESC_TELEMETRY_n (ArduPilot): four motors."""
    _turning(state, message, unpack("<4H", message.rpm), now)


def esc_status(state: VehicleState, message: mav.EscStatus, now: Instant, options: HardwareOptions) -> None:
    """ESC_STATUS (PX4): four motors."""
    _turning(state, message, unpack("<4i", message.rpm), now)


def _turning(state: VehicleState, message: Any, rpm: tuple[int, ...], now: Instant) -> None:
    seen = state.latest
    if any(rpm):
        seen.esc = heard(message, now.mono, seen.esc)
    elif seen.esc is not None and type(seen.esc.message) is type(message):
        seen.esc = None


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
    if message.command in motor_test.COMMANDS:
        if message.result == MAV_RESULT_ACCEPTED:
            motor_test.accepted(state.test, message.command, 0.0 if asked is None else asked.lasts, now.mono)
    elif asked is not None:
        _apply(state, asked, message, now)


def _apply(state: VehicleState, asked: pending_command.PendingCommand, message: CommandAck, now: Instant) -> None:
    """Apply a command that concerns a stop, if the vehicle accepted it."""
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
