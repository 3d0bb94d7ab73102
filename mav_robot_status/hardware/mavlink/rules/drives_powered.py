"""drives_powered and motion_possible: armed and not blocked."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....interface.status import RobotMode, TriState
from ....mavlink.enumerations import MAV_STATE_FLIGHT_TERMINATION, MAV_STATE_UNINIT
from ..armed import NOT_MOVING_STATES
from .reason import FALSE, TRUE, UNKNOWN, Finding, Reason, Source
from .simulation import actuators_blocked

if TYPE_CHECKING:
    from ..autopilots.modes import FlightMode
    from ..facts import Facts
    from ..options import HardwareOptions


def drives_powered(facts: Facts, options: HardwareOptions, stopped: TriState, why_stopped: Reason) -> Finding:
    """Armed, and neither blocked by hardware-in-the-loop nor stopped."""
    if not facts.armed:
        if hides_armed(facts):
            return UNKNOWN, Reason("a state in which the autopilot does not say whether it is armed", Source.STATE)
        if facts.fresh.arming_told and stopped is not TRUE:
            return UNKNOWN, Reason("an arming was announced, and no HEARTBEAT has arrived since", Source.BASE_MODE)
        return FALSE, Reason("disarmed", Source.BASE_MODE)
    if actuators_blocked(facts, options):
        return FALSE, Reason("hardware in the loop: actuators blocked", Source.BASE_MODE)
    if stopped is TRUE:
        return FALSE, why_stopped._replace(rule=f"e_stopped: {why_stopped.rule}")
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        return FALSE, Reason("state FLIGHT_TERMINATION", Source.STATE)
    if why_stopped.doubt:
        return UNKNOWN, why_stopped._replace(rule=f"e_stopped: {why_stopped.rule}")
    return TRUE, Reason("armed", Source.BASE_MODE)


def motion_possible(
    facts: Facts, options: HardwareOptions, mode: FlightMode, drives: TriState, why_drives: Reason
) -> Finding:
    """Whether a motion command would move the vehicle now. Errors and sensors do not matter."""
    state = facts.heartbeat.system_status
    if drives is FALSE:
        return FALSE, why_drives._replace(rule=off(why_drives.rule))
    if hides_armed(facts) or (drives is UNKNOWN and not facts.armed):
        return UNKNOWN, why_drives
    if state in NOT_MOVING_STATES:
        return FALSE, Reason("a state in which the vehicle does not move", Source.STATE)
    if is_initialising(facts):
        return FALSE, Reason("mode INITIALIZING", Source.CUSTOM_MODE)
    if options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        return FALSE, Reason("manual mode (manual_blocks_motion)", Source.CUSTOM_MODE)
    if drives is UNKNOWN:
        return UNKNOWN, why_drives
    if state == MAV_STATE_UNINIT:
        return UNKNOWN, Reason("state UNINIT", Source.STATE)
    return TRUE, Reason("armed, not stopped, in a state that moves", Source.STATE)


def off(rule: str) -> str:
    """Why motion is not possible, from the reason why its drives have no power."""
    return f"Drives are off: {'it is disarmed' if rule == 'disarmed' else rule}"


def hides_armed(facts: Facts) -> bool:
    """Whether the heartbeat lacks the armed bit in a state in which that does not mean disarmed."""
    return not facts.armed and facts.heartbeat.system_status in facts.kind.profile.states.hides_armed


def is_initialising(facts: Facts) -> bool:
    """Whether the mode shows that the vehicle is still starting."""
    starting = facts.kind.profile.modes.initialising.get(facts.kind.family)
    return starting is not None and facts.heartbeat.custom_mode == starting
