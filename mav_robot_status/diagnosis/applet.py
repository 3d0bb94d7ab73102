"""The applet on an ArduPilot, for people: its reports in words, and where it is described."""

from __future__ import annotations

from typing import Final

from ..clock import Instant
from ..hardware.mavlink.autopilots import ARDUPILOT
from ..hardware.mavlink.interface import MavlinkRobotHW
from ..hardware.mavlink.state.applet import EMERGENCY_STOP, SAFETY_SWITCH
from ..hardware.mavlink.state.vehicle_state import VehicleState
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


def reports(hw: MavlinkRobotHW, now: Instant) -> dict[str, JsonObject | None]:
    """By handle, for each ArduPilot: the last report of its applet and its age in seconds; None if it is not heard."""
    return {t.handle.name: _report(t.state, now) for t in hw.vehicles if t.state is not None and can_run(t.state)}


def _report(state: VehicleState, now: Instant) -> JsonObject | None:
    word = state.applet
    return None if word is None else {"value": word.value, "age": round(now.mono - word.at, 3)}
