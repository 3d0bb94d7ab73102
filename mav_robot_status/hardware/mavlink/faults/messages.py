"""SYS_STATUS."""

from __future__ import annotations

import math
from struct import unpack
from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ....mavlink import enumerations as mavlink
from ....mavlink.decode import text
from ....mavlink.definitions import SysStatus
from ..autopilots import shown_by
from ..estop import motor_test
from ..estop import state as estop
from ..readiness import state as readiness
from ..state import heard
from . import causes, latches, parts, sensors
from . import texts as failsafe
from .causes import BATTERY_CRITICAL, BATTERY_FAULT, ESC_FAILURE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from ....clock import Instant
    from ....mavlink.definitions import BatteryStatus, EscInfo, OpenDroneIdArmStatus
    from ..options import HardwareOptions
    from ..state import VehicleState


def sys_status(state: VehicleState, message: SysStatus, now: Instant, options: HardwareOptions) -> None:
    """A SYS_STATUS: faulty bits, readiness, internal errors, and whether the autopilot is the announced one."""
    if sensors.is_empty(message):
        return
    if state.shown is None:
        shown = shown_by(state.autopilot, message.onboard_control_sensors_present)
        if shown is not None:
            state.show(shown)
    profile = state.profile
    if profile.sensors.shows_rc_loss:
        _watch_rc(state, message, now)
    seen = state.latest
    seen.sys_status = heard(message, now.mono, seen.sys_status)
    if state.latches:
        failsafe.radio_heard(state, now.mono)
    checked = estop.includes_stop(profile, state.family, state.version, state.reports_mission)
    checked = checked and not motor_test.is_possible(state.test, now.mono)  # a test forces PREARM_CHECK healthy
    state.stop = estop.heard_sys_status(state.stop, message, state.heartbeats, profile, checked, now.mono)
    state.faults = sensors.heard_faults(state.faults, sensors.faulty_mask(message, profile), now)
    if state.readiness is not readiness.NOTHING and sensors.readiness(message, profile) is TriState.TRUE:
        state.readiness, state.denied_at = readiness.NOTHING, -math.inf
    if profile.sensors.counts_internal_errors and (message.errors_count1 or message.errors_count2):
        state.internal_errors_since = state.internal_errors_since or now
    elif state.internal_errors_since is not None:
        state.internal_errors_since = None
        _clear(state, causes.INTERNAL_ERROR)
    fence = state.latches.get(causes.GEOFENCE) if state.latches else None
    if fence is not None and now.mono - fence.last >= 1.0 and _fence_is_kept(message):
        _clear(state, causes.GEOFENCE)


def _clear(state: VehicleState, code: int) -> None:
    state.latches = latches.clear(state.latches, (code,))


def _fence_is_kept(status: SysStatus) -> bool:
    enabled = status.onboard_control_sensors_present & status.onboard_control_sensors_enabled
    return bool(enabled & status.onboard_control_sensors_health & sensors.GEOFENCE)


def _watch_rc(state: VehicleState, status: SysStatus, now: Instant) -> None:
    """Note when RC_RECEIVER turns unhealthy. Called before `status` is stored, to compare it with the last one."""
    before = state.latest.sys_status
    if not _is_faulty(status, sensors.RC_RECEIVER):
        state.rc_lost_since = None
    elif before is not None and not _is_faulty(before.message, sensors.RC_RECEIVER):
        state.rc_lost_since = now


def _is_faulty(status: SysStatus, bit: int) -> bool:
    return bool(status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health & bit)


CHARGE_STATES: Final[dict[int, tuple[int, str]]] = {
    mavlink.MAV_BATTERY_CHARGE_STATE_CRITICAL: (BATTERY_CRITICAL, "charge critical"),
    mavlink.MAV_BATTERY_CHARGE_STATE_EMERGENCY: (BATTERY_CRITICAL, "charge so low that damage is possible"),
    mavlink.MAV_BATTERY_CHARGE_STATE_FAILED: (BATTERY_FAULT, "failed"),
    mavlink.MAV_BATTERY_CHARGE_STATE_UNHEALTHY: (BATTERY_FAULT, "unhealthy"),
}
"""MAV_BATTERY_CHARGE_STATE: the cause and its words. LOW is a warning, not an error."""
BATTERY_FAULTS: Final[dict[int, str]] = {
    mavlink.MAV_BATTERY_FAULT_DEEP_DISCHARGE: "deep discharge",
    mavlink.MAV_BATTERY_FAULT_SPIKES: "voltage spikes",
    mavlink.MAV_BATTERY_FAULT_CELL_FAIL: "failed cell",
    mavlink.MAV_BATTERY_FAULT_OVER_CURRENT: "over-current",
    mavlink.MAV_BATTERY_FAULT_OVER_TEMPERATURE: "over-temperature",
    mavlink.MAV_BATTERY_FAULT_UNDER_TEMPERATURE: "under-temperature",
    mavlink.MAV_BATTERY_FAULT_INCOMPATIBLE_VOLTAGE: "incompatible voltage",
    mavlink.MAV_BATTERY_FAULT_INCOMPATIBLE_FIRMWARE: "incompatible firmware",
    mavlink.BATTERY_FAULT_INCOMPATIBLE_CELLS_CONFIGURATION: "incompatible cells",
}
"""MAV_BATTERY_FAULT. Any other bit is a fault too."""
ESC_FAILURES: Final[dict[int, str]] = {
    mavlink.ESC_FAILURE_OVER_CURRENT: "over-current",
    mavlink.ESC_FAILURE_OVER_VOLTAGE: "over-voltage",
    mavlink.ESC_FAILURE_OVER_TEMPERATURE: "over-temperature",
    mavlink.ESC_FAILURE_OVER_RPM: "over-speed",
    mavlink.ESC_FAILURE_INCONSISTENT_CMD: "inconsistent command",
    mavlink.ESC_FAILURE_MOTOR_STUCK: "motor stuck",
    mavlink.ESC_FAILURE_GENERIC: "failure",
}
"""ESC_FAILURE_FLAGS. Other bits are ignored: PX4 (EscReport.msg) has temperature warnings in bits 7 and 8."""
TRANSMITTERS: Final[dict[int, str]] = {
    mavlink.MAV_COMP_ID_ODID_TXRX_1: "remote ID",
    mavlink.MAV_COMP_ID_ODID_TXRX_2: "remote ID 2",
    mavlink.MAV_COMP_ID_ODID_TXRX_3: "remote ID 3",
}
"""The Remote ID transmitters by component id. A status that the autopilot passes on counts as one from the first."""


def battery_status(state: VehicleState, message: BatteryStatus, now: Instant, options: HardwareOptions) -> None:
    """BATTERY_STATUS. Its charge_state is UNDEFINED on MAVLink 1 and on autopilots that do not set it."""
    if not (message.fault_bitmask or message.charge_state in CHARGE_STATES or state.faulty_parts):
        return
    source = f"BATTERY_STATUS id {message.id}: "
    source += f"charge_state {message.charge_state}, fault_bitmask 0x{message.fault_bitmask:x}"
    words: dict[int, list[str]] = {}
    if message.charge_state in CHARGE_STATES:
        code, word = CHARGE_STATES[message.charge_state]
        words[code] = [word]
    if message.fault_bitmask:
        others = message.fault_bitmask & ~sum(BATTERY_FAULTS)
        found = [*_named(message.fault_bitmask, BATTERY_FAULTS), *([f"fault 0x{others:x}"] if others else [])]
        words[BATTERY_FAULT] = found  # says more than "unhealthy"
    _report(state, f"battery {message.id + 1}", {code: ", ".join(w) for code, w in words.items()}, source, now)


def esc_info(state: VehicleState, message: EscInfo, now: Instant, options: HardwareOptions) -> None:
    """ESC_INFO: four ESCs. The flags of one that is offline mean nothing.

    `info` has a bit for each ESC of this message; in some versions of PX4 (ESC_INFO.hpp), of all messages.
    """
    if not (any(message.failure_flags) or state.faulty_parts):
        return
    for place, flags in enumerate(unpack("<4H", message.failure_flags)):
        number = message.index + place
        is_online = number < message.count and message.info & (1 << place | 1 << number)
        found = ", ".join(_named(flags, ESC_FAILURES)) if is_online else ""
        source = f"ESC_INFO index {message.index}: failure_flags[{place}] 0x{flags:x}"
        _report(state, f"ESC {number + 1}", {ESC_FAILURE: found} if found else {}, source, now)


def arm_status(state: VehicleState, message: OpenDroneIdArmStatus, now: Instant, options: HardwareOptions) -> None:
    """OPEN_DRONE_ID_ARM_STATUS of the autopilot, which passes on what its transmitter says."""
    transmitter_heard(state, message, mavlink.MAV_COMP_ID_ODID_TXRX_1, now)


def transmitter_heard(state: VehicleState, message: OpenDroneIdArmStatus, component: int, now: Instant) -> None:
    """OPEN_DRONE_ID_ARM_STATUS of a transmitter, a component of the vehicle's system."""
    is_ready = message.status == mavlink.MAV_ODID_ARM_STATUS_GOOD_TO_ARM
    words = text(message.error).strip() or "not ready to arm"
    source = f"OPEN_DRONE_ID_ARM_STATUS of component {component}: status {message.status}"
    _report(state, TRANSMITTERS[component], {} if is_ready else {parts.NOT_READY: words}, source, now)


def _named(flags: int, names: Mapping[int, str]) -> Iterable[str]:
    return (name for bit, name in names.items() if flags & bit)


def _report(state: VehicleState, part: str, found: Mapping[int, str], source: str, now: Instant) -> None:
    """Note what a part reports. Nothing changes if it has no fault and had none."""
    if found or any(name == part for name, _ in state.faulty_parts):
        state.faulty_parts = parts.heard(state.faulty_parts, part, found, source, now)
