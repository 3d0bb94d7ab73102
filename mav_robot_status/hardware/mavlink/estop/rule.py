"""e_stopped: whether an emergency stop is engaged. The profile names the indications of a stop."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ....mavlink.enumerations import MAV_STATE_FLIGHT_TERMINATION
from ..autopilots.profile import EmergencyStop
from ..facts import Applet, MotorTest, Outputs, Stop
from ..faults.causes import TERMINATION_ANNOUNCED
from ..faults.rule import latch_words
from ..faults.sensors import safety_switch_on
from ..heartbeat.rule import UNEXPLAINED, is_simulated, state_words
from ..identity import PLANE
from ..motion.estimate import hud_speeds
from ..reason import FALSE, TRUE, UNKNOWN, Finding, Reason, words
from ..reason import at as latest_at
from ..state import FRESH, honours_stop, vtol_state
from . import applet as applets
from . import motor_test as tests
from . import outputs
from . import state as estop

if TYPE_CHECKING:
    from ....interface.status import TriState
    from ..facts import Deadline, Facts
    from ..options import HardwareOptions
    from ..reason import Reason, Shown
    from ..state import VehicleState

# -- facts -------------------------------------------------------------------------------------------------------------


NO_OUTPUTS: Final = Outputs(False, False, False, False, False)
NOTHING_SAID: Final = Stop(UNKNOWN, None, False, None, False)
NO_APPLET: Final = Applet(UNKNOWN, False, False)


def motor_outputs(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Outputs:
    """The state of the motor outputs of an armed vehicle."""
    watch = state.watch
    if watch.at is None or not state.heartbeats.armed:
        return NO_OUTPUTS
    proves = outputs.proves_stop(state.family, state.vehicle_type, vtol_state(state))
    at_stop = state.latest.esc is not None and outputs.is_at_stop(watch, state.vehicle_type)
    fresh = deadline.is_within(watch.at + FRESH)
    return Outputs(fresh, watch.driven, watch.held and proves, at_stop, watch.idle and proves)


NO_TEST: Final = MotorTest(False, False)


def motor_test(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> MotorTest:
    """Whether a motor turns although the vehicle is disarmed."""
    test, latest = state.test, state.latest
    if state.heartbeats.armed or _is_held(state, deadline):
        return NO_TEST
    if deadline.is_within(test.turned_at + tests.LASTS):
        return MotorTest(True, True)
    driven = deadline.is_within(test.driven_at + tests.LASTS) and test.driven_at > test.stopped_at
    stands = deadline.is_within(test.stopped_at + FRESH)
    said = deadline.is_within(test.until) and not (stands and test.stopped_at > test.said_at + tests.LASTS)
    coasts = not deadline.has_come(state.heartbeats.edge.mono + tests.COASTS)
    rpm = deadline.is_fresh(latest.esc, FRESH) and not stands and not coasts
    return MotorTest(False, driven or said or rpm)


def _is_held(state: VehicleState, deadline: Deadline) -> bool:
    """Whether a fresh SYS_STATUS says that the safety switch holds the outputs."""
    heard = state.latest.sys_status
    return (
        heard is not None
        and deadline.is_fresh(heard, FRESH)
        and state.profile.sensors.has_safety_switch
        and safety_switch_on(heard.message)
    )


def outputs_vetoed(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether a motion shows that the vehicle is driven although the outputs seem held."""
    watch = state.watch
    if watch.held_since is None:
        return False
    speed, climb = hud_speeds(state.latest)
    turning = state.turning if deadline.is_fresh(state.latest.attitude, FRESH) else math.inf
    return outputs.is_vetoed(watch, state.family, state.vehicle_type, speed, climb, turning)


def esc_turning(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether ESC telemetry shows a motor that turns."""
    return deadline.is_fresh(state.latest.esc, FRESH)


def stop(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Stop:
    """What the autopilot has reported about an emergency stop."""
    said, word, doubt = state.stop, state.applet, state.stop.doubt
    if (
        word is not None
        and applets.stops(word, honours_stop(state))
        and not deadline.is_within(word.at + applets.FRESH)
    ):
        doubt = doubt or estop.APPLET_SILENT
    elif said is estop.NOTHING and not state.unexplained:
        return NOTHING_SAID
    is_over = said.repeats and deadline.has_come(said.last + estop.REPEATED)
    if said.lost_at is not None and deadline.has_come(said.lost_at + estop.OUTLASTS_LOSS):
        is_over = True
        doubt = doubt or (estop.FRAMES_LOST if said.said is TRUE else None)
    value = UNKNOWN if is_over else said.said
    return Stop(value, said.text, said.ready >= estop.READY_MESSAGES, doubt, state.unexplained)


def applet(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Applet:
    """The word of the applet on the autopilot."""
    word = state.applet
    if word is None or not deadline.is_within(word.at + applets.FRESH):
        return NO_APPLET
    if not applets.stops(word, honours_stop(state)):
        return Applet(UNKNOWN if word.value else FALSE, False, True)
    since, watched_at = word.driven_since, state.watch.at
    driven = since is not None and watched_at is not None and deadline.is_within(watched_at + FRESH)
    return Applet(TRUE, driven and deadline.has_come((since or 0.0) + applets.CONTRADICTED), True)


def stop_switch(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether an RC switch that stops the motors is in its stop position."""
    return deadline.is_within(state.stop_switch_at + FRESH)


def stop_excused(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether a switch exists whose stop the pre-arm checks ignore."""
    return estop.is_excused(state.switches)


def assumed_free(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether no stop was engaged when it was armed."""
    return state.assumed_free


# -- evidence in words -------------------------------------------------------------------------------------------------


def motor_test_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The pulses of the motors that stand at another value while no test runs, else what said that a test runs."""
    test, watch = state.test, state.watch
    if test.driven_at > max(test.said_at, test.stopped_at) or facts.motor_test.turns:
        shown = ", ".join(f"{c}: {watch.values[c - 1]} us" for c in test.stop if c <= len(watch.values))
        return f"SERVO_OUTPUT_RAW {shown}", test.driven_at
    if test.source is not None and test.said_at > (latest_at(state.latest.esc) or -math.inf):
        return test.source, test.said_at
    return esc_words(state, facts, reason)


def stop_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """What was said of a stop."""
    return state.stop.source, state.stop.last


safety_switch_words: Final = words("SYS_STATUS: MOTOR_OUTPUTS present, not enabled", "sys_status")


def prearm_check_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The pre-arm checks that passed."""
    return "SYS_STATUS: PREARM_CHECK", state.stop.ready_at


def version_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """Where the version is from."""
    told = state.firmware
    return (None, None) if told is None else (told.source, told.at)


def switches_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The functions of the switches."""
    return "PARAM_VALUE: RCn_OPTION", None


def rc_channels_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The position of a switch."""
    return "RC_CHANNELS, PARAM_VALUE: RCn_OPTION", state.stop_switch_at


def applet_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The word of the applet."""
    word = state.applet
    return (None, None) if word is None else (f"NAMED_VALUE_FLOAT RS_STOP {word.value}", word.at)


def applet_and_outputs_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The word of the applet against the outputs."""
    (word, _), (values, heard_at) = applet_words(state, facts, reason), outputs_words(state, facts, reason)
    return f"{word}; {values}", heard_at


esc_words: Final = words("ESC telemetry: rpm", "esc")


def outputs_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The pulses of the motors."""
    watch = state.watch
    motors, assumed = outputs.channels(watch, state.vehicle_type)
    shown = ", ".join(f"{c}: {watch.values[c - 1]} us" for c in motors if c <= len(watch.values))
    return f"SERVO_OUTPUT_RAW {shown}{' (assumed motor channels)' if assumed else ''}", watch.at


# -- the rule ----------------------------------------------------------------------------------------------------------


ASSUMED: Final = Reason("not stopped when armed, and no text since (estop_assume_visible)")
NEWER_KILL: Final = frozenset({"Kill engaged"})
"""The words for a kill of PX4 versions that show it in their state, too (Commander.cpp, 1.17)."""
APPLET: Final = Reason("the applet on the autopilot says so", applet_words)
SAID: Final = Reason("the autopilot said so", stop_words)
NOT_WATCHED: Final = Reason("the outputs are not watched")


def e_stopped(facts: Facts, options: HardwareOptions) -> Finding:
    """Whether an emergency stop is engaged."""
    found = RULES[facts.kind.profile.stops.shown_by](facts, options)
    if found[0] is TRUE and facts.motor_test.may_turn:  # a stop does not end a motor test
        turns = "turns" if facts.motor_test.turns else "may turn"
        return UNKNOWN, Reason(f"a stop is reported, but a motor {turns}", motor_test_words, doubt=True)
    if found[0] is UNKNOWN and not found[1].doubt and options.estop_unknown_as == "false":
        return FALSE, Reason("estop_unknown_as: false")
    return found


def _by_state(facts: Facts, options: HardwareOptions) -> Finding:
    """PX4. Before `shown_from` its state does not show a stop; only texts do."""
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        if is_simulated(facts):
            return UNKNOWN, Reason("in hardware-in-the-loop older PX4 is always in lockdown", state_words)
        return TRUE, Reason("state FLIGHT_TERMINATION: kill, lockdown or termination", state_words)
    said, version, shown_from = facts.stop.said, facts.kind.firmware, facts.kind.profile.stops.shown_from
    shows_all = version is not None and shown_from is not None and version >= shown_from
    if said is TRUE:
        if shows_all or facts.stop.text in NEWER_KILL:
            return UNKNOWN, Reason(
                "a text reports a stop, and no heartbeat has shown the state since", stop_words, doubt=True
            )
        return TRUE, SAID
    if facts.stop.doubt is not None and not shows_all:
        return UNKNOWN, _doubt(facts.stop.doubt)
    if version is None or shows_all:
        return FALSE, Reason("PX4 shows every stop as state FLIGHT_TERMINATION", state_words)
    if said is FALSE:
        return FALSE, SAID
    if _is_assumed_free(facts, options):
        return FALSE, ASSUMED
    return UNKNOWN, Reason("PX4 before 1.12 shows a kill only in texts", version_words)


def _deduced(facts: Facts, options: HardwareOptions) -> Finding:
    """ArduPilot: a stop changes neither HEARTBEAT nor, while armed, SYS_STATUS. Without evidence: UNKNOWN."""
    if _is_terminated(facts):
        return TRUE, Reason("termination announced", latch_words, TERMINATION_ANNOUNCED)
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        return TRUE, Reason("state FLIGHT_TERMINATION", state_words)
    applet = facts.applet
    if applet.stopped is not UNKNOWN:
        if applet.is_contradicted:
            rule = "the applet on the autopilot reports a stop, but a motor output is off its stop value"
            return UNKNOWN, Reason(rule, applet_and_outputs_words, doubt=True)
        return applet.stopped, APPLET
    if facts.fresh.sys_status and facts.sys_status.safety_switch:
        return TRUE, Reason("safety switch engaged", safety_switch_words)
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
        return UNKNOWN, Reason(rule, rc_channels_words, doubt=watched is not FALSE)
    return found


def _doubted(facts: Facts) -> Reason | None:
    """Why a stop may last, although there is no evidence of it any more."""
    if facts.sys_status.switch_outdated:
        rule = "the safety switch was engaged, and may have been released since"
        return Reason(rule, safety_switch_words, doubt=True)
    return None if facts.stop.doubt is None else _doubt(facts.stop.doubt)


def _doubt(rule: str) -> Reason:
    return Reason(rule, stop_words, doubt=True)


def _released(facts: Facts, options: HardwareOptions, watched: TriState, why: Reason) -> Finding:
    """FALSE if there is evidence that no stop is engaged. `watched` and its reason `why` are what the outputs show."""
    if not facts.armed and facts.fresh.sys_status and facts.stop.is_ready and not facts.motor_test.may_turn:
        if facts.stop_excused:
            excused = "the pre-arm checks pass, but do not fail on a stop by the switch of option 165"
            return UNKNOWN, Reason(excused, switches_words)
        if facts.stop.unexplained:  # a termination disarms, and no check fails on it
            return UNKNOWN, UNEXPLAINED
        return FALSE, Reason("the pre-arm checks, which include the stop, pass", prearm_check_words)
    if facts.stop.said is FALSE:
        return FALSE, SAID
    if watched is FALSE:
        return FALSE, why
    if _is_assumed_free(facts, options):
        return FALSE, ASSUMED
    if facts.outputs.fresh and facts.outputs.idle:
        rule = "the outputs stand at their stop value while throttle is demanded, and may be motors"
        return UNKNOWN, Reason(rule, outputs_words, doubt=True)
    return UNKNOWN, Reason("ArduPilot does not show an emergency stop in HEARTBEAT, SYS_STATUS or texts alone")


def _termination_only(facts: Facts, options: HardwareOptions) -> Finding:
    if facts.heartbeat.system_status == MAV_STATE_FLIGHT_TERMINATION:
        return TRUE, Reason("state FLIGHT_TERMINATION", state_words)
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
            return FALSE, Reason("a motor turns", esc_words)
        if not (outputs.fresh and outputs.driven):
            return UNKNOWN, Reason("a motor turns, perhaps without being driven", esc_words)
    if not outputs.fresh:
        return UNKNOWN, Reason("no fresh SERVO_OUTPUT_RAW")
    if outputs.driven:
        return FALSE, Reason("a motor output is off its stop value", outputs_words)
    if outputs.held and not facts.outputs_vetoed:
        return TRUE, Reason("motor outputs held at their stop value while throttle is demanded", outputs_words)
    return UNKNOWN, Reason("the outputs neither drive nor are held", outputs_words)
