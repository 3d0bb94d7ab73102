"""SYS_STATUS."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...mavlink.definitions import SysStatus
from .. import causes, estop, sensors
from ..identity import ARDUPILOT, PX4
from ..observation import heard

if TYPE_CHECKING:
    from ...clock import Instant
    from ..memory import Memory
    from ..options import HardwareOptions


def sys_status(memory: Memory, message: SysStatus, now: Instant, options: HardwareOptions) -> None:
    """A SYS_STATUS: faulty bits, readiness, internal errors, and whether this ArduPilot is INAV."""
    if sensors.is_empty(message):
        return
    if memory.stack is ARDUPILOT and not message.onboard_control_sensors_present & sensors.MOTOR_OUTPUTS:
        memory.unmask()
    stack = memory.stack
    if stack is PX4:
        _watch_rc(memory, message, now)
    seen = memory.observation
    seen.sys_status = heard(message, now.mono, seen.sys_status)
    memory.stop = estop.heard_sys_status(memory.stop, message, memory.pulse, stack, now.mono)
    memory.faults = sensors.heard_faults(memory.faults, sensors.faulty_mask(message, stack), now)
    if memory.not_ready is not None and sensors.tells_readiness(message, stack) and sensors.is_ready(message, stack):
        memory.not_ready = None
    if stack is ARDUPILOT and (message.errors_count1 or message.errors_count2):
        memory.internal_errors_since = memory.internal_errors_since or now
    elif memory.internal_errors_since is not None:
        memory.internal_errors_since = None
        memory.latches = causes.clear(memory.latches, (5001,))
    fence = memory.latches.get(2009) if memory.latches else None
    if fence is not None and now.mono - fence.last >= 1.0 and _fence_is_kept(message):
        memory.latches = causes.clear(memory.latches, (2009,))


def _fence_is_kept(status: SysStatus) -> bool:
    enabled = status.onboard_control_sensors_present & status.onboard_control_sensors_enabled
    return bool(enabled & status.onboard_control_sensors_health & sensors.GEOFENCE)


def _watch_rc(memory: Memory, status: SysStatus, now: Instant) -> None:
    """Since when PX4 has lost a receiver that it had. Before `status` is heard, for it is compared with the last."""
    before = memory.observation.sys_status
    if not _is_faulty(status, sensors.RC_RECEIVER):
        memory.rc_lost_since = None
    elif before is not None and not _is_faulty(before.message, sensors.RC_RECEIVER):
        memory.rc_lost_since = now


def _is_faulty(status: SysStatus, bit: int) -> bool:
    return bool(status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health & bit)
