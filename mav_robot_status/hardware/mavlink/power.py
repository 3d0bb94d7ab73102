"""drives_powered and motion_possible: armed and not blocked."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...interface.status import RobotMode, TriState
from ...mavlink.enumerations import MAV_STATE_FLIGHT_TERMINATION, MAV_STATE_UNINIT
from .armed import NOT_MOVING_STATES
from .estop.rule import motor_test_words
from .heartbeat.rule import (
    actuators_blocked,
    base_mode_words,
    custom_mode_words,
    hides_armed,
    is_initialising,
    state_words,
)
from .reason import FALSE, TRUE, UNKNOWN, Finding, Reason, off

if TYPE_CHECKING:
    from .autopilots.modes import FlightMode
    from .facts import Facts
    from .options import HardwareOptions


def drives_powered(facts: Facts, options: HardwareOptions, stopped: TriState, why_stopped: Reason) -> Finding:
    """Armed, and neither blocked by hardware-in-the-loop nor stopped."""
    if not facts.armed:
        if hides_armed(facts):
            return UNKNOWN, Reason("a state in which the autopilot does not say whether it is armed", state_words)
        if facts.motor_test.turns:
            return TRUE, Reason("a motor turns while it is disarmed (motor test)", motor_test_words)
        if facts.motor_test.may_turn:
            return UNKNOWN, Reason("a motor may turn while it is disarmed (motor test)", motor_test_words)
        if facts.fresh.arming_told and stopped is not TRUE:
            return UNKNOWN, Reason("an arming was announced, and no HEARTBEAT has arrived since", base_mode_words)
        return FALSE, Reason("disarmed", base_mode_words)
    if actuators_blocked(facts, options):
        return FALSE, Reason("hardware in the loop: actuators blocked", base_mode_words)
    if stopped is TRUE:
        return FALSE, why_stopped._replace(rule=f"e_stopped: {why_stopped.rule}")
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        return FALSE, Reason("state FLIGHT_TERMINATION", state_words)
    if why_stopped.doubt:
        return UNKNOWN, why_stopped._replace(rule=f"e_stopped: {why_stopped.rule}")
    return TRUE, Reason("armed", base_mode_words)


def motion_possible(
    facts: Facts, options: HardwareOptions, mode: FlightMode, drives: TriState, why_drives: Reason
) -> Finding:
    """Whether a motion command would move the vehicle now. Errors and sensors do not matter."""
    state = facts.heartbeat.system_status
    if drives is FALSE:
        return FALSE, why_drives._replace(rule=off(why_drives.rule))
    if not facts.armed:  # powered or not: a motor test takes no motion command
        return UNKNOWN, why_drives
    if state in NOT_MOVING_STATES:
        return FALSE, Reason("a state in which the vehicle does not move", state_words)
    if is_initialising(facts):
        return FALSE, Reason("mode INITIALIZING", custom_mode_words)
    if options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        return FALSE, Reason("manual mode (manual_blocks_motion)", custom_mode_words)
    if drives is UNKNOWN:
        return UNKNOWN, why_drives
    if state == MAV_STATE_UNINIT:
        return UNKNOWN, Reason("state UNINIT", state_words)
    return TRUE, Reason("armed, not stopped, in a state that moves", state_words)
