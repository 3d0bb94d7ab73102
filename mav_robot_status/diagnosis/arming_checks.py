"""The failing arming checks of a PX4, for people: what each says, what to do, and which modes it concerns."""

from __future__ import annotations

from ..clock import rfc3339
from ..hardware.mavlink.interface import MavlinkRobotHW
from ..hardware.mavlink.px4_events import EventTable
from ..hardware.mavlink.px4_events.ids import ALL_MODES
from ..hardware.mavlink.px4_events.table import component_words
from ..hardware.mavlink.state import arming_report
from ..hardware.mavlink.state.arming_reasons import failing, words
from ..hardware.mavlink.state.arming_report import Check
from ..hardware.mavlink.state.vehicle_state import VehicleState
from ..json_object import JsonObject


def reports(hw: MavlinkRobotHW) -> dict[str, list[JsonObject]]:
    """For each PX4 with a complete report, by handle: its checks that fail in any mode."""
    return {
        t.handle.name: _report(t.state)
        for t in hw.vehicles
        if t.state is not None and arming_report.is_complete(t.state.arming, t.state.events)
    }


def _report(state: VehicleState) -> list[JsonObject]:
    mask, table = state.arming.can_arm, state.event_table
    return [] if mask is None else [_check(check, table) for check in failing(state.arming, mask, None)]


def _check(check: Check, table: EventTable | None) -> JsonObject:
    """One check."""
    return {
        "event": check.event.id,
        "text": words(check, table),
        "description": None if table is None else table.description(check.event),
        "component": component_words(table, check.component),
        "modes": _modes(check.modes, table),
        "since": rfc3339(check.since.unix_us),
    }


def _modes(mask: int, table: EventTable | None) -> list[str] | None:
    """The words for the mode groups in a mask; None without a table."""
    if table is None:
        return None
    return ["all modes"] if mask == ALL_MODES else list(table.modes_of(mask))
