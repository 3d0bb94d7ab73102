"""drives_powered and motion_possible: armed and nothing in the way."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...interface.status import Evidence, RobotMode, TriState
from ..flight_mode import is_initialising
from .view import FALSE, NOT_MOVING_STATES, TERMINATED, TRUE, UNINIT, UNKNOWN, Finding, View, beat

if TYPE_CHECKING:
    from ..flight_mode import FlightMode


def drives_powered(view: View, stopped: TriState, why_stopped: Evidence) -> Finding:
    """Armed, and neither blocked by hardware-in-the-loop nor stopped."""
    source = f"HEARTBEAT.base_mode {view.heartbeat.base_mode}"
    if not view.armed:
        return FALSE, Evidence("disarmed", source, view.heard_at)
    if view.hil:
        return FALSE, Evidence("hardware in the loop: actuators blocked", source, view.heard_at)
    if stopped is TRUE:
        return FALSE, why_stopped._replace(rule=f"e_stopped: {why_stopped.rule}")
    if view.state == TERMINATED:
        return FALSE, beat(view, "state FLIGHT_TERMINATION")
    return TRUE, Evidence("armed", source, view.heard_at)


def motion_possible(view: View, mode: FlightMode, drives: TriState, why_drives: Evidence) -> Finding:
    """Whether a motion command would move the vehicle now. Errors and sensors have no say."""
    if drives is FALSE:
        return FALSE, why_drives._replace(rule=f"drives_powered is false: {why_drives.rule}")
    if view.state in NOT_MOVING_STATES:
        return FALSE, beat(view, "a state in which the vehicle does not move")
    if is_initialising(view.heartbeat, view.memory.stack, view.memory.family):
        return FALSE, Evidence("mode INITIALIZING", "HEARTBEAT.custom_mode", view.heard_at)
    if view.options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        return FALSE, Evidence("manual mode (manual_blocks_motion)", "HEARTBEAT.custom_mode", view.heard_at)
    if view.state == UNINIT:
        return UNKNOWN, beat(view, "state UNINIT")
    return TRUE, beat(view, "armed, not stopped, in a state that moves")
