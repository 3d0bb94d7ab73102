"""Emergency stops and motor outputs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ..facts import (
    Applet,
    Outputs,
    Stop,
)
from ..state import applet as applets
from ..state import (
    estop,
    outputs,
)
from ..state.latest_messages import FRESH
from ..state.speeds import hud_speeds
from ..state.vehicle_state import honours_stop, vtol_state

if TYPE_CHECKING:
    from ..moment import Moment
    from ..options import HardwareOptions
    from ..state.vehicle_state import VehicleState

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
new: Final = tuple.__new__  # as in `framing`

NO_OUTPUTS: Final = Outputs(False, False, False, False, False)
NOTHING_SAID: Final = Stop(UNKNOWN, None, False, None, False)
NO_APPLET: Final = Applet(UNKNOWN, False, False)


def motor_outputs(state: VehicleState, moment: Moment, options: HardwareOptions) -> Outputs:
    """The state of the motor outputs of an armed vehicle."""
    watch = state.watch
    if watch.at is None or not state.heartbeats.armed:
        return NO_OUTPUTS
    proves = outputs.proves_stop(state.family, state.vehicle_type, vtol_state(state))
    at_stop = state.latest.esc is not None and outputs.is_at_stop(watch, state.vehicle_type)
    fresh = moment.is_within(watch.at + FRESH)
    return Outputs(fresh, watch.driven, watch.held and proves, at_stop, watch.idle and proves)


def outputs_vetoed(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether a motion shows that the vehicle is driven although the outputs seem held."""
    watch = state.watch
    if watch.held_since is None:
        return False
    speed, climb = hud_speeds(state.latest)
    turning = state.turning if moment.is_fresh(state.latest.attitude, FRESH) else math.inf
    return outputs.is_vetoed(watch, state.family, state.vehicle_type, speed, climb, turning)


def esc_turning(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether ESC telemetry shows a motor that turns."""
    return moment.is_fresh(state.latest.esc, FRESH)


def stop(state: VehicleState, moment: Moment, options: HardwareOptions) -> Stop:
    """What the autopilot has reported about an emergency stop."""
    said, word, doubt = state.stop, state.applet, state.stop.doubt
    if word is not None and applets.stops(word, honours_stop(state)) and not moment.is_within(word.at + applets.FRESH):
        doubt = doubt or estop.APPLET_SILENT
    elif said is estop.NOTHING and not state.unexplained:
        return NOTHING_SAID
    is_over = said.repeats and moment.has_come(said.last + estop.REPEATED)
    if said.lost_at is not None and moment.has_come(said.lost_at + estop.OUTLASTS_LOSS):
        is_over = True
        doubt = doubt or (estop.FRAMES_LOST if said.said is TRUE else None)
    value = UNKNOWN if is_over else said.said
    return Stop(value, said.text, said.ready >= estop.READY_MESSAGES, doubt, state.unexplained)


def applet(state: VehicleState, moment: Moment, options: HardwareOptions) -> Applet:
    """The word of the applet on the autopilot."""
    word = state.applet
    if word is None or not moment.is_within(word.at + applets.FRESH):
        return NO_APPLET
    if not applets.stops(word, honours_stop(state)):
        return new(Applet, (UNKNOWN if word.value else FALSE, False, True))
    since, watched_at = word.driven_since, state.watch.at
    driven = since is not None and watched_at is not None and moment.is_within(watched_at + FRESH)
    return new(Applet, (TRUE, driven and moment.has_come((since or 0.0) + applets.CONTRADICTED), True))


def stop_switch(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether an RC switch that stops the motors is in its stop position."""
    return moment.is_within(state.stop_switch_at + FRESH)


def stop_excused(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether a switch exists whose stop the pre-arm checks ignore."""
    return estop.is_excused(state.switches)


def assumed_free(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether no stop was engaged when it was armed."""
    return state.assumed_free
