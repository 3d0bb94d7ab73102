"""A STATUS frame of simple_message as a RobotStatus with its reasons: pure functions.

A controller may send any number. What has no meaning is UNKNOWN, and so are two values that contradict each other.
By its definition, motion may be possible without drive power: a controller switches it on when it needs it.
"""

from __future__ import annotations

from typing import Final

from ...interface import Detail, ErrorCause, Evidence, Inhibit, RobotMode, RobotStatus, TriState, Vehicle
from ...simple_message import StatusFrame
from ..tcp_arm import Values

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
TRI_STATES: Final = {state.value: state for state in TriState}
MODES: Final = {mode.value: mode for mode in RobotMode}

CONTROLLER: Final = "SIMPLE_MESSAGE"
"""`vehicle.autopilot`: the frame does not say which controller it is."""
NO_CODE: Final = 8000
"""The error code of a controller that reports an error without a code."""


def status_of(frame: StatusFrame) -> RobotStatus:
    """The status that a frame proves."""
    tri = {name: TRI_STATES.get(value, UNKNOWN) for name, value in frame._asdict().items()}
    in_error, powered, stopped, possible = (
        tri[name] for name in ("in_error", "drives_powered", "e_stopped", "motion_possible")
    )
    if possible is TRUE and (powered is FALSE or stopped is TRUE):
        possible, powered = UNKNOWN, UNKNOWN if powered is FALSE else powered
        stopped = UNKNOWN if stopped is TRUE else stopped
    return RobotStatus(
        mode=MODES.get(frame.mode, RobotMode.UNKNOWN),
        e_stopped=stopped,
        drives_powered=powered,
        motion_possible=possible,
        in_motion=tri["in_motion"],
        in_error=in_error,
        error_code=(frame.error_code or NO_CODE) if in_error is TRUE else 0,
    )


def values_of(frame: StatusFrame, before: Detail, unix_us: int, at: float) -> Values:
    """The status of a robot. `before` is the previous detail; `at`: when the frame arrived, monotonic seconds."""
    status = status_of(frame)
    detail = Detail(
        errors=_errors(status, frame, before, unix_us),
        inhibits=_inhibits(status, before, unix_us),
        vehicle=Vehicle(CONTROLLER),
    )
    return Values(status, detail, {name: _evidence(name, frame, at) for name in frame._fields if name != "error_code"})


def _errors(status: RobotStatus, frame: StatusFrame, before: Detail, unix_us: int) -> tuple[ErrorCause, ...]:
    if status.in_error is not TRUE:
        return ()
    text = f"error {frame.error_code} of the controller" if frame.error_code else "an error without a code"
    known = (one.since_us for one in before.errors if one.code == status.error_code)
    return (ErrorCause(status.error_code, "CONTROLLER_ERROR", text, next(known, unix_us)),)


def _inhibits(status: RobotStatus, before: Detail, unix_us: int) -> tuple[Inhibit, ...]:
    """The reasons in the frame. A controller may have others, for which the frame has no field.

    Power that is off and a stop are named too while nobody knows whether motion is possible.
    """
    if status.motion_possible is TRUE:
        return ()
    impossible = status.motion_possible is FALSE
    named = {
        "E_STOPPED": (status.e_stopped is TRUE, "emergency stop"),
        "POWER_OFF": (status.drives_powered is FALSE, "the drives have no power"),
        "CONTROLLER_ERROR": (impossible and status.in_error is TRUE, "the controller is in error"),
    }
    found = {name: text for name, (applies, text) in named.items() if applies}
    since = {one.name: one.since_us for one in before.inhibits}
    if impossible and not found:
        found = {"MOTION_NOT_POSSIBLE": "the controller does not say why"}
    return tuple(Inhibit(name, text, since.get(name, unix_us)) for name, text in found.items())


def _evidence(name: str, frame: StatusFrame, at: float) -> Evidence:
    return Evidence("the controller reports it", f"STATUS.{name} {getattr(frame, name)}", at)
