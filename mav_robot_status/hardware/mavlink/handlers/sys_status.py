"""SYS_STATUS."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ....interface.status import TriState
from ....mavlink.definitions import SysStatus
from .. import causes
from ..autopilots import shown_by
from ..state import estop, latches, readiness, sensors
from ..state.latest_messages import heard
from . import failsafe

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState


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
    seen.sys_status = heard(seen, message, now.mono, seen.sys_status)
    if state.latches:
        failsafe.radio_heard(state, now.mono)
    checked = estop.includes_stop(profile, state.family, state.version, state.reports_mission)
    state.stop = estop.heard_sys_status(state.stop, message, state.heartbeats, profile, checked, now.mono)
    state.faults = sensors.heard_faults(state.faults, sensors.faulty_mask(message, profile), now)
    if state.readiness is not readiness.NOTHING and sensors.readiness(message, profile) is TriState.TRUE:
        state.readiness, state.denied_at = readiness.NOTHING, -math.inf
        seen.unsettled = True
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
