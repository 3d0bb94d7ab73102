"""in_motion: airborne, or moving or turning by measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ....mavlink.enumerations import MAV_LANDED_STATE_ON_GROUND, MAV_LANDED_STATE_UNDEFINED, MAV_STATE_STANDBY
from ..identity import AIRCRAFT, IN_THE_AIR
from .reason import FALSE, TRUE, UNKNOWN, Finding, Reason, Source

if TYPE_CHECKING:
    from ..facts import Facts
    from ..options import HardwareOptions


def in_motion(facts: Facts, options: HardwareOptions) -> Finding:
    """Airborne, or moving or turning by measurement."""
    aircraft = facts.kind.vehicle_type in AIRCRAFT
    landed = facts.landed_state if facts.fresh.landed_state else MAV_LANDED_STATE_UNDEFINED
    on_ground = aircraft and landed == MAV_LANDED_STATE_ON_GROUND
    if facts.armed and aircraft and landed in IN_THE_AIR and options.hover_is_motion:
        if facts.lies and _is_still(facts):
            return FALSE, Reason("it reports airborne, but is at rest since it had no thrust", Source.LANDED_NUMBER)
        if facts.has_no_lift and _is_still(facts):
            return UNKNOWN, Reason("airborne, but not moving, and without the throttle to fly", Source.LANDED_NUMBER)
        return TRUE, Reason("airborne", Source.LANDED_NUMBER)
    value, why = _measured(facts, on_ground)
    if why.source is Source.NONE:
        return value, why
    if value is UNKNOWN and facts.movement.value is UNKNOWN and _rests(facts, on_ground):
        value = FALSE
    if value is FALSE and facts.armed and aircraft and landed == MAV_LANDED_STATE_UNDEFINED and not _is_landed(facts):
        source = Source.VELOCITY if why.source is Source.VELOCITY else Source.NONE
        return UNKNOWN, Reason("armed, and nothing shows whether it is airborne", source)
    return value, why


def _measured(facts: Facts, on_ground: bool) -> Finding:
    """The estimate, else the land detector, else the GPS receiver, which can only show rest."""
    if facts.fresh.velocity is not None and facts.movement.is_measured:
        if facts.movement.moves_disarmed and facts.fresh.global_position and _receiver_stands(facts):
            # seen after a crash: the estimate ran away at 36 m/s while the vehicle lay on its back
            rule = "disarmed: the estimate moves, the GPS receiver stands still"
            return UNKNOWN, Reason(rule, Source.VELOCITY)
        return facts.movement.value, Reason("speed and rotation, with hysteresis", Source.VELOCITY)
    if facts.turns:
        return TRUE, Reason("it turns, no speed known", Source.ATTITUDE)
    if on_ground:
        return FALSE, Reason("on the ground, no speed known", Source.LANDED_STATE)
    if _receiver_stands(facts):
        return FALSE, Reason("no estimate, but the GPS receiver stands still", Source.GPS)
    return UNKNOWN, Reason("no fresh speed")


def _rests(facts: Facts, on_ground: bool) -> bool:
    """Whether something else shows rest while the estimate does not decide."""
    movement = facts.movement
    if movement.is_slow and on_ground and not facts.armed:
        return True
    # a disarmed vehicle below the upper thresholds: an estimate that has just begun is off by some 0.1 m/s
    return (movement.is_slow or not (movement.is_fast or facts.armed)) and _receiver_stands(facts)


def _is_still(facts: Facts) -> bool:
    """Whether the estimate shows rest."""
    return facts.fresh.velocity is not None and facts.movement.is_measured and facts.movement.value is FALSE


def _receiver_stands(facts: Facts) -> bool:
    """Whether the speed of the GPS receiver shows rest, without rotation. At rest it may read several m/s."""
    return facts.fresh.gps and facts.receiver_stands


def _is_landed(facts: Facts) -> bool:
    """Whether the autopilot's land detector reports landed."""
    return facts.kind.profile.states.standby_is_landed and facts.heartbeat.system_status == MAV_STATE_STANDBY
