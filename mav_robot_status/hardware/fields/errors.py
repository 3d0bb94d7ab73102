"""in_error and error_code: every active cause, from texts, counters, sensor bits and the state."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface.status import Evidence
from ...mavlink.definitions import STATE_NAMES
from .. import causes, sensors
from ..boot import GRACE
from ..identity import HIL
from .view import CRITICAL, EMERGENCY, FALSE, TERMINATED, TRUE, UNKNOWN, Finding, View, named, sensor_name

if TYPE_CHECKING:
    from ...interface.status import ErrorCause

TOGETHER: Final = 5.0  # s between a loss and a failsafe that it explains


class Error(NamedTuple):
    """An active cause with its place in the order, and what showed it."""

    cause: ErrorCause
    priority: int
    source: str
    at: float


def active_errors(view: View) -> list[Error]:
    """Every active cause, the most important first."""
    found = {error.cause.code: error for error in (*_announced(view), *_counted(view), *_faulty(view))}
    for error in _of_state(view, found.keys()):
        found.setdefault(error.cause.code, error)
    return sorted(found.values(), key=lambda error: error.priority)


def _error(code: int, text: str | None, since_us: int, source: str, at: float, later: int = 0) -> Error:
    return Error(causes.error(code, text, since_us), causes.CAUSES[code].priority + later, source, at)


def _announced(view: View) -> Iterator[Error]:
    memory = view.memory
    latches = causes.lasting(memory.latches, memory.pulse, view.now, view.options.text_hold_s)
    for code, latch in latches.items():
        yield _error(code, latch.text, latch.since.unix_us, latch.source, latch.last)


def _counted(view: View) -> Iterator[Error]:
    since = view.memory.internal_errors_since
    if since is not None and view.status is not None and view.status_at is not None:
        count = view.status.errors_count1 | view.status.errors_count2 << 16
        yield _error(5001, None, since.unix_us, f"SYS_STATUS.errors_count 0x{count:x}", view.status_at)


def _faulty(view: View) -> Iterator[Error]:
    memory = view.memory
    if not memory.faults or view.status_at is None or view.now < memory.boot.at + GRACE:
        return
    for bit, weight, fault in sensors.standing(memory.faults, memory.stack, view.armed, view.now):
        name = sensor_name(bit)
        if name not in view.options.ignore_sensors:
            code = 3000 + bit if bit < 32 else 3100 + bit - 32
            later = causes.SOFT_AFTER if weight is sensors.SOFT else 0
            source = f"SYS_STATUS: {name} enabled, unhealthy"
            yield _error(code, None, fault.since.unix_us, source, view.status_at, later)


def _of_state(view: View, found: Collection[int]) -> Iterator[Error]:
    """What HEARTBEAT.system_status says, where nothing else has named it."""
    memory = view.memory
    words = memory.failsafe.text if memory.failsafe is not None else None
    since = memory.pulse.state_since.unix_us
    source = f"HEARTBEAT.system_status {named(STATE_NAMES, view.state)}"
    if view.state == TERMINATED and not view.heartbeat.base_mode & HIL:
        yield _error(1001, words, since, source, view.heard_at)
    if view.state == EMERGENCY and not causes.NAMED_EMERGENCIES.intersection(found):
        yield _error(4000, words, since, source, view.heard_at)
    if view.state == CRITICAL and not causes.NAMED_FAILSAFES.intersection(found):
        rc_lost = memory.rc_lost_since
        if rc_lost is not None and abs(rc_lost.mono - memory.pulse.state_since.mono) <= TOGETHER:
            source = f"{source}, as SYS_STATUS: RC_RECEIVER turned unhealthy"
            yield _error(2001, words, since, source, view.heard_at)
        else:
            yield _error(2000, words, since, source, view.heard_at)


def in_error(view: View, errors: list[Error]) -> Finding:
    """TRUE with any cause; FALSE only while SYS_STATUS is there to show one."""
    if errors:
        first = errors[0]
        return TRUE, Evidence(f"{first.cause.code} {first.cause.name}", first.source, first.at)
    if view.status is None:
        return UNKNOWN, Evidence("no fresh SYS_STATUS")
    return FALSE, Evidence("no cause is active", "SYS_STATUS", view.status_at)
