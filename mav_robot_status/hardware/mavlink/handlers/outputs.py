"""Motor outputs and ESC telemetry, and the parameters that assign outputs and switches."""

from __future__ import annotations

import math
import re
from struct import unpack
from typing import TYPE_CHECKING, Any, Final

from ....interface.status import TriState
from ....mavlink import definitions as mav
from ..state import estop, outputs
from ..state.latest_messages import FRESH, heard, is_fresh
from ..state.speeds import driving_speed

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState

_NUMBERED: Final = re.compile(rb"SERVO(\d{1,2})_FUNCTION|RC(\d{1,2})_OPTION")


def servo_output_raw(state: VehicleState, message: mav.ServoOutputRaw, now: Instant, options: HardwareOptions) -> None:
    """SERVO_OUTPUT_RAW: the output watch of ArduPilot."""
    if not state.profile.stops.outputs_show or not options.watch_outputs or message.port != 0:
        return
    values = message[:8] + message[9:]
    hud = state.latest.vfr_hud
    throttle = hud.message.throttle if hud is not None and is_fresh(hud, now.mono, FRESH) else None
    outputs.heard_outputs(
        state.watch,
        values,
        state.vehicle_type,
        state.heartbeats,
        throttle,
        driving_speed(state.latest, state.family),
        now.mono,
    )
    if state.watch.driven and state.stop.said is TriState.TRUE:
        state.stop = estop.NOTHING  # a driven motor is not stopped, whatever was reported before
        state.latest.unsettled = True


def param_value(state: VehicleState, message: mav.ParamValue, now: Instant, options: HardwareOptions) -> None:
    """PARAM_VALUE: SERVOn_FUNCTION gives the outputs that drive motors, RCn_OPTION the functions of the switches."""
    found, value = _NUMBERED.fullmatch(message.param_id.split(b"\0")[0]), message.param_value
    if found is None or not math.isfinite(value) or not state.profile.stops.outputs_show:
        return
    channel = int(found[1] or found[2])
    if not 1 <= channel <= 32:
        return
    if found[1]:
        state.watch.name({**state.watch.functions, channel: int(value)})
    else:
        state.switches = {**state.switches, channel: int(value)}


def esc_telemetry(state: VehicleState, message: Any, now: Instant, options: HardwareOptions) -> None:
    """ESC_TELEMETRY_n (ArduPilot): four motors."""
    _turning(state, message, unpack("<4H", message.rpm), now)


def esc_status(state: VehicleState, message: mav.EscStatus, now: Instant, options: HardwareOptions) -> None:
    """ESC_STATUS (PX4): four motors."""
    _turning(state, message, unpack("<4i", message.rpm), now)


def _turning(state: VehicleState, message: Any, rpm: tuple[int, ...], now: Instant) -> None:
    seen = state.latest
    if any(rpm):
        seen.esc = heard(seen, message, now.mono, seen.esc)
    elif seen.esc is not None and type(seen.esc.message) is type(message):
        seen.esc = None
