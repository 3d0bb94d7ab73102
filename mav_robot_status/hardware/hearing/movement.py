"""Position, speed, attitude, motor outputs: what moves, and the clock that those messages carry."""

from __future__ import annotations

import math
import re
from struct import unpack
from typing import TYPE_CHECKING, Any, Final

from ...mavlink import definitions as mav
from .. import estop, motion, outputs, sensors
from ..boot import heard_clock
from ..identity import AIRCRAFT, ARDUPILOT, INAV, OTHER, PX4, ROVER, SURFACE_BOAT
from ..observation import Heard, heard, is_fresh
from .beats import rebooted

if TYPE_CHECKING:
    from ...clock import Instant
    from ..memory import Memory
    from ..options import HardwareOptions


_NUMBERED: Final = re.compile(rb"SERVO(\d{1,2})_FUNCTION|RC(\d{1,2})_OPTION")
FIX_3D: Final = 3  # GPS_FIX_TYPE
NO_SPEED: Final = 0xFFFF  # GPS_RAW_INT.vel
ESTIMATOR_FRESH: Final = 10.0  # s
CONST_POS_MODE: Final = 0x80  # EKF_STATUS_FLAGS: nothing measures where it is, and the estimator takes it to stand


def extended_sys_state(memory: Memory, message: Any, now: Instant, options: HardwareOptions) -> None:
    """EXTENDED_SYS_STATE: the landed state."""
    seen = memory.observation
    seen.extended_sys_state = heard(message, now.mono, seen.extended_sys_state)


def global_position(memory: Memory, message: mav.GlobalPositionInt, now: Instant, options: HardwareOptions) -> None:
    """GLOBAL_POSITION_INT: the first choice for speed."""
    at = now.mono
    if heard_clock(memory.boot, message.time_boot_ms, at):
        rebooted(memory, memory.boot, now)
    seen = memory.observation
    seen.global_position = heard(message, at, seen.global_position)
    vx, vy, vz = message.vx, message.vy, message.vz
    still = not (vx or vy or vz)
    nowhere = message.lat == 0 and message.lon == 0
    speed = _speed(memory, vx / 100, vy / 100, vz / 100, still, nowhere, at, options)
    _moved(memory, memory.motion, speed, at, options)


def local_position(memory: Memory, message: mav.LocalPositionNed, now: Instant, options: HardwareOptions) -> None:
    """LOCAL_POSITION_NED: the speed while no global position is fresh."""
    at = now.mono
    if heard_clock(memory.boot, message.time_boot_ms, at):
        rebooted(memory, memory.boot, now)
    seen = memory.observation
    seen.local_position = heard(message, at, seen.local_position)
    if not is_fresh(seen.global_position, at, motion.FRESH):
        vx, vy, vz = message.vx, message.vy, message.vz
        speed = _speed(memory, vx, vy, vz, not (vx or vy or vz), False, at, options)
        _moved(memory, memory.motion, speed, at, options)


def vfr_hud(memory: Memory, message: mav.VfrHud, now: Instant, options: HardwareOptions) -> None:
    """VFR_HUD: the last choice for speed; the throttle for the output watch."""
    at = now.mono
    seen = memory.observation
    seen.vfr_hud = heard(message, at, seen.vfr_hud)
    if is_fresh(seen.global_position, at, motion.FRESH) or is_fresh(seen.local_position, at, motion.FRESH):
        return
    still = message.groundspeed == 0  # whatever the climb, which comes from the barometer
    speed = _speed(memory, message.groundspeed, 0.0, message.climb, still, False, at, options)
    if speed is None:
        pass
    elif memory.stack is PX4:
        speed = _if_fast(memory, speed, options)  # PX4 keeps the other two back while its estimate is not valid
    elif memory.stack is OTHER and still and memory.vehicle_type not in AIRCRAFT and _lacks_gps(memory):
        speed = None  # INAV and Betaflight as themselves
    _moved(memory, memory.motion, speed, at, options)


def gps_raw_int(memory: Memory, message: mav.GpsRawInt, now: Instant, options: HardwareOptions) -> None:
    """GPS_RAW_INT: whether the receiver itself stands still."""
    if message.fix_type < FIX_3D or message.vel == NO_SPEED:
        memory.gps_motion = motion.Motion()
        return
    at = now.mono
    seen = memory.observation
    seen.gps = heard(message, at, seen.gps)
    _moved(memory, memory.gps_motion, message.vel / 100, at, options)


def attitude(memory: Memory, message: mav.Attitude, now: Instant, options: HardwareOptions) -> None:
    """ATTITUDE: rotation."""
    at = now.mono
    if heard_clock(memory.boot, message.time_boot_ms, at):
        rebooted(memory, memory.boot, now)
    seen = memory.observation
    seen.attitude = heard(message, at, seen.attitude)
    if memory.vehicle_type == SURFACE_BOAT:  # they always roll
        memory.turning = fastest(message.yawspeed)
    else:
        memory.turning = fastest(message.yawspeed, message.rollspeed, message.pitchspeed)


def ekf_status_report(memory: Memory, message: mav.EkfStatusReport, now: Instant, options: HardwareOptions) -> None:
    """EKF_STATUS_REPORT: whether ArduPilot's speed is measured."""
    memory.unaided, memory.unaided_at = bool(message.flags & CONST_POS_MODE), now.mono


def system_time(memory: Memory, message: mav.SystemTime, now: Instant, options: HardwareOptions) -> None:
    """SYSTEM_TIME: the autopilot's clock."""
    if heard_clock(memory.boot, message.time_boot_ms, now.mono):
        rebooted(memory, memory.boot, now)


def _speed(
    memory: Memory, x: float, y: float, z: float, still: bool, nowhere: bool, now: float, options: HardwareOptions
) -> float | None:
    """Speed in m/s, None where the numbers mean that there is no estimate: `still` exactly zero, `nowhere` at 0, 0.

    ArduPilot sends exactly zero (and its last position) when it has none, and up to 6 m/s at rest while its estimator
    is unhealthy; INAV sends zero without GPS.
    """
    if not math.isfinite(x + y + z):
        return None
    speed = math.hypot(x, y) if memory.family is ROVER else math.hypot(x, y, z)
    status = memory.observation.sys_status
    if memory.stack is ARDUPILOT:
        if still and (nowhere or status is None or not sensors.estimate_is_healthy(status.message)):
            return None
        if not memory.pulse.armed and status is not None and sensors.estimate_is_faulty(status.message):
            return None
        return _measured(memory, speed, z, nowhere, now, options)
    if memory.stack is INAV and still and not _has_gps(status):
        return None
    return speed


def _measured(
    memory: Memory, speed: float, climb: float, nowhere: bool, now: float, options: HardwareOptions
) -> float | None:
    """What of ArduPilot's `speed` is measured: without a position it sends nearly zero however fast it goes.

    Then the climb, from the barometer or the water's pressure, is all that can tell, and only of motion.
    """
    if now - memory.unaided_at > ESTIMATOR_FRESH:
        return _if_fast(memory, speed, options) if nowhere else speed
    if not memory.unaided:
        return speed
    return None if memory.family is ROVER else _if_fast(memory, abs(climb), options)


def _if_fast(memory: Memory, speed: float, options: HardwareOptions) -> float | None:
    """`speed` if it tells of motion; None if it would tell of rest."""
    return speed if speed > (options.v_on if memory.pulse.armed else options.v_on_disarmed) else None


def _lacks_gps(memory: Memory) -> bool:
    status = memory.observation.sys_status
    return status is not None and not _has_gps(status)


def _has_gps(status: Heard | None) -> bool:
    return status is not None and bool(
        status.message.onboard_control_sensors_present & status.message.onboard_control_sensors_health & sensors.GPS
    )


def fastest(*rates: float) -> float:
    """The greatest of some rates, whatever their signs; those that are no numbers do not count."""
    found = 0.0
    for rate in rates:
        if found < rate < math.inf:
            found = rate
        elif found < -rate < math.inf:
            found = -rate
    return found


def _moved(memory: Memory, moving: motion.Motion, speed: float | None, now: float, options: HardwareOptions) -> None:
    """One more sample of speed."""
    rotation = memory.turning if is_fresh(memory.observation.attitude, now, motion.FRESH) else 0.0
    motion.moved(moving, speed, rotation, memory.pulse.armed, options, now)


def speed_over_ground(memory: Memory) -> float:
    """The estimated speed over ground in m/s; 0 while none was heard."""
    position = memory.observation.global_position
    return 0.0 if position is None else math.hypot(position.message.vx, position.message.vy) / 100


def driving_speed(memory: Memory) -> float:
    """What would grow if the motors really ran: speed over ground of a rover, climb of a copter; m/s."""
    hud = memory.observation.vfr_hud
    if hud is None:
        return 0.0
    speed: float = hud.message.groundspeed if memory.family is ROVER else hud.message.climb
    return speed if math.isfinite(speed) else 0.0


def servo_output_raw(memory: Memory, message: mav.ServoOutputRaw, now: Instant, options: HardwareOptions) -> None:
    """SERVO_OUTPUT_RAW: the output watch of ArduPilot."""
    if memory.stack is not ARDUPILOT or not options.watch_outputs or message.port != 0:
        return
    values = message[:8] + message[9:]
    hud = memory.observation.vfr_hud
    throttle = hud.message.throttle if hud is not None and is_fresh(hud, now.mono, motion.FRESH) else None
    outputs.heard_outputs(
        memory.watch, values, memory.vehicle_type, memory.pulse, throttle, driving_speed(memory), now.mono
    )
    if memory.watch.driven and memory.stop.said is motion.TRUE:
        memory.stop = estop.NOTHING  # a motor that is driven is not stopped, whatever was said before


def param_value(memory: Memory, message: mav.ParamValue, now: Instant, options: HardwareOptions) -> None:
    """PARAM_VALUE: SERVOn_FUNCTION says which outputs drive motors, RCn_OPTION what the switches do."""
    found, value = _NUMBERED.fullmatch(message.param_id.split(b"\0")[0]), message.param_value
    if found is None or not math.isfinite(value) or memory.stack is not ARDUPILOT:
        return
    channel = int(found[1] or found[2])
    if not 1 <= channel <= 32:
        return
    if found[1]:
        memory.watch.name({**memory.watch.functions, channel: int(value)})
    else:
        memory.switches = {**memory.switches, channel: int(value)}


def esc_telemetry(memory: Memory, message: Any, now: Instant, options: HardwareOptions) -> None:
    """ESC_TELEMETRY_n (ArduPilot): four motors."""
    _turning(memory, message, unpack("<4H", message.rpm), now)


def esc_status(memory: Memory, message: mav.EscStatus, now: Instant, options: HardwareOptions) -> None:
    """ESC_STATUS (PX4): four motors."""
    _turning(memory, message, unpack("<4i", message.rpm), now)


def _turning(memory: Memory, message: Any, rpm: tuple[int, ...], now: Instant) -> None:
    seen = memory.observation
    if any(rpm):
        seen.esc = heard(message, now.mono, seen.esc)
    elif seen.esc is not None and type(seen.esc.message) is type(message):
        seen.esc = None
