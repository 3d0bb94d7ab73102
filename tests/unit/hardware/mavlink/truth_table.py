"""The cases of the truth table (docs/semantics) as a vehicle state: debounce, latches and hysteresis are inputs."""

from __future__ import annotations

import json
import pathlib
from typing import Any

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink.estop import outputs
from mav_robot_status.hardware.mavlink.estop import state as estop
from mav_robot_status.hardware.mavlink.faults import latches, sensors
from mav_robot_status.hardware.mavlink.motion import state as motion
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.state import VehicleState, begin
from mav_robot_status.hardware.mavlink.subjects import HANDLERS
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav

CASES: list[dict[str, Any]] = json.loads(
    (pathlib.Path(__file__).parents[3] / "data" / "truth_cases.json").read_text(encoding="utf-8")
)
NOW = Instant(1000.0, 1_800_000_000_000_000)
UPTIME_MS = 900_000
OPTIONS = HardwareOptions()


def hear(state: VehicleState, message: Any, now: Instant) -> None:
    HANDLERS[type(message)](state, message, now, OPTIONS)


def state_of(inputs: dict[str, Any]) -> tuple[VehicleState, Instant]:
    """The state that the inputs describe, and the time of the evaluation."""
    vehicle_type, autopilot, base_mode, custom_mode, state = inputs["hb"]
    heartbeat = mav.Heartbeat(custom_mode, vehicle_type, autopilot, base_mode, state, 3)
    before = Instant(NOW.mono - 0.5, NOW.unix_us - 500_000)
    state = begin(heartbeat, before)
    state.booted, state.arrived = NOW.mono - UPTIME_MS / 1000, before.mono
    if "ss" in inputs:
        words = [*inputs["ss"], 0, 0, 0][:6]
        errors = inputs.get("ierr", 0)
        status = mav.SysStatus._make((*words[:3], errors & 0xFFFF, errors >> 16, *words[3:]))
        hear(state, status, before)
        state.faults = {bit: f._replace(messages=sensors.DEBOUNCE_MESSAGES) for bit, f in state.faults.items()}
        ready = estop.READY_MESSAGES if _would_be_ready(state, status) else 0
        state.stop = state.stop._replace(ready=ready)
    if "landed" in inputs:
        hear(state, mav.ExtendedSysState(0, inputs["landed"]), before)
    if "rate" in inputs:
        hear(state, mav.Attitude(UPTIME_MS, 0, 0, inputs["rate"]), before)
    if "vel" in inputs:
        hear(state, mav.LocalPositionNed(UPTIME_MS, *inputs["vel"]), before)
        sustained = NOW.mono - motion.SUSTAIN_OFF
        measured = state.motion
        measured.fast_since = None if measured.fast_since is None else sustained
        measured.slow_since = None if measured.slow_since is None else sustained
    if "std" in inputs:
        hear(state, mav.CurrentMode(custom_mode, custom_mode, inputs["std"]), before)
    for code in inputs.get("texts", ()):
        state.latches = latches.announce(state.latches, code, "as announced", before)
    if "estop" in inputs:
        said = TriState(inputs["estop"])
        text = "RC7: MotorEStop HIGH" if said else "RC7: MotorEStop LOW"
        state.stop = estop.said(state.stop, bool(said), text, before)
    if "driven" in inputs:
        state.watch = _watch(TriState(inputs["driven"]), before)
    later = Instant(NOW.mono + 10, NOW.unix_us + 10_000_000) if inputs.get("stale") else NOW
    return state, later


def _would_be_ready(state: VehicleState, status: mav.SysStatus) -> bool:
    """Whether two such SYS_STATUS, well after the disarm, would have counted."""
    settled = state.heartbeats._replace(edge=Instant(0.0, 0))
    checked = state.profile.stops.check is not None  # by a recent firmware
    stop = estop.heard_sys_status(estop.NOTHING, status, settled, state.profile, checked, NOW.mono)
    return stop.ready > 0


def _watch(value: TriState, at: Instant) -> outputs.Watch:
    if value is TriState.TRUE:  # the column says T for driven, F for held
        return outputs.Watch(driven=True, at=at.mono)
    return outputs.Watch(held_since=at.mono - outputs.HOLD, held=True, at=at.mono)
