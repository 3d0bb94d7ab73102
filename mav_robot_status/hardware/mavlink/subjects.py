"""The subjects as tables: which handler a message has, and which function gives each fact.

A subject is a folder: `messages.py` has its handlers, `state.py` what they change, `rule.py` its facts and its rule.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from ...clock import Instant
from ...mavlink import definitions as mav
from ...mavlink import enumerations as mavlink
from .belief.belief import CLOCKED
from .estop import messages as estop_messages
from .estop import rule as estop
from .facts import UNDISPUTED, Facts
from .faults import messages as fault_messages
from .faults import rule as faults
from .faults import texts
from .heartbeat import messages as heartbeat_messages
from .heartbeat import rule as heartbeat
from .motion import messages as motion_messages
from .motion import rule as motion
from .px4_events import messages as events
from .readiness import rule as readiness
from .satellite import rule as satellite
from .state import VehicleState

if TYPE_CHECKING:
    from .facts import Claimed, Deadline
    from .options import HardwareOptions

Handler = Callable[[VehicleState, Any, Instant, "HardwareOptions"], None]

HANDLERS: Final[dict[type, Handler]] = {
    mav.Heartbeat: heartbeat_messages.heartbeat,
    mav.CurrentMode: heartbeat_messages.current_mode,
    mav.AvailableModes: heartbeat_messages.available_modes,
    mav.AutopilotVersion: heartbeat_messages.autopilot_version,
    mav.ExtendedSysState: motion_messages.extended_sys_state,
    mav.GlobalPositionInt: motion_messages.global_position,
    mav.LocalPositionNed: motion_messages.local_position,
    mav.VfrHud: motion_messages.vfr_hud,
    mav.GpsRawInt: motion_messages.gps_raw_int,
    mav.Attitude: motion_messages.attitude,
    mav.EkfStatusReport: motion_messages.ekf_status_report,
    mav.ServoOutputRaw: estop_messages.servo_output_raw,
    mav.ParamValue: estop_messages.param_value,
    mav.RcChannels: estop_messages.rc_channels,
    mav.NamedValueFloat: estop_messages.named_value_float,
    mav.MissionCurrent: estop_messages.mission_current,
    mav.EscTelemetry1To4: estop_messages.esc_telemetry,
    mav.EscTelemetry5To8: estop_messages.esc_telemetry,
    mav.EscTelemetry9To12: estop_messages.esc_telemetry,
    mav.EscStatus: estop_messages.esc_status,
    mav.CommandAck: estop_messages.command_ack,
    mav.SysStatus: fault_messages.sys_status,
    mav.BatteryStatus: fault_messages.battery_status,
    mav.EscInfo: fault_messages.esc_info,
    mav.OpenDroneIdArmStatus: fault_messages.arm_status,
    mav.Statustext: texts.statustext_,
    mav.Event: events.event,
    mav.CurrentEventSequence: events.current_event_sequence,
    mav.ResponseEventError: events.response_event_error,
    mav.MessageInterval: lambda state, message, now, options: None,  # it answers a request
}
"""How a message changes the state."""
HANDLERS_BY_ID: Final = {d.id: HANDLERS[d.type] for d in mav.MESSAGES.values() if d.type in HANDLERS}

HEARTBEAT_ID: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
APPLET_ID: Final = mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT
ARM_STATUS_ID: Final = mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_ARM_STATUS
COMMAND_IDS: Final = frozenset({mavlink.MAVLINK_MSG_ID_COMMAND_INT, mavlink.MAVLINK_MSG_ID_COMMAND_LONG})
"""Messages from other senders."""
HIGH_LATENCY_ID: Final = mavlink.MAVLINK_MSG_ID_HIGH_LATENCY2
"""It says what a HEARTBEAT says, so its sender is checked first."""
METADATA_ID: Final = mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA
FILE_ID: Final = mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
FILE_IDS: Final = frozenset({METADATA_ID, FILE_ID})
"""Messages that no rule needs: they bring the table of PX4's events."""
WANTED_IDS: Final = frozenset(HANDLERS_BY_ID) | CLOCKED | COMMAND_IDS | {HIGH_LATENCY_ID, METADATA_ID}
"""The messages that are decoded."""
IDS_WITH_FILES: Final = WANTED_IDS | FILE_IDS
"""The same while a file is read. At other times files are those of other programs, and are not decoded."""
EDGES: Final = frozenset(
    {
        HEARTBEAT_ID,
        HIGH_LATENCY_ID,
        mavlink.MAVLINK_MSG_ID_SYS_STATUS,
        mavlink.MAVLINK_MSG_ID_STATUSTEXT,
        mavlink.MAVLINK_MSG_ID_EVENT,
        mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
        mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
        mavlink.MAVLINK_MSG_ID_CURRENT_MODE,
        APPLET_ID,
    }
)
"""Messages that are in the status at once. All others are streams."""

Fact = Callable[["VehicleState", "Deadline", "HardwareOptions"], object]

FACTS: Final[dict[str, Fact]] = {
    "kind": heartbeat.kind,
    "heartbeat": heartbeat.heartbeat,
    "seldom": satellite.seldom,
    "state_since": heartbeat.state_since,
    "fresh": heartbeat.fresh,
    "landed_state": heartbeat.landed_state,
    "movement": motion.movement,
    "receiver_stands": motion.receiver_stands,
    "turns": motion.turns,
    "has_no_lift": motion.has_no_lift,
    "lies": motion.lies,
    "outputs": estop.motor_outputs,
    "motor_test": estop.motor_test,
    "outputs_vetoed": estop.outputs_vetoed,
    "esc_turning": estop.esc_turning,
    "stop": estop.stop,
    "applet": estop.applet,
    "stop_switch": estop.stop_switch,
    "stop_excused": estop.stop_excused,
    "assumed_free": estop.assumed_free,
    "sys_status": faults.sys_status,
    "faults": faults.faults,
    "latched": faults.latched,
    "explained": readiness.explained,
    "parts": faults.reported_by_parts,
    "arming": readiness.arming,
    "mode_hints": heartbeat.mode_hints,
    "claimed": lambda state, deadline, options: UNDISPUTED,
    "text_overdue": faults.text_overdue,
}
"""The function that makes each fact from the state, in the order of `Facts`."""
assert tuple(FACTS) == Facts._fields


def facts_of(state: VehicleState, deadline: Deadline, options: HardwareOptions, claimed: Claimed = UNDISPUTED) -> Facts:
    """The facts of a vehicle at a time. `deadline.next` is then the first time at which one may change."""
    facts = Facts._make([fact(state, deadline, options) for fact in FACTS.values()])
    return facts if claimed is UNDISPUTED else facts._replace(claimed=claimed)
