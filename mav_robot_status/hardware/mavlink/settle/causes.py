"""What SYS_STATUS, texts, events and parts report: errors, and why it cannot be armed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ..autopilots.sensor_weights import SOFT
from ..facts import (
    Arming,
    Cause,
    Explained,
    Latched,
    NotReady,
    Parts,
    SensorFault,
    SystemStatus,
)
from ..state import (
    arming_reasons,
    arming_report,
    latches,
    parts,
    readiness,
    sensors,
)
from ..state.latest_messages import FRESH

if TYPE_CHECKING:
    from ..moment import Moment
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
new: Final = tuple.__new__  # as in `framing`

TOGETHER: Final = 5.0
"""Seconds between a loss of RC and a failsafe that it explains."""
NO_SYS_STATUS: Final = SystemStatus(False, False, UNKNOWN, None, False, 0)
NO_ARMING: Final = Arming(UNKNOWN, None, ())
NOTHING_LATCHED: Final = Latched((), False, False)
NO_PARTS: Final = Parts((), ())


def sys_status(state: VehicleState, moment: Moment, options: HardwareOptions) -> SystemStatus:
    """The contents of the latest SYS_STATUS."""
    heard, lost, errors = state.latest.sys_status, state.rc_lost_since, state.internal_errors_since
    if heard is None:
        return NO_SYS_STATUS
    message, profile, heartbeats = heard.message, state.profile, state.heartbeats
    switch = profile.sensors.has_safety_switch and sensors.safety_switch_on(message)
    outdated = switch and heartbeats.armed and (message is state.armed_after or not moment.is_within(heard.at + FRESH))
    names_faults = profile.texts.sends_events and not heartbeats.armed
    return new(
        SystemStatus,
        (
            switch and not outdated,
            outdated,
            sensors.readiness(message, profile),
            None if errors is None else errors.unix_us,
            lost is not None and abs(lost.mono - state.heartbeats.state_since.mono) <= TOGETHER,
            sensors.unhealthy_mask(message) if names_faults else 0,
        ),
    )


def faults(state: VehicleState, moment: Moment, options: HardwareOptions) -> tuple[SensorFault, ...]:
    """The bits that have been faulty for long enough, some time after the boot."""
    if not state.faults or not moment.has_come(state.booted + sensors.GRACE):
        return ()
    return tuple(
        SensorFault(bit, weight is SOFT, fault.since.unix_us)
        for bit, weight, fault in state.counting_faults(options)
        if fault.messages >= sensors.DEBOUNCE_MESSAGES or moment.has_come(fault.since.mono + sensors.DEBOUNCE_SECONDS)
    )


def latched(state: VehicleState, moment: Moment, options: HardwareOptions) -> Latched:
    """The causes that were announced and are still active."""
    if not state.latches and state.failsafe_cleared is None:
        return NOTHING_LATCHED
    errors = state.error_bits(options) if moment.is_fresh(state.latest.sys_status, options.sys_status_timeout) else ()
    lasting = tuple(
        Cause(code, latch.text, latch.since.unix_us)
        for code, latch in state.latches.items()
        if not moment.has_come(latches.ends_at(code, latch, state.heartbeats, errors, options.text_hold_s))
    )
    seen = state.latest.heartbeat
    outlived = seen is not None and latches.has_outlived_termination(state.latches, state.heartbeats.armed, seen.at)
    cleared = state.failsafe_cleared
    return Latched(lasting, outlived, cleared is not None and seen is not None and seen.at <= cleared + latches.CLEARED)


def explained(state: VehicleState, moment: Moment, options: HardwareOptions) -> Explained:
    """The texts that the autopilot sent."""
    return new(Explained, (not_ready(state, moment), state.failsafe and state.failsafe.text))


def not_ready(state: VehicleState, moment: Moment) -> tuple[NotReady, ...]:
    """The reasons why it cannot be armed. What the latest burst of texts lacks may end when the burst is over."""
    held = state.readiness
    if held is readiness.NOTHING:
        return ()
    if held.first < math.inf and moment.has_come(held.last + readiness.BURST):
        held = readiness.closed(held)
    reasons = held.reasons.values()
    return tuple(NotReady(reason.text, reason.since.unix_us) for reason in reasons if moment.is_within(reason.until))


def reported_by_parts(state: VehicleState, moment: Moment, options: HardwareOptions) -> Parts:
    """What the parts report. An error counts after some reports, and some time after the boot."""
    if not state.faulty_parts:
        return NO_PARTS
    lasting = [(key[1], f) for key, f in state.faulty_parts.items() if moment.is_within(f.last + parts.SILENCE)]
    refusals = tuple(NotReady(fault.text, fault.since.unix_us) for code, fault in lasting if code == parts.NOT_READY)
    counting = [(code, f) for code, f in lasting if code != parts.NOT_READY and f.reports >= parts.DEBOUNCE]
    if not counting or not moment.has_come(state.booted + sensors.GRACE):
        return Parts((), refusals)
    return Parts(tuple(_joined(code, counting) for code in sorted({code for code, _ in counting})), refusals)


def _joined(code: int, faults: list[tuple[int, parts.Fault]]) -> Cause:
    """One cause, in the words of all parts that report it."""
    found = [fault for other, fault in faults if other == code]
    return Cause(code, "; ".join(fault.text for fault in found), min(fault.since.unix_us for fault in found))


def arming(state: VehicleState, moment: Moment, options: HardwareOptions) -> Arming:
    """The latest report of the arming checks, if it is complete and no newer one is overdue."""
    report, table = state.arming, state.event_table
    if not report.chunks or not arming_report.is_complete(report, state.events):
        return NO_ARMING
    if report.begun is not None and moment.has_come(report.begun_at + arming_report.IN_PROGRESS):
        return NO_ARMING
    mask, beat = report.can_arm, state.latest.heartbeat
    if mask is None or beat is None:
        return NO_ARMING
    group = None if table is None else table.mode_groups.get(beat.message.custom_mode)
    checks = [] if state.heartbeats.armed else arming_reasons.failing(report, mask, group)
    return Arming(
        arming_reasons.can_arm(mask, group),
        arming_reasons.blocked_modes(mask, table, state.modes),
        tuple(NotReady(*reason) for reason in arming_reasons.reasons(checks, table)),
    )
