"""What an autopilot reports beside its status, for people: the applet of an ArduPilot, the failing checks of a PX4."""

from __future__ import annotations

from typing import Final

from ..clock import Instant, rfc3339
from ..hardware.mavlink.autopilots import ARDUPILOT
from ..hardware.mavlink.estop.applet import EMERGENCY_STOP, SAFETY_SWITCH
from ..hardware.mavlink.interface import MavlinkRobotHW
from ..hardware.mavlink.px4_events import EventTable
from ..hardware.mavlink.px4_events.ids import ALL_MODES
from ..hardware.mavlink.px4_events.table import component_words
from ..hardware.mavlink.readiness import arming_report
from ..hardware.mavlink.readiness.arming_report import Check, failing, words
from ..hardware.mavlink.state import VehicleState
from ..json_object import JsonObject

PAGE: Final = "docs/ardupilot-applet.md"
WORDS: Final = {
    0: "no stop",
    EMERGENCY_STOP: "the emergency stop is engaged",
    SAFETY_SWITCH: "the safety switch is on",
    EMERGENCY_STOP + SAFETY_SWITCH: "the emergency stop is engaged, the safety switch is on",
}
"""The values of RS_STOP in words."""


def can_run(state: VehicleState | None) -> bool:
    """Whether the autopilot of a vehicle is ArduPilot, which can run the applet."""
    return state is not None and state.profile is ARDUPILOT


def applet_reports(hw: MavlinkRobotHW, now: Instant) -> dict[str, JsonObject | None]:
    """By handle, for each ArduPilot: the last report of its applet and its age in seconds; None if it is not heard."""
    return {t.handle.name: _applet(t.state, now) for t in hw.vehicles if t.state is not None and can_run(t.state)}


def _applet(state: VehicleState, now: Instant) -> JsonObject | None:
    word = state.applet
    return None if word is None else {"value": word.value, "age": round(now.mono - word.at, 3)}


def arming_checks(hw: MavlinkRobotHW) -> dict[str, list[JsonObject]]:
    """For each PX4 with a complete report, by handle: its checks that fail in any mode."""
    return {
        t.handle.name: _checks(t.state)
        for t in hw.vehicles
        if t.state is not None and arming_report.is_complete(t.state.arming, t.state.events)
    }


def _checks(state: VehicleState) -> list[JsonObject]:
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
