"""The inhibits: every reason why motion is not possible."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ....interface.status import Inhibit, RobotMode
from ....mavlink.enumerations import (
    MAV_STATE_BOOT,
    MAV_STATE_CALIBRATING,
    MAV_STATE_EMERGENCY,
    MAV_STATE_FLIGHT_TERMINATION,
    MAV_STATE_POWEROFF,
    MAV_STATE_UNINIT,
)
from ..autopilots.profile import Uninit
from ..facts import Arming, Explained, NotReady
from ..faults.causes import TERMINATION_ANNOUNCED
from ..heartbeat.rule import actuators_blocked, hides_armed, is_initialising, is_simulated
from ..identity import sensor_name
from ..reason import FALSE, TRUE, UNKNOWN
from ..satellite import rule as high_latency
from . import arming_report
from . import state as readiness

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from ....clock import Instant
    from ....interface.status import Detail, TriState
    from ..autopilots.modes import FlightMode
    from ..facts import Deadline, Facts, NotReady
    from ..options import HardwareOptions
    from ..reason import Finding
    from ..state import VehicleState

# -- facts -------------------------------------------------------------------------------------------------------------


NO_ARMING: Final = Arming(UNKNOWN, None, ())


def explained(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Explained:
    """The texts that the autopilot sent."""
    return Explained(not_ready(state, deadline), state.failsafe and state.failsafe.text)


def not_ready(state: VehicleState, deadline: Deadline) -> tuple[NotReady, ...]:
    """The reasons why it cannot be armed. What the latest burst of texts lacks may end when the burst is over."""
    held = state.readiness
    if held is readiness.NOTHING:
        return ()
    if held.first < math.inf and deadline.has_come(held.last + readiness.BURST):
        held = readiness.closed(held)
    reasons = held.reasons.values()
    return tuple(NotReady(reason.text, reason.since.unix_us) for reason in reasons if deadline.is_within(reason.until))


def arming(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Arming:
    """The latest report of the arming checks, if it is complete and no newer one is overdue."""
    report, table = state.arming, state.event_table
    if not report.chunks or not arming_report.is_complete(report, state.events):
        return NO_ARMING
    if report.begun is not None and deadline.has_come(report.begun_at + arming_report.IN_PROGRESS):
        return NO_ARMING
    mask, beat = report.can_arm, state.latest.heartbeat
    if mask is None or beat is None:
        return NO_ARMING
    group = None if table is None else table.mode_groups.get(beat.message.custom_mode)
    checks = [] if state.heartbeats.armed else arming_report.failing(report, mask, group)
    return Arming(
        arming_report.can_arm(mask, group),
        arming_report.blocked_modes(mask, table, state.modes),
        tuple(NotReady(*reason) for reason in arming_report.reasons(checks, table)),
    )


# -- the rule ----------------------------------------------------------------------------------------------------------


INHIBITS: Final = (
    "LINK_STALE DISARMED E_STOPPED SAFETY_SWITCH PREARM_FAILING INITIALISING CALIBRATING POWERING_OFF TERMINATION "
    "EMERGENCY HIL SYS_STATUS_MISSING MODE_MANUAL STOP_UNCERTAIN SENDER_UNCERTAIN HEARTBEAT_LATE"
).split()
MOST_REASONS: Final = 16
"""Limit of reasons why it cannot be armed."""

Named = tuple[str, "str | None"]
"""A reason by its name, with its text."""


def inhibits(
    facts: Facts, options: HardwareOptions, mode: FlightMode, stopped: Finding, before: Detail, now: Instant
) -> tuple[Inhibit, ...]:
    """Every reason why motion is not possible. `stopped` is e_stopped with its reason."""
    if facts.seldom is not None:
        told = high_latency.inhibits(facts.seldom, facts, options, mode)
        return tuple(inhibit(name, None, before, now) for name in told)

    def listed(reasons: Iterable[Named]) -> Iterator[Inhibit]:
        return (inhibit(name, text, before, now) for name, text in reasons)

    return (
        *listed(_of_stop(facts, stopped)),
        *_of_checks(facts, before, now),
        *listed(_of_state(facts).items()),
        *listed(_of_options(facts, options, mode)),
    )


def _of_stop(facts: Facts, stopped: Finding) -> Iterator[Named]:
    """The inhibits without which a checked vehicle would have power."""
    value, why = stopped
    if not facts.armed and not hides_armed(facts):
        yield "DISARMED", None
    if value is TRUE:
        yield "E_STOPPED", facts.stop.text
    elif why.doubt:
        yield "STOP_UNCERTAIN", facts.stop.text
    if _switch_is_on(facts):
        yield "SAFETY_SWITCH", None


def _of_checks(facts: Facts, before: Detail, now: Instant) -> Iterator[Inhibit]:
    """One inhibit for each reported reason why it cannot be armed; if there is none, one with our own text or none."""
    if facts.armed:
        return
    fails = _is_not_ready(facts)
    told = (facts.arming.failing or facts.explained.not_ready) if fails else ()
    reasons = (*told, *_refused_by_parts(facts))
    for reason in reasons[:MOST_REASONS]:
        yield Inhibit("PREARM_FAILING", reason.text, reason.since_us)
    if fails and not reasons:
        yield inhibit("PREARM_FAILING", _unhealthy(facts), before, now)


def _refused_by_parts(facts: Facts) -> tuple[NotReady, ...]:
    """The parts that are not ready. The autopilot decides: ArduPilot checks them only if DID_OPTIONS says so."""
    passes = facts.fresh.sys_status and facts.sys_status.ready is TRUE
    return () if passes else facts.parts.not_ready


def _unhealthy(facts: Facts) -> str | None:
    """What a PX4 shows while it has not reported why: unhealthy bits of SYS_STATUS, else a state of not ready."""
    mask = facts.sys_status.unhealthy if facts.fresh.sys_status else 0
    names = [sensor_name(bit) for bit in range(mask.bit_length()) if mask >> bit & 1]
    if names:
        return f"SYS_STATUS: {', '.join(names)}"
    is_silent = facts.kind.profile.texts.sends_events and facts.heartbeat.system_status == MAV_STATE_UNINIT
    return "HEARTBEAT: MAV_STATE_UNINIT, no report of the arming checks yet" if is_silent else None


def _of_state(facts: Facts) -> dict[str, str | None]:
    """The inhibits from MAV_STATE, the mode and an announced termination."""
    state = facts.heartbeat.system_status
    starting = state == MAV_STATE_UNINIT and facts.kind.profile.states.uninit is Uninit.STARTING
    termination = next((cause for cause in facts.latched.causes if cause.code == TERMINATION_ANNOUNCED), None)
    reasons: dict[str, str | None] = {}
    if is_initialising(facts) or state == MAV_STATE_BOOT or starting:
        reasons["INITIALISING"] = None
    elif state == MAV_STATE_CALIBRATING:
        reasons["CALIBRATING"] = None
    if state == MAV_STATE_POWEROFF:
        reasons["POWERING_OFF"] = None
    if termination is not None:
        reasons["TERMINATION"] = termination.text
    elif state == MAV_STATE_FLIGHT_TERMINATION and not is_simulated(facts):
        reasons["TERMINATION"] = facts.explained.failsafe
    if state == MAV_STATE_EMERGENCY:
        reasons["EMERGENCY"] = None
    return reasons


def _of_options(facts: Facts, options: HardwareOptions, mode: FlightMode) -> Iterator[Named]:
    """The inhibits that depend on the site, and a missing SYS_STATUS."""
    if actuators_blocked(facts, options):
        yield "HIL", None
    if not facts.fresh.sys_status:
        yield "SYS_STATUS_MISSING", None
    if options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        yield "MODE_MANUAL", None


def _switch_is_on(facts: Facts) -> bool:
    """Whether the safety switch holds the outputs, by SYS_STATUS or by a text."""
    if facts.fresh.sys_status and facts.sys_status.safety_switch:
        return True
    texts = facts.kind.profile.texts.safety_switch
    return not facts.armed and any(reason.text in texts for reason in facts.explained.not_ready)


def _is_not_ready(facts: Facts) -> bool:
    """Whether the vehicle reports that its pre-arm checks fail."""
    uninit = facts.kind.profile.states.uninit
    if uninit is Uninit.NOT_READY and facts.heartbeat.system_status == MAV_STATE_UNINIT:
        return True
    return facts.fresh.sys_status and facts.sys_status.ready is FALSE


def inhibit(name: str, text: str | None, before: Detail, now: Instant) -> Inhibit:
    """A reason, with the time since which it has been active without interruption."""
    since = min((i.since_us for i in before.inhibits if i.name == name), default=now.unix_us)
    return Inhibit(name, text, since)


def can_arm(facts: Facts) -> TriState:
    """What the report says; UNKNOWN while SYS_STATUS contradicts it. Without reports SYS_STATUS says it.

    PX4 reports at most every 2 s, and SYS_STATUS may be newer. For an armed vehicle SYS_STATUS shows something else:
    whether the mode can continue.
    """
    reported, shown = facts.arming.can_arm, facts.sys_status.ready
    if not facts.kind.profile.texts.sends_events:
        return UNKNOWN if facts.armed or not facts.fresh.sys_status else shown
    if facts.armed or not facts.fresh.sys_status or UNKNOWN in (reported, shown):
        return reported
    return reported if reported is shown else UNKNOWN
