"""in_motion: airborne, or moving or turning by measurement."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ....mavlink.enumerations import MAV_LANDED_STATE_ON_GROUND, MAV_LANDED_STATE_UNDEFINED, MAV_STATE_STANDBY
from ..estop import outputs
from ..facts import Movement
from ..identity import AIRCRAFT, IN_THE_AIR
from ..reason import FALSE, TRUE, UNKNOWN, Finding, Reason, at, nothing, words
from ..state import FRESH, is_multicopter
from . import lift
from .estimate import denied_until, speed_over_ground
from .state import SUSTAIN_OFF, SUSTAIN_ON

if TYPE_CHECKING:
    from ..facts import Deadline, Facts
    from ..options import HardwareOptions
    from ..reason import Reason, Shown
    from ..state import VehicleState
    from .state import Motion

# -- facts -------------------------------------------------------------------------------------------------------------


SAMPLED: Final = 2.0
"""Seconds for which a sample shows rest. It does not show how a vehicle moves after it."""


def settled(motion: Motion, deadline: Deadline) -> TriState:
    """The value of a motion without a further sample."""
    value = motion.value
    if motion.fast_since is not None:
        return TRUE if value is TRUE or deadline.has_come(motion.fast_since + SUSTAIN_ON) else value
    if motion.slow_since is not None:
        return FALSE if value is FALSE or deadline.has_come(motion.slow_since + SUSTAIN_OFF) else value
    return value


def movement(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Movement:
    """The motion according to speed and rotation."""
    motion = state.motion
    value = settled(motion, deadline)
    if value is FALSE and not deadline.is_within(motion.at + SAMPLED):
        value = UNKNOWN
    moves_disarmed = (
        value is TRUE and not state.heartbeats.armed and speed_over_ground(state.latest) > options.v_on_disarmed
    )
    is_slow = value is UNKNOWN and motion.slow_since is not None
    is_fast = value is UNKNOWN and motion.fast_since is not None
    return Movement(value, is_slow, is_fast, motion.speed is not None, moves_disarmed)


def receiver_stands(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether the GPS receiver reports that it stands still."""
    return settled(state.gps_motion, deadline) is FALSE


def turns(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether it turns. This is unknown while the estimator itself says that it is wrong."""
    return (
        settled(state.rotation, deadline) is TRUE
        and deadline.is_fresh(state.latest.attitude, FRESH)
        and deadline.has_come(denied_until(state))
    )


def has_no_lift(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether an aircraft in the air has no throttle that carries it: a hover needs more."""
    heard, hud, watch = state.latest.extended_sys_state, state.latest.vfr_hud, state.watch
    if heard is None or heard.message.landed_state not in IN_THE_AIR or state.vehicle_type not in AIRCRAFT:
        return False
    if hud is not None and hud.message.throttle < lift.LEAST_LIFT and deadline.is_fresh(hud, FRESH):
        return True
    named = not outputs.channels(watch, state.vehicle_type)[1]
    at_stop = named and watch.at is not None and outputs.is_at_stop(watch, state.vehicle_type)
    return at_stop and watch.at is not None and deadline.is_within(watch.at + FRESH)


def lies(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> bool:
    """Whether a multicopter has not moved since it lay on the ground for certain."""
    return state.lift.lay_at is not None and lift.lies(state.lift, state.motion) and is_multicopter(state)


# -- evidence in words -------------------------------------------------------------------------------------------------


landed_state_words: Final = words("EXTENDED_SYS_STATE.landed_state", "extended_sys_state")
landed_number_words: Final = words("EXTENDED_SYS_STATE.landed_state {facts.landed_state}", "extended_sys_state")


def velocity_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The speed, and the message that gives it."""
    latest, name = state.latest, facts.fresh.velocity
    heard = {"GLOBAL_POSITION_INT": latest.global_position, "LOCAL_POSITION_NED": latest.local_position}
    return f"{name}: {state.motion.speed or 0.0:.2f} m/s", at(heard.get(name or "", latest.vfr_hud))


gps_words: Final = words("GPS_RAW_INT.vel", "gps")
attitude_words: Final = words("ATTITUDE: {state.turning:.2f} rad/s", "attitude")


# -- the rule ----------------------------------------------------------------------------------------------------------


def in_motion(facts: Facts, options: HardwareOptions) -> Finding:
    """Airborne, or moving or turning by measurement."""
    aircraft = facts.kind.vehicle_type in AIRCRAFT
    landed = facts.landed_state if facts.fresh.landed_state else MAV_LANDED_STATE_UNDEFINED
    on_ground = aircraft and landed == MAV_LANDED_STATE_ON_GROUND
    if facts.armed and aircraft and landed in IN_THE_AIR and options.hover_is_motion:
        if facts.lies and _is_still(facts):
            return FALSE, Reason("it reports airborne, but is at rest since it had no thrust", landed_number_words)
        if facts.has_no_lift and _is_still(facts):
            return UNKNOWN, Reason("airborne, but not moving, and without the throttle to fly", landed_number_words)
        return TRUE, Reason("airborne", landed_number_words)
    value, why = _measured(facts, on_ground)
    if why.words is nothing:
        return value, why
    if value is UNKNOWN and facts.movement.value is UNKNOWN and _rests(facts, on_ground):
        value = FALSE
    if value is FALSE and facts.armed and aircraft and landed == MAV_LANDED_STATE_UNDEFINED and not _is_landed(facts):
        source = velocity_words if why.words is velocity_words else nothing
        return UNKNOWN, Reason("armed, and nothing shows whether it is airborne", source)
    return value, why


def _measured(facts: Facts, on_ground: bool) -> Finding:
    """The estimate, else the land detector, else the GPS receiver, which can only show rest."""
    if facts.fresh.velocity is not None and facts.movement.is_measured:
        if facts.movement.moves_disarmed and facts.fresh.global_position and _receiver_stands(facts):
            # seen after a crash: the estimate ran away at 36 m/s while the vehicle lay on its back
            rule = "disarmed: the estimate moves, the GPS receiver stands still"
            return UNKNOWN, Reason(rule, velocity_words)
        return facts.movement.value, Reason("speed and rotation, with hysteresis", velocity_words)
    if facts.turns:
        return TRUE, Reason("it turns, no speed known", attitude_words)
    if on_ground:
        return FALSE, Reason("on the ground, no speed known", landed_state_words)
    if _receiver_stands(facts):
        return FALSE, Reason("no estimate, but the GPS receiver stands still", gps_words)
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
