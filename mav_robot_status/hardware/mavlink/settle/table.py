"""The function that settles each fact, and the facts about the vehicle, its heartbeat, its mode and its senders.

Each field of `Facts` has its function here, in `SETTLE`. They are short, because some run for every message.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ....mavlink.enumerations import MAV_LANDED_STATE_UNDEFINED, MAV_STANDARD_MODE_NON_STANDARD
from ..autopilots.modes import ModeHints
from ..facts import (
    Cause,
    Claimed,
    Facts,
    Fresh,
    Kind,
    Seldom,
)
from ..failure_flags import failures
from ..state import (
    text_assembly,
)
from ..state.latest_messages import FRESH
from ..state.vehicle_state import timeout_of
from .causes import arming, explained, faults, latched, reported_by_parts, sys_status
from .motion import has_no_lift, lies, movement, receiver_stands, turns
from .stops import applet, assumed_free, esc_turning, motor_outputs, outputs_vetoed, stop, stop_excused, stop_switch

if TYPE_CHECKING:
    from ....mavlink.definitions import Heartbeat
    from ..moment import Moment
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
new: Final = tuple.__new__  # as in `framing`

CURRENT_MODE_FRESH: Final = 5.0
"""Seconds for which a CURRENT_MODE is valid."""

NO_HINTS: Final = ModeHints()
UNDISPUTED: Final = Claimed(None, False)


def kind(state: VehicleState, moment: Moment, options: HardwareOptions) -> Kind:
    """The kind of vehicle."""
    told = state.firmware
    return Kind(state.profile, state.family, state.vehicle_type, state.autopilot, told and told.firmware)


def heartbeat(state: VehicleState, moment: Moment, options: HardwareOptions) -> Heartbeat:
    """The latest heartbeat."""
    if state.high_latency is not None:
        return state.high_latency.statement
    seen = state.latest.heartbeat
    assert seen is not None  # a state begins with a heartbeat
    message: Heartbeat = seen.message
    return message


def seldom(state: VehicleState, moment: Moment, options: HardwareOptions) -> Seldom | None:
    """What HIGH_LATENCY2 tells of a vehicle that sends nothing else."""
    known = state.high_latency
    if known is None:
        return None
    found = tuple(Cause(code, None, since) for code, since in failures(known, options))
    return Seldom(known.armed, known.moves, found)


def state_since(state: VehicleState, moment: Moment, options: HardwareOptions) -> int:
    """When it entered its MAV_STATE."""
    return state.heartbeats.state_since.unix_us


def fresh(state: VehicleState, moment: Moment, options: HardwareOptions) -> Fresh:
    """Which messages are recent enough to be used."""
    latest, is_fresh = state.latest, moment.is_fresh
    velocity = None
    for name, heard in (
        ("GLOBAL_POSITION_INT", latest.global_position),
        ("LOCAL_POSITION_NED", latest.local_position),
        ("VFR_HUD", latest.vfr_hud),
    ):
        if is_fresh(heard, FRESH):
            velocity = name
            break
    beat = state.high_latency or latest.heartbeat
    return Fresh(
        beat is not None and moment.is_within(beat.at + timeout_of(state, options)),
        is_fresh(latest.sys_status, options.sys_status_timeout),
        is_fresh(latest.extended_sys_state, FRESH),
        velocity,
        velocity == "GLOBAL_POSITION_INT",
        is_fresh(latest.gps, FRESH),
        moment.is_within(state.arrived + timeout_of(state, options)),
        latest.heartbeat is not None and state.told_armed > latest.heartbeat.at,
    )


def landed_state(state: VehicleState, moment: Moment, options: HardwareOptions) -> int:
    """MAV_LANDED_STATE of the latest EXTENDED_SYS_STATE."""
    heard = state.latest.extended_sys_state
    return MAV_LANDED_STATE_UNDEFINED if heard is None else heard.message.landed_state


def mode_hints(state: VehicleState, moment: Moment, options: HardwareOptions) -> ModeHints:
    """The mode according to messages other than HEARTBEAT."""
    seen, current = state.latest.heartbeat, state.latest.current_mode
    if seen is None or (current is None and not state.modes):
        return NO_HINTS
    number = seen.message.custom_mode
    standard_mode = MAV_STANDARD_MODE_NON_STANDARD
    if current is not None and current.message.custom_mode == number and moment.is_fresh(current, CURRENT_MODE_FRESH):
        standard_mode = current.message.standard_mode
    return ModeHints(state.modes.get(number), standard_mode)


def text_overdue(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether the missing chunks of a text are overdue."""
    return any(moment.has_come(partial.at + text_assembly.PATIENCE) for _, partial in state.texts)


Settle = Callable[["VehicleState", "Moment", "HardwareOptions"], object]

SETTLE: Final[dict[str, Settle]] = {
    "kind": kind,
    "heartbeat": heartbeat,
    "seldom": seldom,
    "state_since": state_since,
    "fresh": fresh,
    "landed_state": landed_state,
    "movement": movement,
    "receiver_stands": receiver_stands,
    "turns": turns,
    "has_no_lift": has_no_lift,
    "lies": lies,
    "outputs": motor_outputs,
    "outputs_vetoed": outputs_vetoed,
    "esc_turning": esc_turning,
    "stop": stop,
    "applet": applet,
    "stop_switch": stop_switch,
    "stop_excused": stop_excused,
    "assumed_free": assumed_free,
    "sys_status": sys_status,
    "faults": faults,
    "latched": latched,
    "explained": explained,
    "parts": reported_by_parts,
    "arming": arming,
    "mode_hints": mode_hints,
    "claimed": lambda state, moment, options: UNDISPUTED,
    "text_overdue": text_overdue,
}
"""The function that settles each fact, in the order of `Facts`."""
assert tuple(SETTLE) == Facts._fields

_ALL: Final = tuple(SETTLE.values())


def facts_of(state: VehicleState, moment: Moment, options: HardwareOptions, claimed: Claimed = UNDISPUTED) -> Facts:
    """The facts of a vehicle at a moment. `moment.next` is then the first time at which one may change."""
    facts: Facts = new(Facts, [settle(state, moment, options) for settle in _ALL])
    return facts if claimed is UNDISPUTED else facts._replace(claimed=claimed)
