"""e_stopped: whether an emergency stop is engaged; `estop` and `outputs` say what each autopilot shows."""

from __future__ import annotations

from typing import Final

from ...interface.status import Evidence
from .. import causes, estop, motion, outputs, sensors
from ..hearing.movement import driving_speed
from ..identity import ARDUPILOT, HIL, PLANE, PX4
from ..observation import is_fresh
from .view import FALSE, TERMINATED, TRUE, UNKNOWN, Finding, View, beat

ASSUMED: Final = Evidence("not stopped when armed, and no text since (estop_assume_visible)")


def e_stopped(view: View) -> Finding:
    """Whether an emergency stop is engaged; see `estop` for what each autopilot shows."""
    stack = view.memory.stack
    if stack is PX4:
        found = _px4_stop(view)
    elif stack is ARDUPILOT:
        found = _ardupilot_stop(view)
    elif view.state == TERMINATED:
        found = TRUE, beat(view, "state FLIGHT_TERMINATION")
    else:
        found = UNKNOWN, Evidence("this autopilot does not show emergency stops")
    if found[0] is UNKNOWN and view.options.estop_unknown_as == "false":
        return FALSE, Evidence("estop_unknown_as: false")
    return found


def _px4_stop(view: View) -> Finding:
    if view.state != TERMINATED:
        stop, version = view.memory.stop, view.memory.version
        told = estop.still_said(stop, view.now)
        if told is TRUE:
            return TRUE, Evidence("the autopilot said so", stop.source, stop.last)
        if version is None or version >= estop.PX4_SHOWS:
            return FALSE, beat(view, "PX4 shows every stop as state FLIGHT_TERMINATION")
        if told is FALSE:
            return FALSE, Evidence("the autopilot said so", stop.source, stop.last)
        if _is_assumed_free(view):
            return FALSE, ASSUMED
        source = f"AUTOPILOT_VERSION {version[0]}.{version[1]}"
        return UNKNOWN, Evidence("PX4 before 1.12 shows a kill in words alone", source)
    if view.heartbeat.base_mode & HIL:
        return UNKNOWN, beat(view, "in hardware-in-the-loop older PX4 is always in lockdown")
    return TRUE, beat(view, "state FLIGHT_TERMINATION: kill, lockdown or termination")


def _ardupilot_stop(view: View) -> Finding:
    memory, now = view.memory, view.now
    stop = memory.stop
    told = estop.still_said(stop, now)
    if view.status is not None and sensors.safety_switch_on(view.status):
        return TRUE, Evidence("safety switch engaged", "SYS_STATUS: MOTOR_OUTPUTS present, not enabled", view.status_at)
    if told is TRUE:
        return TRUE, Evidence("the autopilot said so", stop.source, stop.last)
    latches = causes.lasting(memory.latches, memory.pulse, now, view.options.text_hold_s)
    if 1002 in latches and not causes.has_outlived_termination(latches, view.armed, view.heard_at):
        return TRUE, Evidence("termination announced", latches[1002].source, latches[1002].last)
    if view.state == TERMINATED:
        return TRUE, beat(view, "state FLIGHT_TERMINATION")
    watched, why = _watched(view)
    if watched is TRUE:
        return TRUE, why
    if not view.armed and view.status is not None and stop.ready >= estop.READY_MESSAGES:
        if estop.is_excused(memory.switches):
            return UNKNOWN, Evidence(
                "the pre-arm checks pass, but excuse a stop by the switch of option 165", "PARAM_VALUE: RCn_OPTION"
            )
        return FALSE, Evidence(
            "the pre-arm checks, which include the stop, pass", "SYS_STATUS: PREARM_CHECK", stop.ready_at
        )
    if told is FALSE:
        return FALSE, Evidence("the autopilot said so", stop.source, stop.last)
    if watched is FALSE:
        return FALSE, why
    if _is_assumed_free(view):
        return FALSE, ASSUMED
    return UNKNOWN, Evidence("ArduPilot does not show an emergency stop in HEARTBEAT, SYS_STATUS or texts alone")


def _is_assumed_free(view: View) -> bool:
    """Whether it was free when it was armed, at a site where every stop since would have been told."""
    return view.armed and view.options.estop_assume_visible and view.memory.assumed_free


def _watched(view: View) -> Finding:
    """The output watch and ESC telemetry of an armed vehicle."""
    memory, now = view.memory, view.now
    watch = memory.watch
    if not view.armed or not view.options.watch_outputs:
        return UNKNOWN, Evidence("the outputs are not watched")
    fresh = watch.at is not None and now <= watch.at + motion.FRESH
    turning = memory.observation.esc
    if turning is not None and is_fresh(turning, now, motion.FRESH):
        # recorded: a plane's propeller turns on after a stop; wheels turn the motors of a rover that coasts
        if memory.family is not PLANE and not (fresh and outputs.is_at_stop(watch, memory.vehicle_type)):
            return FALSE, Evidence("a motor turns", "ESC telemetry: rpm", turning.at)
        if not (fresh and watch.driven):
            return UNKNOWN, Evidence("a motor turns, perhaps without being driven", "ESC telemetry: rpm", turning.at)
    if not fresh:
        return UNKNOWN, Evidence("no fresh SERVO_OUTPUT_RAW")
    value = outputs.verdict(watch, memory.family, memory.vehicle_type, driving_speed(memory), now, memory.turning)
    motors, assumed = outputs.channels(watch, memory.vehicle_type)
    shown = ", ".join(f"{c}: {watch.values[c - 1]} us" for c in motors if c <= len(watch.values))
    source = f"SERVO_OUTPUT_RAW {shown}{' (assumed motor channels)' if assumed else ''}"
    if value is TRUE:
        return TRUE, Evidence("motor outputs held at their stop value while throttle is demanded", source, watch.at)
    if value is FALSE:
        return FALSE, Evidence("a motor output is off its stop value", source, watch.at)
    return UNKNOWN, Evidence("the outputs neither drive nor are held", source, watch.at)
