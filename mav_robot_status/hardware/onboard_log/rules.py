"""The status of a robot by what its onboard log has said: one pure function for each field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface import ErrorCause, Inhibit, RobotMode, RobotStatus
from ..mavlink.faults import causes
from ..mavlink.motion import state as motion
from .state import FALSE, TRUE, UNKNOWN, Told

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from ...clock import Instant
    from ...interface import Evidence
    from ..mavlink.options import HardwareOptions
    from .state import LogState


SPOOL: Final = 0.5
"""Seconds that motors need to stop."""
DRIFT: Final = 3.0
"""The estimate of a copter on the ground may show a smaller speed, m/s. PX4 says landed while a disarmed one falls."""


class Found(NamedTuple):
    """The status with its reasons."""

    status: RobotStatus
    errors: tuple[ErrorCause, ...]
    inhibits: tuple[tuple[str, str | None], ...]
    """Names and texts."""
    evidence: Mapping[str, Evidence]


def derive(state: LogState, options: HardwareOptions, now: Instant) -> Found:
    """The status at `now`."""
    errors = active_errors(state)
    stop = e_stopped(state, options)
    drives = drives_powered(state, stop, options)
    told = {
        "e_stopped": stop,
        "drives_powered": drives,
        "motion_possible": motion_possible(state, drives, options),
        "in_motion": in_motion(state, options, now.mono),
        "in_error": in_error(state, errors),
    }
    mode = state.mode
    status = RobotStatus(
        mode=mode.mode, error_code=errors[0].code if errors else 0, **{name: one.value for name, one in told.items()}
    )
    evidence = {name: one.evidence() for name, one in told.items()}
    evidence["mode"] = evidence["flight_mode"] = Told(UNKNOWN, mode.why, mode.source, mode.at).evidence()
    evidence["armed"] = state.armed.evidence()
    inhibits = () if status.motion_possible is TRUE else tuple(_inhibits(state, status, options))
    if status.motion_possible is UNKNOWN:
        inhibits = (("LOG_GAP", drives.rule), *inhibits)
    return Found(status, errors, inhibits, evidence)


def e_stopped(state: LogState, options: HardwareOptions) -> Told:
    """As the log says. An armed robot whose motors are driven all the same is not called stopped."""
    stop = state.stop
    if stop.value is UNKNOWN and options.estop_unknown_as == "false":
        return Told(FALSE, "estop_unknown_as: false")
    if stop.value is TRUE and state.armed.value is TRUE and _is_driven(state):
        return stop._replace(value=UNKNOWN, rule=f"{stop.rule}, but {state.driven.rule}")
    return stop


def _is_driven(state: LogState) -> bool:
    """Whether a motor is driven; after a stop of an armed robot only if it is for longer than motors need to stop."""
    if state.driven.value is not TRUE:
        return state.live and state.armed.value is FALSE and state.stop.value is not TRUE
    is_test = state.testing or (state.armed.value is FALSE and state.armed.at < state.stop.at)
    return state.stop.value is not TRUE or is_test or state.outputs_at >= state.stop.at + SPOOL


def drives_powered(state: LogState, stop: Told, options: HardwareOptions) -> Told:
    """Armed and not held; or a motor output is driven, as in a motor test."""
    if state.hil and not options.treat_hil_as_live:
        return Told(FALSE, "hardware in the loop: actuators blocked", "vehicle_status.hil_state", state.mode.at)
    if _is_driven(state) and (state.armed.value is not TRUE or state.stop.value is TRUE):
        by_outputs = state.driven.value is TRUE
        found = state.driven if by_outputs else Told(TRUE, "its status says armed", "STAT.Armed", state.outputs_at)
        return found._replace(rule=f"{state.armed.rule}, but {found.rule}")
    if state.armed.value is FALSE:
        return state.armed
    if stop.value is TRUE:
        return stop._replace(value=FALSE)
    if state.armed.value is UNKNOWN:
        return state.armed
    if state.safety.value is TRUE:
        return state.safety._replace(value=FALSE)
    return state.armed


def motion_possible(state: LogState, drives: Told, options: HardwareOptions) -> Told:
    """With power, in a mode in which it moves."""
    if drives.value is not TRUE:
        return drives
    if state.initialising:
        return Told(FALSE, "mode INITIALIZING", state.mode.source, state.mode.at)
    if options.manual_blocks_motion and state.mode.mode is RobotMode.MANUAL:
        return Told(FALSE, "manual mode (manual_blocks_motion)", state.mode.source, state.mode.at)
    return drives


def in_motion(state: LogState, options: HardwareOptions, now: float) -> Told:
    """Airborne, or moving or turning by measurement."""
    flies = state.armed.value is TRUE and state.aircraft and state.landed.value is FALSE
    measured = motion.settled(state.motion, now)
    source, at = state.motion_from, state.motion.at
    if flies and options.hover_is_motion:
        return Told(TRUE, "airborne", state.landed.source, state.landed.at)
    if state.motion.speed is None or now - at > motion.GAP:
        measured = UNKNOWN
    if state.armed.value is not TRUE and state.rests.value is TRUE and measured is not FALSE:
        return state.rests._replace(value=FALSE)
    on_ground = state.aircraft and state.landed.value is TRUE
    slow = (state.motion.speed or 0.0) < DRIFT
    if measured is TRUE and on_ground and slow and state.family == "copter":  # a plane rolls on the ground
        return Told(UNKNOWN, "landed, but the estimate moves", source, at)
    if measured is FALSE and state.armed.value is TRUE and state.aircraft and not on_ground:
        return Told(UNKNOWN, "armed, and nothing shows whether it is airborne", source, at)
    if measured is UNKNOWN:
        return Told(UNKNOWN, "no speed that counts", source, at)
    return Told(measured, f"speed and rotation, with hysteresis: {state.motion.speed or 0.0:.1f} m/s", source, at)


def active_errors(state: LogState) -> tuple[ErrorCause, ...]:
    """Every active cause, the most important first."""
    codes = sorted(state.active, key=lambda code: causes.CAUSES[code].priority)
    return tuple(causes.error(code, state.active[code].text, state.active[code].since_us) for code in codes)


def in_error(state: LogState, errors: tuple[ErrorCause, ...]) -> Told:
    """TRUE with any cause; FALSE only if the log holds the records that would show one."""
    if errors:
        first = errors[0]
        at = state.active[first.code].at
        return Told(TRUE, f"{first.code} {first.name}", first.text and f"“{first.text}”", at)
    if not state.shows_errors:
        return Told(UNKNOWN, "the log does not hold the records that show errors")
    return Told(FALSE, "no cause is active")


def _inhibits(state: LogState, status: RobotStatus, options: HardwareOptions) -> Iterator[tuple[str, str | None]]:
    """Every reason why motion is not possible."""
    if state.armed.value is FALSE and not _is_driven(state):
        yield "DISARMED", None
    if status.e_stopped is TRUE:
        yield "E_STOPPED", state.stop.rule.strip("“”") if state.stop.rule.startswith("“") else None
    if state.safety.value is TRUE:
        yield "SAFETY_SWITCH", None
    if state.armed.value is not TRUE:
        yield from (("PREARM_FAILING", text) for text in state.reasons)
        if state.ready.value is FALSE and not state.reasons:
            yield "PREARM_FAILING", None
    if state.initialising:
        yield "INITIALISING", None
    if state.terminated is not None:
        yield "TERMINATION", state.terminated
    if state.hil and not options.treat_hil_as_live:
        yield "HIL", None
    if options.manual_blocks_motion and status.mode is RobotMode.MANUAL:
        yield "MODE_MANUAL", None


def can_arm(state: LogState) -> bool | None:
    """Whether its checks pass, as far as it says so."""
    if state.ready.value is not UNKNOWN:
        return state.ready.value is TRUE
    return False if state.reasons and state.armed.value is not TRUE else None


def as_inhibits(
    names: tuple[tuple[str, str | None], ...], before: tuple[Inhibit, ...], unix_us: int
) -> tuple[Inhibit, ...]:
    """The inhibits with the times since which they are active."""
    since = {(one.name, one.text): one.since_us for one in before}
    return tuple(Inhibit(name, text, since.get((name, text), unix_us)) for name, text in names)
