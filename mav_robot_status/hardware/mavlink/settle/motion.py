"""Motion: by speed and rotation, and whether an aircraft lies on the ground."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ..facts import (
    Movement,
)
from ..identity import AIRCRAFT, IN_THE_AIR
from ..state import (
    lift,
    outputs,
)
from ..state.estimator import denied_until
from ..state.latest_messages import FRESH
from ..state.motion import SUSTAIN_OFF, SUSTAIN_ON
from ..state.speeds import speed_over_ground
from ..state.vehicle_state import is_multicopter

if TYPE_CHECKING:
    from ..moment import Moment
    from ..options import HardwareOptions
    from ..state.motion import Motion
    from ..state.vehicle_state import VehicleState

SAMPLED: Final = 2.0
"""Seconds for which a sample shows rest. It does not show how a vehicle moves after it."""
TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
new: Final = tuple.__new__  # as in `framing`


def settled(motion: Motion, moment: Moment) -> TriState:
    """The value of a motion without a further sample."""
    value = motion.value
    if motion.fast_since is not None:
        return TRUE if value is TRUE or moment.has_come(motion.fast_since + SUSTAIN_ON) else value
    if motion.slow_since is not None:
        return FALSE if value is FALSE or moment.has_come(motion.slow_since + SUSTAIN_OFF) else value
    return value


def movement(state: VehicleState, moment: Moment, options: HardwareOptions) -> Movement:
    """The motion according to speed and rotation."""
    motion = state.motion
    value = settled(motion, moment)
    if value is FALSE and not moment.is_within(motion.at + SAMPLED):
        value = UNKNOWN
    moves_disarmed = (
        value is TRUE and not state.heartbeats.armed and speed_over_ground(state.latest) > options.v_on_disarmed
    )
    is_slow = value is UNKNOWN and motion.slow_since is not None
    is_fast = value is UNKNOWN and motion.fast_since is not None
    return new(Movement, (value, is_slow, is_fast, motion.speed is not None, moves_disarmed))


def receiver_stands(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether the GPS receiver reports that it stands still."""
    return settled(state.gps_motion, moment) is FALSE


def turns(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether it turns. This is unknown while the estimator itself says that it is wrong."""
    return (
        settled(state.rotation, moment) is TRUE
        and moment.is_fresh(state.latest.attitude, FRESH)
        and moment.has_come(denied_until(state))
    )


def has_no_lift(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether an aircraft in the air has no throttle that carries it: a hover needs more."""
    heard, hud, watch = state.latest.extended_sys_state, state.latest.vfr_hud, state.watch
    if heard is None or heard.message.landed_state not in IN_THE_AIR or state.vehicle_type not in AIRCRAFT:
        return False
    if hud is not None and hud.message.throttle < lift.LEAST_LIFT and moment.is_fresh(hud, FRESH):
        return True
    named = not outputs.channels(watch, state.vehicle_type)[1]
    at_stop = named and watch.at is not None and outputs.is_at_stop(watch, state.vehicle_type)
    return at_stop and watch.at is not None and moment.is_within(watch.at + FRESH)


def lies(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether a multicopter has not moved since it lay on the ground for certain."""
    return state.lift.lay_at is not None and lift.lies(state.lift, state.motion) and is_multicopter(state)
