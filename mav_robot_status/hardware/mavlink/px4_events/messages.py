"""PX4's EVENTs: failsafes with their exact causes, alarms by their level, and the report of the arming checks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....mavlink.enumerations import MAV_STATE_CRITICAL
from ..autopilots.texts import UNCLASSIFIED
from ..faults import causes, latches
from ..readiness import arming_report
from . import sequence as event_sequence
from .ids import failsafe_cause
from .sequence import BACK_MS, Arrival

if TYPE_CHECKING:
    from ....clock import Instant
    from ....mavlink.definitions import CurrentEventSequence, Event, ResponseEventError
    from ..options import HardwareOptions
    from ..state import VehicleState

MOST_INTERNAL: Final = 5
"""The highest internal level of an EVENT that is used: 6 is a response to an operator's command."""


def event(state: VehicleState, message: Event, now: Instant, options: HardwareOptions) -> None:
    """EVENT: each counts once, whenever it arrives."""
    if not state.profile.texts.sends_events or _is_ahead(state, message, now):
        return
    known, arrival = event_sequence.heard(state.events, message, now)
    if arrival is Arrival.REPEATED:
        return
    _follow(state, known)
    state.arming = arming_report.heard(state.arming, known, message, state.event_table, now)
    _announce(state, message, arrival, now)


def current_event_sequence(
    state: VehicleState, message: CurrentEventSequence, now: Instant, options: HardwareOptions
) -> None:
    """CURRENT_EVENT_SEQUENCE: which events there are."""
    if state.profile.texts.sends_events:
        _follow(state, event_sequence.told(state.events, message, now))


def response_event_error(
    state: VehicleState, message: ResponseEventError, now: Instant, options: HardwareOptions
) -> None:
    """RESPONSE_EVENT_ERROR: the autopilot no longer has an event."""
    state.events = event_sequence.refused(state.events, message)


def _is_ahead(state: VehicleState, message: Event, now: Instant) -> bool:
    """Whether the time of an event is ahead of the autopilot's clock: then the event is from the run before."""
    return state.has_clock and message.event_time_boot_ms > (now.mono - state.booted) * 1000 + BACK_MS


def _follow(state: VehicleState, known: event_sequence.EventSequence) -> None:
    """The events are now `known`. A report of an earlier run is invalid."""
    if known.since != state.events.since:
        state.arming = arming_report.NOTHING
    state.events = known


def _announce(state: VehicleState, message: Event, arrival: Arrival, now: Instant) -> None:
    """The cause that an event reports: exactly, else by its levels, which have the meaning of STATUSTEXT severities."""
    code, text = failsafe_cause(message), None if state.event_table is None else state.event_table.message(message)
    is_critical = state.heartbeats.state == MAV_STATE_CRITICAL
    if code is not None:
        # a past failsafe has ended if its state CRITICAL has ended
        if is_critical or (state.heartbeats.armed and arrival is Arrival.NEWEST):
            before = state.latches.get(code)
            text = text or (before and before.text)
            state.latches = latches.announce(state.latches, code, text, now, f"EVENT 0x{message.id:07x}")
        return
    external, internal = message.log_levels & 0x0F, message.log_levels >> 4
    if state.heartbeats.armed and external <= UNCLASSIFIED and internal <= MOST_INTERNAL:
        state.latches = latches.announce(state.latches, causes.EVENT + external, text, now, "EVENT")
