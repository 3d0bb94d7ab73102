"""in_motion: airborne, or moving or turning by measurement; `motion` has the hysteresis."""

from __future__ import annotations

from typing import Final

from ...interface.status import Evidence
from .. import motion
from ..hearing.movement import speed_over_ground
from ..identity import AIRCRAFT, ARDUPILOT
from ..observation import is_fresh
from .view import FALSE, STANDBY, TRUE, UNKNOWN, Finding, View

UNDEFINED, ON_GROUND = 0, 1  # MAV_LANDED_STATE
IN_THE_AIR: Final = frozenset({2, 3, 4})


def in_motion(view: View) -> Finding:
    """Airborne, or moving or turning by measurement."""
    memory, now = view.memory, view.now
    aircraft = memory.vehicle_type in AIRCRAFT
    landed = memory.observation.extended_sys_state
    landed_state = UNDEFINED
    landed_at = None
    if landed is not None and is_fresh(landed, now, motion.FRESH):
        landed_state, landed_at = landed.message.landed_state, landed.at
    if view.armed and aircraft and landed_state in IN_THE_AIR and view.options.hover_is_motion:
        return TRUE, Evidence("airborne", f"EXTENDED_SYS_STATE.landed_state {landed_state}", landed_at)
    source, at = _velocity_source(view)
    slow = memory.motion.slow_since is not None
    if source is not None:
        value = motion.settled(memory.motion, now)
        why = Evidence("speed and rotation, with hysteresis", source, at)
        if value is TRUE and not view.armed and _gps_contradicts(view):
            # seen after a crash: the estimate ran away at 36 m/s while the vehicle lay on its back
            return UNKNOWN, Evidence("disarmed: the estimate moves, the GPS receiver stands still", source, at)
    elif aircraft and landed_state == ON_GROUND:
        value = FALSE
        why = Evidence("on the ground, no speed known", "EXTENDED_SYS_STATE.landed_state", landed_at)
    elif memory.observation.gps is not None and _gps_stands_still(view):
        value = FALSE
        why = Evidence("no estimate, but the GPS receiver stands still", "GPS_RAW_INT.vel", memory.observation.gps.at)
    else:
        return UNKNOWN, Evidence("no fresh speed")
    if value is UNKNOWN and slow:
        # not slow for long enough, but the land detector agrees, or the receiver, which has stood still for long enough
        landed_disarmed = aircraft and landed_state == ON_GROUND and not view.armed
        value = FALSE if landed_disarmed or _gps_stands_still(view) else UNKNOWN
    if value is FALSE and view.armed and aircraft and landed_state == UNDEFINED and not _on_ground(view):
        return UNKNOWN, Evidence("armed, and nothing tells whether it is airborne", source, at)
    return value, why


def _gps_stands_still(view: View) -> bool:
    """True if the receiver's own speed says rest (and nothing rotates).

    It is believed for nothing else: at rest it may read several m/s.
    """
    memory = view.memory
    fresh = is_fresh(memory.observation.gps, view.now, motion.FRESH)
    return fresh and motion.settled(memory.gps_motion, view.now) is FALSE


def _gps_contradicts(view: View) -> bool:
    """True if the estimate has a speed over ground and the GPS receiver has none."""
    position = view.memory.observation.global_position
    if position is None or not is_fresh(position, view.now, motion.FRESH) or not _gps_stands_still(view):
        return False
    return speed_over_ground(view.memory) > view.options.v_on_disarmed


def _on_ground(view: View) -> bool:
    """ArduPilot's STANDBY: its own land detector says landed."""
    return view.memory.stack is ARDUPILOT and view.state == STANDBY


def _velocity_source(view: View) -> tuple[str | None, float | None]:
    """The message that gives the speed now, in the order of preference."""
    observation = view.memory.observation
    speed = view.memory.motion.speed
    if speed is None:
        return None, None  # the latest sample said that there is no estimate
    for name, heard in (
        ("GLOBAL_POSITION_INT", observation.global_position),
        ("LOCAL_POSITION_NED", observation.local_position),
        ("VFR_HUD", observation.vfr_hud),
    ):
        if heard is not None and is_fresh(heard, view.now, motion.FRESH):
            return f"{name}: {speed:.2f} m/s", heard.at
    return None, None
