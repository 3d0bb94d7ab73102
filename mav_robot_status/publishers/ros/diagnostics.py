"""A status as a DiagnosticStatus: its level, its headline, and each field, inhibit and error as a text. Pure functions.

Levels follow diagnostic_msgs/msg/DiagnosticStatus. rqt_robot_monitor, Foxglove and diagnostic_aggregator show them.
"""

from __future__ import annotations

from enum import IntEnum
from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface import FIELDS, LinkState, TriState

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ...interface import Detail, ErrorCause, Inhibit, RobotStatus, RobotStatusMsg

    Test = Callable[[RobotStatus, Detail], object]

NODE: Final = "mav_robot_status"
"""The name of our node. By convention the name of a DiagnosticStatus starts with it."""


class Level(IntEnum):
    """DiagnosticStatus.level."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


class DiagnosticStatus(NamedTuple):
    """diagnostic_msgs/msg/DiagnosticStatus."""

    level: Level
    name: str
    message: str
    hardware_id: str
    values: tuple[tuple[str, str], ...]


def _lost(status: RobotStatus, detail: Detail) -> bool:
    return detail.link is not LinkState.CONNECTED


PARKED: Final = frozenset({"DISARMED", "POWER_OFF", "BRAKES_ENGAGED"})
"""The inhibits of a robot that nobody wants to move."""


def _doubtful(status: RobotStatus, detail: Detail) -> bool:
    """Whether a person should look. That nobody knows of an emergency stop is no reason: few robots report it."""
    if TriState.UNKNOWN in (status.motion_possible, status.drives_powered) or detail.ready is False:
        return True
    if status.motion_possible is TriState.TRUE:
        return False
    parked = {inhibit.name for inhibit in detail.inhibits} <= PARKED and bool(detail.inhibits)
    return not parked or detail.vehicle.can_arm is False


LEVELS: Final[tuple[tuple[Test, Level], ...]] = (
    (_lost, Level.STALE),
    (lambda status, detail: TriState.TRUE in (status.e_stopped, status.in_error), Level.ERROR),
    (_doubtful, Level.WARN),
    (lambda status, detail: True, Level.OK),
)
"""The first that applies."""


def _is_stopped(status: RobotStatus, detail: Detail) -> bool:
    """Of a group, whether every member is."""
    return status.e_stopped is TriState.TRUE and (
        not detail.members or {one.handle for one in detail.not_ready if one.why == "E_STOPPED"} == set(detail.members)
    )


HEADLINES: Final[tuple[tuple[Test, str], ...]] = (
    (lambda status, detail: detail.link is LinkState.NEVER_SEEN, "NEVER SEEN"),
    (_lost, "NO LINK: its state is unknown, it may move"),
    (lambda status, detail: status.in_motion is TriState.TRUE, "MOVING"),
    (_is_stopped, "EMERGENCY STOP"),
    (lambda status, detail: status.motion_possible is TriState.TRUE, "MOTION POSSIBLE"),
    (lambda status, detail: status.motion_possible is TriState.FALSE, "MOTION NOT POSSIBLE"),
    (lambda status, detail: True, "UNKNOWN: it may move"),
)
"""The first that applies. What moves is never called stopped."""


def level(status: RobotStatus, detail: Detail) -> Level:
    """How much a person should care."""
    return next(level for applies, level in LEVELS if applies(status, detail))


def headline(status: RobotStatus, detail: Detail) -> str:
    """The status in one line, with its first reason: an error, or what inhibits the motion of a robot at rest."""
    words = next(words for applies, words in HEADLINES if applies(status, detail))
    reasons: tuple[ErrorCause | Inhibit, ...] = () if _lost(status, detail) else detail.errors
    if not (reasons or _lost(status, detail) or status.in_motion is TriState.TRUE):
        reasons = detail.inhibits
    told = f"{words}: {reason_of(reasons[0])}" if reasons else words
    others = ", ".join(f"{one.handle} ({one.why})" for one in detail.not_ready)
    return f"{told}; not ready: {others}" if others and not _lost(status, detail) else told


def diagnostic_status(msg: RobotStatusMsg) -> DiagnosticStatus:
    """The whole status of one handle."""
    name = f"{NODE}: {msg.handle}"
    words = headline(msg.status, msg.detail)
    return DiagnosticStatus(level(msg.status, msg.detail), name, words, msg.handle, tuple(_values(msg)))


def _values(msg: RobotStatusMsg) -> Iterator[tuple[str, str]]:
    for field in FIELDS:
        yield field.name, field.word(getattr(msg.status, field.name))
    for error in msg.detail.errors:
        yield f"error {error.code}", reason_of(error)
    for inhibit in msg.detail.inhibits:
        yield f"inhibit {reason_of(inhibit._replace(text=None))}", inhibit.text or ""
    for one in msg.detail.not_ready:
        yield f"not ready {one.handle}", one.why
    yield "link", msg.detail.link.value
    for name, value in msg.detail.vehicle._asdict().items():
        if value is not None:
            yield name, str(value)


def reason_of(reason: ErrorCause | Inhibit) -> str:
    """Its name, with the member of a group in front, and the words of the robot behind."""
    name = reason.name if reason.handle is None else f"{reason.handle}: {reason.name}"
    return f"{name} ({reason.text})" if reason.text else name
