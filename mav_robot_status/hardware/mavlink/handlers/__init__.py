"""A message changes the state. `HANDLERS` has one function for each type of message."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from ....clock import Instant
from ....mavlink import definitions as mav
from ..state.vehicle_state import VehicleState
from . import commands, events, heartbeat, kinematics, modes, outputs, parts, statustext, sys_status
from .commands import overheard
from .parts import transmitter_heard
from .statustext import pass_time

if TYPE_CHECKING:
    from ..options import HardwareOptions

__all__ = ["HANDLERS", "HANDLERS_BY_ID", "hear", "overheard", "pass_time", "transmitter_heard"]

Handler = Callable[[VehicleState, Any, Instant, "HardwareOptions"], "bool | None"]
"""It returns True if no fact has changed, unless `LatestMessages.unsettled` is set: of what facts are made of, it has
changed only times, to later ones, and values, to others of the same meaning. Anything else: a fact may have changed."""

HANDLERS: Final[dict[type, Handler]] = {
    mav.Heartbeat: heartbeat.heartbeat,
    mav.SysStatus: sys_status.sys_status,
    mav.Statustext: statustext.statustext_,
    mav.Event: events.event,
    mav.CurrentEventSequence: events.current_event_sequence,
    mav.ResponseEventError: events.response_event_error,
    mav.ExtendedSysState: kinematics.extended_sys_state,
    mav.GlobalPositionInt: kinematics.global_position,
    mav.LocalPositionNed: kinematics.local_position,
    mav.VfrHud: kinematics.vfr_hud,
    mav.GpsRawInt: kinematics.gps_raw_int,
    mav.Attitude: kinematics.attitude,
    mav.EkfStatusReport: kinematics.ekf_status_report,
    mav.ServoOutputRaw: outputs.servo_output_raw,
    mav.ParamValue: outputs.param_value,
    mav.RcChannels: outputs.rc_channels,
    mav.NamedValueFloat: outputs.named_value_float,
    mav.MissionCurrent: outputs.mission_current,
    mav.EscTelemetry1To4: outputs.esc_telemetry,
    mav.EscTelemetry5To8: outputs.esc_telemetry,
    mav.EscTelemetry9To12: outputs.esc_telemetry,
    mav.EscStatus: outputs.esc_status,
    mav.BatteryStatus: parts.battery_status,
    mav.EscInfo: parts.esc_info,
    mav.OpenDroneIdArmStatus: parts.arm_status,
    mav.CommandAck: commands.command_ack,
    mav.CurrentMode: modes.current_mode,
    mav.AvailableModes: modes.available_modes,
    mav.AutopilotVersion: modes.autopilot_version,
    mav.MessageInterval: modes.message_interval,
}


HANDLERS_BY_ID: Final = {d.id: HANDLERS[d.type] for d in mav.MESSAGES.values() if d.type in HANDLERS}
"""The same by message id."""


def hear(state: VehicleState, message: Any, now: Instant, options: HardwareOptions) -> None:
    """Update the state with one message of this vehicle. Messages without a handler change nothing."""
    handler = HANDLERS.get(type(message))
    if handler is not None:
        handler(state, message, now, options)
