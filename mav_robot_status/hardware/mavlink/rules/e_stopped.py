"""e_stopped: whether an emergency stop is engaged. The profile names the indications of a stop."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from ....mavlink.enumerations import MAV_STATE_FLIGHT_TERMINATION
from ..autopilots.profile import EmergencyStop
from ..causes import TERMINATION_ANNOUNCED
from ..identity import PLANE
from .reason import FALSE, TRUE, UNKNOWN, Finding, Reason, Source
from .simulation import is_simulated

if TYPE_CHECKING:
    from ....interface.status import TriState
    from ..facts import Facts
    from ..options import HardwareOptions

ASSUMED: Final = Reason("not stopped when armed, and no text since (estop_assume_visible)")
APPLET: Final = Reason("the applet on the autopilot says so", Source.APPLET)
SAID: Final = Reason("the autopilot said so", Source.STOP)
NOT_WATCHED: Final = Reason("the outputs are not watched")


def e_stopped(facts: Facts, options: HardwareOptions) -> Finding:
    """Whether an emergency stop is engaged."""
    found = RULES[facts.kind.profile.stops.shown_by](facts, options)
    if found[0] is UNKNOWN and not found[1].doubt and options.estop_unknown_as == "false":
        return FALSE, Reason("estop_unknown_as: false")
    return found


def _by_state(facts: Facts, options: HardwareOptions) -> Finding:
    """PX4. Before `shown_from` its state does not show a stop; only texts do."""
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        if is_simulated(facts):
            return UNKNOWN, Reason("in hardware-in-the-loop older PX4 is always in lockdown", Source.STATE)
        return TRUE, Reason("state FLIGHT_TERMINATION: kill, lockdown or termination", Source.STATE)
    said, version, shown_from = facts.stop.said, facts.kind.firmware, facts.kind.profile.stops.shown_from
    shows_all = version is not None and shown_from is not None and version >= shown_from
    if said is TRUE:
        if shows_all:
            return UNKNOWN, Reason(
                "a text reports a stop, and no heartbeat has shown the state since", Source.STOP, doubt=True
            )
        return TRUE, SAID
    if facts.stop.doubt is not None and not shows_all:
        return UNKNOWN, _doubt(facts.stop.doubt)
    if version is None or shows_all:
        return FALSE, Reason("PX4 shows every stop as state FLIGHT_TERMINATION", Source.STATE)
    if said is FALSE:
        return FALSE, SAID
    if _is_assumed_free(facts, options):
        return FALSE, ASSUMED
    return UNKNOWN, Reason("PX4 before 1.12 shows a kill only in texts", Source.VERSION)


def _deduced(facts: Facts, options: HardwareOptions) -> Finding:
    """ArduPilot: a stop changes neither HEARTBEAT nor, while armed, SYS_STATUS. Without evidence: UNKNOWN."""
    if _is_terminated(facts):
        return TRUE, Reason("termination announced", Source.LATCH, TERMINATION_ANNOUNCED)
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        return TRUE, Reason("state FLIGHT_TERMINATION", Source.STATE)
    applet = facts.applet
    if applet.stopped is not UNKNOWN:
        if applet.is_contradicted:
            rule = "the applet on the autopilot reports a stop, but a motor output is off its stop value"
            return UNKNOWN, Reason(rule, Source.APPLET_AND_OUTPUTS, doubt=True)
        return applet.stopped, APPLET
    if facts.fresh.sys_status and facts.sys_status.safety_switch:
        return TRUE, Reason("safety switch engaged", Source.SAFETY_SWITCH)
    if facts.stop.said is TRUE:
        return TRUE, SAID
    watched, why = _watched(facts, options)
    if watched is TRUE:
        return TRUE, why
    doubt = _doubted(facts)
    if doubt is not None:
        return UNKNOWN, doubt
    found = _released(facts, options, watched, why)
    if facts.stop_switch and found[0] is FALSE:
        # reversed channels and MAV_CMD_DO_AUX_FUNCTION can differ from the switch, so it does not prove a stop
        rule = "a switch of option 31 is in its stop position"
        return UNKNOWN, Reason(rule, Source.RC_CHANNELS, doubt=watched is not FALSE)
    return found


def _doubted(facts: Facts) -> Reason | None:
    """Why a stop may last, although there is no evidence of it any more."""
    if facts.sys_status.switch_outdated:
        rule = "the safety switch was engaged, and may have been released since"
        return Reason(rule, Source.SAFETY_SWITCH, doubt=True)
    return None if facts.stop.doubt is None else _doubt(facts.stop.doubt)


def _doubt(rule: str) -> Reason:
    return Reason(rule, Source.STOP, doubt=True)


def _released(facts: Facts, options: HardwareOptions, watched: TriState, why: Reason) -> Finding:
    """FALSE if there is evidence that no stop is engaged. `watched` and its reason `why` are what the outputs show."""
    if not facts.armed and facts.fresh.sys_status and facts.stop.is_ready:
        if facts.stop_excused:
            excused = "the pre-arm checks pass, but do not fail on a stop by the switch of option 165"
            return UNKNOWN, Reason(excused, Source.SWITCHES)
        if facts.stop.unexplained:  # a termination disarms, and no check fails on it
            return UNKNOWN, Reason("it was disarmed in motion, and frames that may tell why are lost", Source.STOP)
        return FALSE, Reason("the pre-arm checks, which include the stop, pass", Source.PREARM_CHECK)
    if facts.stop.said is FALSE:
        return FALSE, SAID
    if watched is FALSE:
        return FALSE, why
    if _is_assumed_free(facts, options):
        return FALSE, ASSUMED
    if facts.outputs.fresh and facts.outputs.idle:
        rule = "the outputs stand at their stop value while throttle is demanded, and may be motors"
        return UNKNOWN, Reason(rule, Source.OUTPUTS, doubt=True)
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
    if outputs.held and not facts.outputs_vetoed:
        return TRUE, Reason("motor outputs held at their stop value while throttle is demanded", Source.OUTPUTS)
    return UNKNOWN, Reason("the outputs neither drive nor are held", Source.OUTPUTS)
