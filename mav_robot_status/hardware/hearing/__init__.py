"""One message more: message in, memory changed. Each kind of message has its function in the table below."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from ...clock import Instant
from ...mavlink import definitions as mav
from ..memory import Memory
from . import beats, commanded, modes, movement, sensing, words
from .commanded import overheard
from .words import pass_time

if TYPE_CHECKING:
    from ..options import HardwareOptions

__all__ = ["HANDLERS", "hear", "overheard", "pass_time"]

Handler = Callable[[Memory, Any, Instant, "HardwareOptions"], None]

HANDLERS: Final[dict[type, Handler]] = {
    mav.Heartbeat: beats.heartbeat,
    mav.SysStatus: sensing.sys_status,
    mav.Statustext: words.statustext_,
    mav.Event: words.event,
    mav.ExtendedSysState: movement.extended_sys_state,
    mav.GlobalPositionInt: movement.global_position,
    mav.LocalPositionNed: movement.local_position,
    mav.VfrHud: movement.vfr_hud,
    mav.GpsRawInt: movement.gps_raw_int,
    mav.Attitude: movement.attitude,
    mav.EkfStatusReport: movement.ekf_status_report,
    mav.SystemTime: movement.system_time,
    mav.ServoOutputRaw: movement.servo_output_raw,
    mav.ParamValue: movement.param_value,
    mav.EscTelemetry1To4: movement.esc_telemetry,
    mav.EscTelemetry5To8: movement.esc_telemetry,
    mav.EscTelemetry9To12: movement.esc_telemetry,
    mav.EscStatus: movement.esc_status,
    mav.CommandAck: commanded.command_ack,
    mav.CurrentMode: modes.current_mode,
    mav.AvailableModes: modes.available_modes,
    mav.AutopilotVersion: modes.autopilot_version,
}


def hear(memory: Memory, message: Any, now: Instant, options: HardwareOptions) -> None:
    """Change the memory by one more message of this vehicle; a message of no interest changes nothing."""
    handler = HANDLERS.get(type(message))
    if handler is not None:
        handler(memory, message, now, options)
