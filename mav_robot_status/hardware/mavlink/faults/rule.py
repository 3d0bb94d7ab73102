"""in_error and error_code: every active cause, from texts, counters, sensor bits and the state."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import ErrorCause
from ....mavlink.enumerations import MAV_STATE_CRITICAL, MAV_STATE_EMERGENCY, MAV_STATE_FLIGHT_TERMINATION
from ..autopilots.sensor_weights import SOFT
from ..facts import Cause, Latched, NotReady, Parts, SensorFault, SystemStatus
from ..heartbeat.rule import UNEXPLAINED, is_simulated, state_words
from ..identity import sensor_name
from ..reason import FALSE, TRUE, UNKNOWN, Finding, Reason, at, claims_words, words
from ..satellite.rule import high_latency_words
from ..state import FRESH
from . import causes, latches, parts, sensors, text_assembly

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from ..facts import Deadline, Facts
    from ..options import HardwareOptions
    from ..reason import Reason, Shown, Words
    from ..state import VehicleState

# -- facts -------------------------------------------------------------------------------------------------------------


TOGETHER: Final = 5.0
"""Seconds between a loss of RC and a failsafe that it explains."""
NO_SYS_STATUS: Final = SystemStatus(False, False, UNKNOWN, None, False, 0)
NOTHING_LATCHED: Final = Latched((), False, False)
NO_PARTS: Final = Parts((), ())


def sys_status(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> SystemStatus:
    """The contents of the latest SYS_STATUS."""
    heard, lost, errors = state.latest.sys_status, state.rc_lost_since, state.internal_errors_since
    if heard is None:
        return NO_SYS_STATUS
    message, profile, heartbeats = heard.message, state.profile, state.heartbeats
    switch = profile.sensors.has_safety_switch and sensors.safety_switch_on(message)
    outdated = (
        switch and heartbeats.armed and (message is state.armed_after or not deadline.is_within(heard.at + FRESH))
    )
    names_faults = profile.texts.sends_events and not heartbeats.armed
    return SystemStatus(
        switch and not outdated,
        outdated,
        sensors.readiness(message, profile),
        None if errors is None else errors.unix_us,
        lost is not None and abs(lost.mono - state.heartbeats.state_since.mono) <= TOGETHER,
        sensors.unhealthy_mask(message) if names_faults else 0,
    )


def faults(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> tuple[SensorFault, ...]:
    """The bits that have been faulty for long enough, some time after the boot."""
    if not state.faults or not deadline.has_come(state.booted + sensors.GRACE):
        return ()
    return tuple(
        SensorFault(bit, weight is SOFT, fault.since.unix_us)
        for bit, weight, fault in state.counting_faults(options)
        if fault.messages >= sensors.DEBOUNCE_MESSAGES or deadline.has_come(fault.since.mono + sensors.DEBOUNCE_SECONDS)
    )


def latched(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Latched:
    """The causes that were announced and are still active."""
    if not state.latches and state.failsafe_cleared is None:
        return NOTHING_LATCHED
    errors = state.error_bits(options) if deadline.is_fresh(state.latest.sys_status, options.sys_status_timeout) else ()
    lasting = tuple(
        Cause(code, latch.text, latch.since.unix_us)
        for code, latch in state.latches.items()
        if not deadline.has_come(latches.ends_at(code, latch, state.heartbeats, errors, options.text_hold_s))
    )
    seen = state.latest.heartbeat
    outlived = seen is not None and latches.has_outlived_termination(state.latches, state.heartbeats.armed, seen.at)
    cleared = state.failsafe_cleared
    return Latched(lasting, outlived, cleared is not None and seen is not None and seen.at <= cleared + latches.CLEARED)


def reported_by_parts(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Parts:
    """What the parts report. An error counts after some reports, and some time after the boot."""
    if not state.faulty_parts:
        return NO_PARTS
    lasting = [(key[1], f) for key, f in state.faulty_parts.items() if deadline.is_within(f.last + parts.SILENCE)]
    refusals = tuple(NotReady(fault.text, fault.since.unix_us) for code, fault in lasting if code == parts.NOT_READY)
    counting = [(code, f) for code, f in lasting if code != parts.NOT_READY and f.reports >= parts.DEBOUNCE]
    if not counting or not deadline.has_come(state.booted + sensors.GRACE):
        return Parts((), refusals)
    return Parts(tuple(_joined(code, counting) for code in sorted({code for code, _ in counting})), refusals)


def _joined(code: int, faults: list[tuple[int, parts.Fault]]) -> Cause:
    """One cause, in the words of all parts that report it."""
    found = [fault for other, fault in faults if other == code]
    return Cause(code, "; ".join(fault.text for fault in found), min(fault.since.unix_us for fault in found))


def text_overdue(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether the missing chunks of a text are overdue."""
    return any(deadline.has_come(partial.at + text_assembly.PATIENCE) for _, partial in state.texts)


# -- evidence in words -------------------------------------------------------------------------------------------------


sys_status_words: Final = words("SYS_STATUS", "sys_status")


def state_and_rc_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The state, and why it is a lost remote control."""
    text, heard_at = state_words(state, facts, reason)
    return f"{text}, as SYS_STATUS: RC_RECEIVER turned unhealthy", heard_at


def internal_errors_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The mask of internal errors."""
    heard = state.latest.sys_status
    count = 0 if heard is None else heard.message.errors_count1 | heard.message.errors_count2 << 16
    return f"SYS_STATUS.errors_count 0x{count:x}", at(heard)


def sensor_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The bit by its name."""
    bit = reason.code - causes.SENSOR
    if reason.code >= causes.EXTENDED_SENSOR:
        bit = reason.code - causes.EXTENDED_SENSOR + 32
    return f"SYS_STATUS: {sensor_name(bit)} enabled, unhealthy", at(state.latest.sys_status)


def latch_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """What announced the cause."""
    latch = state.latches.get(reason.code)
    return (None, None) if latch is None else (latch.source, latch.last)


def parts_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """What the part said last."""
    reported = [fault for (_, code), fault in state.faulty_parts.items() if code == reason.code]
    latest = max(reported, key=lambda fault: fault.last, default=None)
    return (None, None) if latest is None else (latest.source, latest.last)


# -- the rule ----------------------------------------------------------------------------------------------------------


class Error(NamedTuple):
    """An active cause with its priority, and what it rests on in words."""

    cause: ErrorCause
    priority: int
    words: Words


def active_errors(facts: Facts) -> list[Error]:
    """Every active cause, the most important first."""
    every = (*_of_parts(facts), *_announced(facts), *_counted(facts), *_faulty(facts))
    found = {error.cause.code: error for error in every}
    for error in _of_state(facts, found.keys()):
        found.setdefault(error.cause.code, error)
    return sorted(found.values(), key=lambda error: error.priority)


def _error(code: int, text: str | None, since_us: int, words: Words, later: int = 0) -> Error:
    return Error(causes.error(code, text, since_us), causes.CAUSES[code].priority + later, words)


def _announced(facts: Facts) -> Iterator[Error]:
    if facts.claimed.conflict_since is not None:
        yield _error(causes.SYSTEM_ID_CONFLICT, None, facts.claimed.conflict_since, claims_words)
    for code, text, since_us in facts.latched.causes:
        yield _error(code, text, since_us, latch_words)
    if facts.seldom is not None:
        for code, text, since_us in facts.seldom.failures:
            yield _error(code, text, since_us, high_latency_words)


def _of_parts(facts: Facts) -> Iterator[Error]:
    """The causes that parts report. The autopilot's own text about the same cause is preferred."""
    for code, text, since_us in facts.parts.faults:
        yield _error(code, text, since_us, parts_words)


def _counted(facts: Facts) -> Iterator[Error]:
    since = facts.sys_status.internal_errors_since
    if since is not None and facts.fresh.sys_status:
        yield _error(causes.INTERNAL_ERROR, None, since, internal_errors_words)


def _faulty(facts: Facts) -> Iterator[Error]:
    if not facts.fresh.sys_status:
        return
    for bit, is_soft, since_us in facts.faults:
        later = causes.SOFT_AFTER if is_soft else 0
        yield _error(causes.of_sensor(bit), None, since_us, sensor_words, later)


def _of_state(facts: Facts, found: Collection[int]) -> Iterator[Error]:
    """The causes from HEARTBEAT.system_status, unless a specific cause is active."""
    state, words, since = facts.heartbeat.system_status, facts.explained.failsafe, facts.state_since
    if state == MAV_STATE_FLIGHT_TERMINATION and not is_simulated(facts):
        yield _error(causes.FLIGHT_TERMINATION, words, since, state_words)
    if state == MAV_STATE_EMERGENCY and not causes.NAMED_EMERGENCIES.intersection(found):
        crashed = facts.kind.family in facts.kind.profile.states.emergency_is_crash
        yield _error(causes.CRASH if crashed else causes.EMERGENCY, words, since, state_words)
    if state == MAV_STATE_CRITICAL and not causes.NAMED_FAILSAFES.intersection(found):
        if facts.sys_status.rc_lost_with_state:
            yield _error(causes.RC_LOST, words, since, state_and_rc_words)
        elif not facts.latched.failsafe_over:
            yield _error(causes.FAILSAFE, words, since, state_words)


CONSTANT: Final = Reason("the SYS_STATUS of this autopilot never changes", sys_status_words)


def in_error(facts: Facts, errors: list[Error]) -> Finding:
    """TRUE with any cause; FALSE only with a fresh SYS_STATUS, which would show a cause."""
    if errors:
        first = errors[0]
        return TRUE, Reason(f"{first.cause.code} {first.cause.name}", first.words, first.cause.code)
    if not facts.fresh.sys_status:
        return UNKNOWN, Reason("no fresh SYS_STATUS")
    if not facts.kind.profile.sensors.are_monitored:
        return UNKNOWN, CONSTANT
    if facts.stop.unexplained and not facts.armed:  # a crash or a termination disarms, and a text alone says so
        return UNKNOWN, UNEXPLAINED
    return FALSE, Reason("no cause is active", sys_status_words)
