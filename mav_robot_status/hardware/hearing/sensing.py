"""SYS_STATUS."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...mavlink.definitions import SysStatus
from .. import causes, estop, sensors
from ..identity import Stack
from ..observation import Heard, heard

if TYPE_CHECKING:
    from ...clock import Instant
    from ..memory import Memory
    from ..options import HardwareOptions


def sys_status(memory: Memory, message: SysStatus, now: Instant, options: HardwareOptions) -> Memory:
    """A SYS_STATUS: faulty bits, readiness, internal errors, and whether this ArduPilot is INAV."""
    if sensors.is_empty(message):
        return memory
    before = memory.observation.sys_status
    impostor = memory.impostor or (
        memory.stack is Stack.ARDUPILOT and not message.onboard_control_sensors_present & sensors.MOTOR_OUTPUTS
    )
    memory = memory._replace(
        impostor=impostor,
        observation=memory.observation._replace(sys_status=heard(message, now.mono, before)),
    )
    stack = memory.stack
    counted = stack is Stack.ARDUPILOT and (message.errors_count1 or message.errors_count2)
    stop = estop.heard_sys_status(memory.stop, message, memory.pulse, stack, now.mono)
    ready = sensors.tells_readiness(message, stack) and sensors.is_ready(message, stack)
    latches = memory.latches
    if not counted and memory.internal_errors_since is not None:
        latches = causes.clear(latches, (5001,))
    fence = latches.get(2009)
    if fence is not None and now.mono - fence.last >= 1.0 and _fence_is_kept(message):
        latches = causes.clear(latches, (2009,))
    return memory._replace(
        faults=sensors.heard_faults(memory.faults, sensors.faulty_mask(message, stack), now),
        stop=stop,
        latches=latches,
        not_ready=None if ready else memory.not_ready,
        rc_lost_since=_rc_lost_since(memory, before, message, now),
        internal_errors_since=(memory.internal_errors_since or now) if counted else None,
    )


def _fence_is_kept(status: SysStatus) -> bool:
    enabled = status.onboard_control_sensors_present & status.onboard_control_sensors_enabled
    return bool(enabled & status.onboard_control_sensors_health & sensors.GEOFENCE)


def _rc_lost_since(memory: Memory, before: Heard | None, status: SysStatus, now: Instant) -> Instant | None:
    """Since when PX4 has lost a receiver that it had."""
    if memory.stack is not Stack.PX4 or not _is_faulty(status, sensors.RC_RECEIVER):
        return None
    if before is None or _is_faulty(before.message, sensors.RC_RECEIVER):
        return memory.rc_lost_since
    return now


def _is_faulty(status: SysStatus, bit: int) -> bool:
    return bool(status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health & bit)
