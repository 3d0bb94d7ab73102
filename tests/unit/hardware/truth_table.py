"""The truth table's inputs as a memory: debounce, latches and hysteresis enter as given, not as messages."""

from __future__ import annotations

import json
import pathlib
from typing import Any

from mav_robot_status.clock import Instant
from mav_robot_status.hardware import causes, estop, motion, outputs, sensors
from mav_robot_status.hardware.boot import Boot
from mav_robot_status.hardware.hearing import hear
from mav_robot_status.hardware.identity import Stack
from mav_robot_status.hardware.memory import Memory, begin
from mav_robot_status.hardware.options import HardwareOptions
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav

CASES: list[dict[str, Any]] = json.loads(
    (pathlib.Path(__file__).parents[2] / "data" / "truth_cases.json").read_text(encoding="utf-8")
)
NOW = Instant(1000.0, 1_800_000_000_000_000)
UPTIME_MS = 900_000
OPTIONS = HardwareOptions()


def memory_of(inputs: dict[str, Any]) -> tuple[Memory, Instant]:
    """The memory that the inputs describe, and the time at which to look at it."""
    vehicle_type, autopilot, base_mode, custom_mode, state = inputs["hb"]
    heartbeat = mav.Heartbeat(custom_mode, vehicle_type, autopilot, base_mode, state, 3)
    before = Instant(NOW.mono - 0.5, NOW.unix_us - 500_000)
    memory = begin(heartbeat, before)
    memory.boot = Boot(NOW.mono - UPTIME_MS / 1000)
    if "ss" in inputs:
        words = [*inputs["ss"], 0, 0, 0][:6]
        errors = inputs.get("ierr", 0)
        status = mav.SysStatus._make((*words[:3], errors & 0xFFFF, errors >> 16, *words[3:]))
        hear(memory, status, before, OPTIONS)
        memory.faults = {bit: f._replace(messages=sensors.DEBOUNCE_MESSAGES) for bit, f in memory.faults.items()}
        ready = estop.READY_MESSAGES if _would_be_ready(memory, status) else 0
        memory.stop = memory.stop._replace(ready=ready)
    if "landed" in inputs:
        hear(memory, mav.ExtendedSysState(0, inputs["landed"]), before, OPTIONS)
    if "rate" in inputs:
        hear(memory, mav.Attitude(UPTIME_MS, 0, 0, inputs["rate"]), before, OPTIONS)
    if "vel" in inputs:
        hear(memory, mav.LocalPositionNed(UPTIME_MS, *inputs["vel"]), before, OPTIONS)
        sustained = NOW.mono - motion.SUSTAIN_OFF
        measured = memory.motion
        measured.fast_since = None if measured.fast_since is None else sustained
        measured.slow_since = None if measured.slow_since is None else sustained
    if "std" in inputs:
        hear(memory, mav.CurrentMode(custom_mode, custom_mode, inputs["std"]), before, OPTIONS)
    for code in inputs.get("texts", ()):
        memory.latches = causes.announce(memory.latches, code, "as announced", before)
    if "estop" in inputs:
        said = TriState(inputs["estop"])
        text = "RC7: MotorEStop HIGH" if said else "RC7: MotorEStop LOW"
        memory.stop = estop.said(memory.stop, bool(said), text, before)
    if "driven" in inputs:
        memory.watch = _watch(TriState(inputs["driven"]), before)
    later = Instant(NOW.mono + 10, NOW.unix_us + 10_000_000) if inputs.get("stale") else NOW
    return memory, later


def _would_be_ready(memory: Memory, status: mav.SysStatus) -> bool:
    """Whether two such SYS_STATUS, well after the disarm, would have counted."""
    settled = memory.pulse._replace(edge=Instant(0.0, 0))
    stop = estop.heard_sys_status(estop.NOTHING, status, settled, memory.stack, NOW.mono)
    return stop.ready > 0 and memory.stack is Stack.ARDUPILOT


def _watch(value: TriState, at: Instant) -> outputs.Watch:
    if value is TriState.TRUE:  # the column says T for driven, F for held
        return outputs.Watch(driven=True, at=at.mono)
    return outputs.Watch(held_since=at.mono - outputs.HOLD, at=at.mono)
