"""Position, speed and attitude, and the clock in those messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from ....mavlink import definitions as mav
from ....mavlink.enumerations import EKF_ATTITUDE, EKF_CONST_POS_MODE, GPS_FIX_TYPE_3D_FIX, MAV_TYPE_SURFACE_BOAT
from ..autopilots.profile import HudSpeed, ZeroSpeed
from ..faults import sensors
from ..identity import AIRCRAFT, ROVER
from ..state import FRESH, Heard, heard, is_fresh, is_multicopter
from . import state as motion
from .estimate import FRESH as ESTIMATOR_FRESH
from .estimate import denied_until
from .lift import IDLE, heard_throttle

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state import VehicleState

NO_SPEED: Final = 0xFFFF  # GPS_RAW_INT.vel
# Module constants for code that runs many times a second: Python 3.11 is slow to look up a member of an enumeration.
ALWAYS, ESTIMATOR_HEALTHY = ZeroSpeed.ALWAYS, ZeroSpeed.ESTIMATOR_HEALTHY
MOTION_ONLY, REST_WITH_GPS = HudSpeed.MOTION_ONLY, HudSpeed.REST_WITH_GPS


def extended_sys_state(state: VehicleState, message: Any, now: Instant, options: HardwareOptions) -> None:
    """EXTENDED_SYS_STATE: the landed state."""
    seen = state.latest
    seen.extended_sys_state = heard(message, now.mono, seen.extended_sys_state)


def global_position(
    state: VehicleState, message: mav.GlobalPositionInt, now: Instant, options: HardwareOptions
) -> None:
    """GLOBAL_POSITION_INT: the first choice for speed."""
    at = now.mono
    seen = state.latest
    seen.global_position = heard(message, at, seen.global_position)
    vx, vy, vz = message.vx, message.vy, message.vz
    still = not (vx or vy or (vz and state.family is not ROVER))
    nowhere = message.lat == 0 and message.lon == 0
    speed = _speed(state, vx / 100, vy / 100, vz / 100, still, nowhere, at, options)
    _moved(state, state.motion, speed, at, options)


def local_position(state: VehicleState, message: mav.LocalPositionNed, now: Instant, options: HardwareOptions) -> None:
    """LOCAL_POSITION_NED: the speed while no global position is fresh."""
    at = now.mono
    seen = state.latest
    seen.local_position = heard(message, at, seen.local_position)
    if is_fresh(seen.global_position, at, FRESH):
        return
    vx, vy, vz = message.vx, message.vy, message.vz
    still = not (vx or vy or (vz and state.family is not ROVER))
    speed = _speed(state, vx, vy, vz, still, False, at, options)
    _moved(state, state.motion, speed, at, options)


def vfr_hud(state: VehicleState, message: mav.VfrHud, now: Instant, options: HardwareOptions) -> None:
    """VFR_HUD: the last choice for speed; the throttle is for the output watch."""
    at = now.mono
    seen = state.latest
    throttle, lift = message.throttle, state.lift
    seen.vfr_hud = heard(message, at, seen.vfr_hud)
    if (throttle < IDLE or lift.idle_since is not None) and is_multicopter(state):
        heard_throttle(lift, throttle, state.motion, at)
    if is_fresh(seen.global_position, at, FRESH) or is_fresh(seen.local_position, at, FRESH):
        return
    still = message.groundspeed == 0  # not the climb, which comes from the barometer
    speed = _speed(state, message.groundspeed, 0.0, message.climb, still, False, at, options)
    hud = state.profile.speeds.hud
    if speed is None:
        pass
    elif hud is MOTION_ONLY:
        speed = _if_fast(state, speed, options)
    elif hud is REST_WITH_GPS and still and state.vehicle_type not in AIRCRAFT and not _has_gps(seen.sys_status):
        speed = None
    _moved(state, state.motion, speed, at, options)


def gps_raw_int(state: VehicleState, message: mav.GpsRawInt, now: Instant, options: HardwareOptions) -> None:
    """GPS_RAW_INT: whether the receiver reports that it stands still."""
    if message.fix_type < GPS_FIX_TYPE_3D_FIX or message.vel == NO_SPEED:
        state.gps_motion = motion.Motion()
        return
    at = now.mono
    seen = state.latest
    seen.gps = heard(message, at, seen.gps)
    _moved(state, state.gps_motion, message.vel / 100, at, options)


def attitude(state: VehicleState, message: mav.Attitude, now: Instant, options: HardwareOptions) -> None:
    """ATTITUDE: rotation."""
    at = now.mono
    seen = state.latest
    seen.attitude = heard(message, at, seen.attitude)
    if state.vehicle_type == MAV_TYPE_SURFACE_BOAT:  # they always roll
        turning = fastest(message.yawspeed)
    else:
        turning = fastest(message.yawspeed, message.rollspeed, message.pitchspeed)
    state.turning = turning
    motion.moved(state.rotation, 0.0, turning, state.heartbeats.armed, options, at)


def ekf_status_report(
    state: VehicleState, message: mav.EkfStatusReport, now: Instant, options: HardwareOptions
) -> None:
    """EKF_STATUS_REPORT: whether the position is measured, or the estimator assumes that the vehicle stands still."""
    flags = message.flags
    state.unaided, state.unaided_at = bool(flags & EKF_CONST_POS_MODE), now.mono
    state.tilted = bool(flags) and not flags & EKF_ATTITUDE  # no flags: another estimator is in use


def _speed(
    state: VehicleState, x: float, y: float, z: float, still: bool, nowhere: bool, now: float, options: HardwareOptions
) -> float | None:
    """Speed in m/s, None where the numbers mean that there is no estimate: `still` exactly zero, `nowhere` at 0, 0."""
    if not -math.inf < x + y + z < math.inf:
        return None
    speed = math.hypot(x, y) if state.family is ROVER else math.hypot(x, y, z)
    status = state.latest.sys_status
    speeds = state.profile.speeds
    if still and speeds.zero is not ALWAYS and not _counts_as_rest(speeds.zero, status, nowhere, now, options):
        return None
    if not state.heartbeats.armed and now < denied_until(state):
        return None
    return _measured(state, speed, z, nowhere, now, options) if speeds.reports_estimator else speed


def _counts_as_rest(zero: ZeroSpeed, status: Heard | None, nowhere: bool, now: float, options: HardwareOptions) -> bool:
    """Whether a speed of exactly zero is an estimate."""
    if not is_fresh(status, now, options.sys_status_timeout):
        return False
    if zero is ESTIMATOR_HEALTHY:
        return not nowhere and status is not None and sensors.estimate_is_healthy(status.message)
    return _has_gps(status)


def _measured(
    state: VehicleState, speed: float, climb: float, nowhere: bool, now: float, options: HardwareOptions
) -> float | None:
    """The measured part of `speed`: without a position the estimator reports nearly zero at any speed.

    Then only the climb, from air or water pressure, is measured. It can prove motion, but not rest.
    """
    if now - state.unaided_at > ESTIMATOR_FRESH:
        return _if_fast(state, speed, options) if nowhere else speed
    if not state.unaided:
        return speed
    return None if state.family is ROVER else _if_fast(state, abs(climb), options)


def _if_fast(state: VehicleState, speed: float, options: HardwareOptions) -> float | None:
    """`speed` if it shows motion; None if it would show rest."""
    return speed if speed > (options.v_on if state.heartbeats.armed else options.v_on_disarmed) else None


def _has_gps(status: Heard | None) -> bool:
    return status is not None and bool(
        status.message.onboard_control_sensors_present & status.message.onboard_control_sensors_health & sensors.GPS
    )


def fastest(yaw: float, roll: float = 0.0, pitch: float = 0.0) -> float:
    """The greatest magnitude of some rates. Rates that are not finite are ignored."""
    found = abs(yaw)
    if roll > found or -roll > found:
        found = abs(roll)
    if pitch > found or -pitch > found:
        found = abs(pitch)
    if found < math.inf:
        return found
    return max(abs(rate) if math.isfinite(rate) else 0.0 for rate in (yaw, roll, pitch))


def _moved(
    state: VehicleState, moving: motion.Motion, speed: float | None, now: float, options: HardwareOptions
) -> None:
    """Process one more sample of speed."""
    seen = state.latest.attitude
    is_recent = seen is not None and (now <= seen.at + FRESH or is_fresh(seen, now, FRESH))  # seldom needs the call
    rotation = state.turning if is_recent else 0.0
    motion.moved(moving, speed, rotation, state.heartbeats.armed, options, now)
