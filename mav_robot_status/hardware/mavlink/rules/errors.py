"""in_error and error_code: every active cause, from texts, counters, sensor bits and the state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import ErrorCause
from ....mavlink.enumerations import MAV_STATE_CRITICAL, MAV_STATE_EMERGENCY, MAV_STATE_FLIGHT_TERMINATION
from .. import causes
from .reason import FALSE, TRUE, UNKNOWN, Finding, Reason, Source
from .simulation import is_simulated

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from ..facts import Facts


class Error(NamedTuple):
    """An active cause with its priority and its source."""

    cause: ErrorCause
    priority: int
    source: Source


def active_errors(facts: Facts) -> list[Error]:
    """Every active cause, the most important first."""
    every = (*_of_parts(facts), *_announced(facts), *_counted(facts), *_faulty(facts))
    found = {error.cause.code: error for error in every}
    for error in _of_state(facts, found.keys()):
        found.setdefault(error.cause.code, error)
    return sorted(found.values(), key=lambda error: error.priority)


def _error(code: int, text: str | None, since_us: int, source: Source, later: int = 0) -> Error:
    return Error(causes.error(code, text, since_us), causes.CAUSES[code].priority + later, source)


def _announced(facts: Facts) -> Iterator[Error]:
    if facts.claimed.conflict_since is not None:
        yield _error(causes.SYSTEM_ID_CONFLICT, None, facts.claimed.conflict_since, Source.CLAIMS)
    for code, text, since_us in facts.latched.causes:
        yield _error(code, text, since_us, Source.LATCH)
    if facts.seldom is not None:
        for code, text, since_us in facts.seldom.failures:
            yield _error(code, text, since_us, Source.HIGH_LATENCY)


def _of_parts(facts: Facts) -> Iterator[Error]:
    """The causes that parts report. The autopilot's own text about the same cause is preferred."""
    for code, text, since_us in facts.parts.faults:
        yield _error(code, text, since_us, Source.PARTS)


def _counted(facts: Facts) -> Iterator[Error]:
    since = facts.sys_status.internal_errors_since
    if since is not None and facts.fresh.sys_status:
        yield _error(causes.INTERNAL_ERROR, None, since, Source.INTERNAL_ERRORS)


def _faulty(facts: Facts) -> Iterator[Error]:
    if not facts.fresh.sys_status:
        return
    for bit, is_soft, since_us in facts.faults:
        later = causes.SOFT_AFTER if is_soft else 0
        yield _error(causes.of_sensor(bit), None, since_us, Source.SENSOR, later)


def _of_state(facts: Facts, found: Collection[int]) -> Iterator[Error]:
    """The causes from HEARTBEAT.system_status, unless a specific cause is active."""
    state, words, since = facts.heartbeat.system_status, facts.explained.failsafe, facts.state_since
    if state == MAV_STATE_FLIGHT_TERMINATION and not is_simulated(facts):
        yield _error(causes.FLIGHT_TERMINATION, words, since, Source.STATE)
    if state == MAV_STATE_EMERGENCY and not causes.NAMED_EMERGENCIES.intersection(found):
        crashed = facts.kind.family in facts.kind.profile.states.emergency_is_crash
        yield _error(causes.CRASH if crashed else causes.EMERGENCY, words, since, Source.STATE)
    if state == MAV_STATE_CRITICAL and not causes.NAMED_FAILSAFES.intersection(found):
        if facts.sys_status.rc_lost_with_state:
            yield _error(causes.RC_LOST, words, since, Source.STATE_AND_RC)
        elif not facts.latched.failsafe_over:
            yield _error(causes.FAILSAFE, words, since, Source.STATE)


CONSTANT: Final = Reason("the SYS_STATUS of this autopilot never changes", Source.SYS_STATUS)


def in_error(facts: Facts, errors: list[Error]) -> Finding:
    """TRUE with any cause; FALSE only with a fresh SYS_STATUS, which would show a cause."""
    if errors:
        first = errors[0]
        return TRUE, Reason(f"{first.cause.code} {first.cause.name}", first.source, first.cause.code)
    if not facts.fresh.sys_status:
        return UNKNOWN, Reason("no fresh SYS_STATUS")
    if not facts.kind.profile.sensors.are_monitored:
        return UNKNOWN, CONSTANT
    if facts.stop.unexplained and not facts.armed:  # a crash or a termination disarms, and a text alone says so
        return UNKNOWN, Reason("it was disarmed in motion, and frames that may tell why are lost", Source.STOP)
    return FALSE, Reason("no cause is active", Source.SYS_STATUS)
