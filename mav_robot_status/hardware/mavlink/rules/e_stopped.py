"""e_stopped: whether an emergency stop is engaged. The profile names the indications of a stop."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from ....mavlink.enumerations import MAV_STATE_FLIGHT_TERMINATION, MAV_TYPE_HELICOPTER
from ..autopilots.profile import EmergencyStop
from ..causes import TERMINATION_ANNOUNCED
from ..identity import PLANE, Family
from .reason import FALSE, TRUE, UNKNOWN, Finding, Reason, Source
from .simulation import is_simulated

if TYPE_CHECKING:
    from ..facts import Facts
    from ..options import HardwareOptions

HELD_FAMILIES: Final = frozenset({Family.COPTER, Family.ROVER})
"""The families whose outputs at their stop value prove a stop."""

ASSUMED: Final = Reason("not stopped when armed, and no text since (estop_assume_visible)")
SAID: Final = Reason("the autopilot said so", Source.STOP)
NOT_WATCHED: Final = Reason("the outputs are not watched")


def e_stopped(facts: Facts, options: HardwareOptions) -> Finding:
    """Whether an emergency stop is engaged."""
    found = RULES[facts.kind.profile.stops.shown_by](facts, options)
    if found[0] is UNKNOWN and options.estop_unknown_as == "false":
        return FALSE, Reason("estop_unknown_as: false")
    return found


def _by_state(facts: Facts, options: HardwareOptions) -> Finding:
    """PX4. Before `shown_from` its state does not show a stop; only texts do."""
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        if is_simulated(facts):
            return UNKNOWN, Reason("in hardware-in-the-loop older PX4 is always in lockdown", Source.STATE)
        return TRUE, Reason("state FLIGHT_TERMINATION: kill, lockdown or termination", Source.STATE)
    said, version, shown_from = facts.stop.said, facts.kind.firmware, facts.kind.profile.stops.shown_from
    if said is TRUE:
        return TRUE, SAID
    if version is None or shown_from is None or version >= shown_from:
        return FALSE, Reason("PX4 shows every stop as state FLIGHT_TERMINATION", Source.STATE)
    if said is FALSE:
        return FALSE, SAID
    if _is_assumed_free(facts, options):
        return FALSE, ASSUMED
    return UNKNOWN, Reason("PX4 before 1.12 shows a kill in words alone", Source.VERSION)


def _deduced(facts: Facts, options: HardwareOptions) -> Finding:
    """ArduPilot: a stop changes neither HEARTBEAT nor, while armed, SYS_STATUS. Without evidence: UNKNOWN."""
    said = facts.stop.said
    if facts.fresh.sys_status and facts.sys_status.safety_switch:
        return TRUE, Reason("safety switch engaged", Source.SAFETY_SWITCH)
    if said is TRUE:
        return TRUE, SAID
    if _is_terminated(facts):
        return TRUE, Reason("termination announced", Source.LATCH, TERMINATION_ANNOUNCED)
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        return TRUE, Reason("state FLIGHT_TERMINATION", Source.STATE)
    watched, why = _watched(facts, options)
    if watched is TRUE:
        return TRUE, why
    if not facts.armed and facts.fresh.sys_status and facts.stop.is_ready:
        if facts.stop_excused:
            excused = "the pre-arm checks pass, but excuse a stop by the switch of option 165"
            return UNKNOWN, Reason(excused, Source.SWITCHES)
        return FALSE, Reason("the pre-arm checks, which include the stop, pass", Source.PREARM_CHECK)
    if said is FALSE:
        return FALSE, SAID
    if watched is FALSE:
        return FALSE, why
    if _is_assumed_free(facts, options):
        return FALSE, ASSUMED
    return UNKNOWN, Reason("ArduPilot does not show an emergency stop in HEARTBEAT, SYS_STATUS or texts alone")


def _termination_only(facts: Facts, options: HardwareOptions) -> Finding:
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        return TRUE, Reason("state FLIGHT_TERMINATION", Source.STATE)
    return UNKNOWN, Reason("this autopilot does not show emergency stops")


RULES: Final[dict[EmergencyStop, Callable[[Facts, HardwareOptions], Finding]]] = {
    EmergencyStop.STATE: _by_state,
    EmergencyStop.DEDUCED: _deduced,
    EmergencyStop.TERMINATION_ONLY: _termination_only,
}
assert set(RULES) == set(EmergencyStop)


def _is_terminated(facts: Facts) -> bool:
    """Whether a termination was announced that is not a landing under power."""
    announced = any(cause.code == TERMINATION_ANNOUNCED for cause in facts.latched.causes)
    return announced and not facts.latched.termination_outlived


def _is_assumed_free(facts: Facts, options: HardwareOptions) -> bool:
    """Whether no stop was engaged at arming, at a site where every later stop would have been reported."""
    return facts.armed and options.estop_assume_visible and facts.assumed_free


def _watched(facts: Facts, options: HardwareOptions) -> Finding:
    """The output watch and ESC telemetry of an armed vehicle."""
    outputs = facts.outputs
    if not facts.armed or not options.watch_outputs:
        return UNKNOWN, NOT_WATCHED
    if facts.esc_turning:
        # recorded: a plane's propeller keeps turning after a stop; the wheels of a coasting rover turn its motors
        if facts.kind.family is not PLANE and not (outputs.fresh and outputs.at_stop):
            return FALSE, Reason("a motor turns", Source.ESC)
        if not (outputs.fresh and outputs.driven):
            return UNKNOWN, Reason("a motor turns, perhaps without being driven", Source.ESC)
    if not outputs.fresh:
        return UNKNOWN, Reason("no fresh SERVO_OUTPUT_RAW")
    if outputs.driven:
        return FALSE, Reason("a motor output is off its stop value", Source.OUTPUTS)
    if outputs.held and not facts.outputs_vetoed and proves_stop(facts.kind.family, facts.kind.vehicle_type):
        return TRUE, Reason("motor outputs held at their stop value while throttle is demanded", Source.OUTPUTS)
    return UNKNOWN, Reason("the outputs neither drive nor are held", Source.OUTPUTS)


def proves_stop(family: Family, vehicle_type: int) -> bool:
    """Whether held outputs prove a stop of this kind of vehicle."""
    return family in HELD_FAMILIES and vehicle_type != MAV_TYPE_HELICOPTER
