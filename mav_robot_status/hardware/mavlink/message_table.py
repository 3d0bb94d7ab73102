"""The handler of each kind of message, found by one look-up of its id."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...mavlink import definitions as mav
from ...mavlink import enumerations as mavlink
from .facts import Facts
from .handlers import HANDLERS
from .settle import SETTLE
from .state.claims import COUNTED_APART

if TYPE_CHECKING:
    from .handlers import Handler
    from .settle import Settle

    Settles = tuple[tuple[int, Settle], ...]
    """Indices in `Facts`, each with the function that settles the fact."""

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
WANTED_IDS: Final = (
    frozenset(d.id for d in mav.MESSAGES.values() if d.type in HANDLERS) | COMMAND_IDS | {HIGH_LATENCY_ID, METADATA_ID}
)
IDS_WITH_FILES: Final = WANTED_IDS | FILE_IDS
"""The same while a file is read. At other times files are those of other programs, and are not decoded."""

MOVES: Final[dict[type, tuple[str, ...]]] = {
    mav.Attitude: ("turns", "outputs_vetoed"),
    mav.BatteryStatus: (),  # a fault sets `unsettled`
    mav.CurrentEventSequence: ("arming",),
    mav.CurrentMode: ("mode_hints",),
    mav.EkfStatusReport: ("turns",),  # the rest is read with the next speed
    mav.EscInfo: (),
    mav.EscStatus: ("esc_turning", "outputs"),
    mav.EscTelemetry1To4: ("esc_turning", "outputs"),
    mav.EscTelemetry5To8: ("esc_turning", "outputs"),
    mav.EscTelemetry9To12: ("esc_turning", "outputs"),
    mav.ExtendedSysState: ("landed_state", "has_no_lift", "lies"),
    mav.GlobalPositionInt: ("movement", "lies"),
    mav.GpsRawInt: ("receiver_stands",),
    mav.Heartbeat: ("claimed", "latched", "stop"),
    mav.MessageInterval: (),
    mav.LocalPositionNed: ("movement", "lies"),
    mav.MissionCurrent: (),  # read with the next SYS_STATUS
    mav.NamedValueFloat: ("stop", "applet"),
    mav.OpenDroneIdArmStatus: (),
    mav.ParamValue: ("has_no_lift", "outputs", "outputs_vetoed", "stop_excused"),
    mav.RcChannels: ("stop_switch",),
    mav.ResponseEventError: (),
    mav.ServoOutputRaw: ("has_no_lift", "outputs", "outputs_vetoed", "applet"),
    mav.SysStatus: ("turns", "sys_status", "stop", "faults", "latched"),
    mav.SystemTime: (),
    mav.VfrHud: ("movement", "has_no_lift", "lies", "outputs_vetoed"),
}
"""The facts that each frequent message can change. Every other message can change any fact. A change that sets
`LatestMessages.unsettled` is not listed: then all facts are settled. `test_message_table.py` detects an omission."""


def _settles(message: type) -> Settles:
    return tuple((Facts._fields.index(name), SETTLE[name]) for name in MOVES.get(message, Facts._fields))


KINDS: Final[dict[int, tuple[Handler, Settles]]] = {
    d.id: (HANDLERS[d.type], _settles(d.type)) for d in mav.MESSAGES.values() if d.type in HANDLERS
}
"""By message id: its handler, and the facts that it may change. A plain tuple unpacks in a third of the time."""
PLAIN: Final[dict[int, Handler]] = {
    number: handler for number, (handler, _) in KINDS.items() if number not in (HEARTBEAT_ID, COUNTED_APART)
}
"""The handlers of the messages that concern only the state of the vehicle that sends them."""
