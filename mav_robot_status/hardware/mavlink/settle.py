"""Settles the facts of a vehicle, from its state, the options and a `Moment`.

Each field of `Facts` has its function here, in `SETTLE`. They are short, because some run for every message.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from ...interface.status import TriState
from ...mavlink.enumerations import MAV_LANDED_STATE_UNDEFINED, MAV_STANDARD_MODE_NON_STANDARD
from .autopilots.modes import ModeHints
from .autopilots.sensor_weights import SOFT
from .facts import (
    Applet,
    Cause,
    Claimed,
    Explained,
    Facts,
    Fresh,
    Kind,
    Latched,
    Movement,
    Outputs,
    SensorFault,
    Stop,
    SystemStatus,
)
from .identity import AIRCRAFT, IN_THE_AIR
from .state import applet as applets
from .state import estop, latches, outputs, sensors, text_assembly
from .state.boot_clock import GRACE
from .state.claims import HOLD, LIVE, NEVER
from .state.estimator import denied_until
from .state.latest_messages import FRESH
from .state.motion import SUSTAIN_OFF, SUSTAIN_ON
from .state.speeds import hud_speeds, speed_over_ground
from .state.vehicle_state import honours_stop, vtol_state

if TYPE_CHECKING:
    from ...mavlink.definitions import Heartbeat
    from .moment import Moment
    from .options import HardwareOptions
    from .state.motion import Motion
    from .state.vehicle_state import VehicleState

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
new: Final = tuple.__new__  # as in `framing`

CURRENT_MODE_FRESH: Final = 5.0
"""Seconds for which a CURRENT_MODE is valid."""
TOGETHER: Final = 5.0
"""Seconds between a loss of RC and a failsafe that it explains."""

LEAST_LIFT: Final = 10
"""VFR_HUD.throttle in percent below which no aircraft hovers."""

NO_OUTPUTS: Final = Outputs(False, False, False, False)
NOTHING_SAID: Final = Stop(UNKNOWN, None, False, None)
NO_APPLET: Final = Applet(UNKNOWN, False, False)
NO_SYS_STATUS: Final = SystemStatus(False, False, UNKNOWN, None, False)
NOTHING_LATCHED: Final = Latched((), False, False)
NO_HINTS: Final = ModeHints()
UNDISPUTED: Final = Claimed(None, False, False, False, False)
DOUBTED: Final = UNDISPUTED._replace(doubted=True)


def kind(state: VehicleState, moment: Moment, options: HardwareOptions) -> Kind:
    """The kind of vehicle."""
    told = state.firmware
    return Kind(state.profile, state.family, state.vehicle_type, state.autopilot, told and told.firmware)


def heartbeat(state: VehicleState, moment: Moment, options: HardwareOptions) -> Heartbeat:
    """The latest heartbeat."""
    seen = state.latest.heartbeat
    assert seen is not None  # a state begins with a heartbeat
    message: Heartbeat = seen.message
    return message


def state_since(state: VehicleState, moment: Moment, options: HardwareOptions) -> int:
    """When it entered its MAV_STATE."""
    return state.heartbeats.state_since.unix_us


def fresh(state: VehicleState, moment: Moment, options: HardwareOptions) -> Fresh:
    """Which messages are recent enough to be used."""
    latest, is_fresh = state.latest, moment.is_fresh
    velocity = None
    for name, heard in (
        ("GLOBAL_POSITION_INT", latest.global_position),
        ("LOCAL_POSITION_NED", latest.local_position),
        ("VFR_HUD", latest.vfr_hud),
    ):
        if is_fresh(heard, FRESH):
            velocity = name
            break
    return Fresh(
        latest.heartbeat is not None and moment.is_within(latest.heartbeat.at + options.heartbeat_timeout),
        is_fresh(latest.sys_status, options.sys_status_timeout),
        is_fresh(latest.extended_sys_state, FRESH),
        velocity,
        velocity == "GLOBAL_POSITION_INT",
        is_fresh(latest.gps, FRESH),
    )


def landed_state(state: VehicleState, moment: Moment, options: HardwareOptions) -> int:
    """MAV_LANDED_STATE of the latest EXTENDED_SYS_STATE."""
    heard = state.latest.extended_sys_state
    return MAV_LANDED_STATE_UNDEFINED if heard is None else heard.message.landed_state


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
    moves_disarmed = (
        value is TRUE and not state.heartbeats.armed and speed_over_ground(state.latest) > options.v_on_disarmed
    )
    is_slow = value is UNKNOWN and motion.slow_since is not None
    return new(Movement, (value, is_slow, motion.speed is not None, moves_disarmed))


def receiver_stands(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether the GPS receiver reports that it stands still."""
    return settled(state.gps_motion, moment) is FALSE


def turns(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether it turns. The estimator's own word against it makes that unknown."""
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
    if hud is not None and hud.message.throttle < LEAST_LIFT and moment.is_fresh(hud, FRESH):
        return True
    named = not outputs.channels(watch, state.vehicle_type)[1]
    at_stop = named and watch.at is not None and outputs.is_at_stop(watch, state.vehicle_type)
    return at_stop and watch.at is not None and moment.is_within(watch.at + FRESH)


def motor_outputs(state: VehicleState, moment: Moment, options: HardwareOptions) -> Outputs:
    """The state of the motor outputs of an armed vehicle."""
    watch = state.watch
    if watch.at is None or not state.heartbeats.armed:
        return NO_OUTPUTS
    held = (
        watch.held_since is not None
        and moment.has_come(watch.held_since + outputs.HOLD)
        and outputs.proves_stop(state.family, state.vehicle_type, vtol_state(state))
    )
    at_stop = state.latest.esc is not None and outputs.is_at_stop(watch, state.vehicle_type)
    return new(Outputs, (moment.is_within(watch.at + FRESH), watch.driven, held, at_stop))


def outputs_vetoed(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether a motion shows that the vehicle is driven although the outputs seem held."""
    watch = state.watch
    if watch.held_since is None:
        return False
    speed, climb = hud_speeds(state.latest)
    return outputs.is_vetoed(watch, state.family, state.vehicle_type, speed, climb, state.turning)


def esc_turning(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether ESC telemetry shows a motor that turns."""
    return moment.is_fresh(state.latest.esc, FRESH)


def stop(state: VehicleState, moment: Moment, options: HardwareOptions) -> Stop:
    """What the autopilot has reported about an emergency stop."""
    said, word, doubt = state.stop, state.applet, state.stop.doubt
    if word is not None and applets.stops(word, honours_stop(state)) and not moment.is_within(word.at + applets.FRESH):
        doubt = doubt or estop.APPLET_SILENT
    elif said is estop.NOTHING:
        return NOTHING_SAID
    is_over = said.repeats and moment.has_come(said.last + estop.REPEATED)
    value = UNKNOWN if is_over else said.said
    return new(Stop, (value, said.text, said.ready >= estop.READY_MESSAGES, doubt))


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


def sys_status(state: VehicleState, moment: Moment, options: HardwareOptions) -> SystemStatus:
    """The contents of the latest SYS_STATUS."""
    heard, lost, errors = state.latest.sys_status, state.rc_lost_since, state.internal_errors_since
    if heard is None:
        return NO_SYS_STATUS
    message, profile, heartbeats = heard.message, state.profile, state.heartbeats
    switch = profile.sensors.has_safety_switch and sensors.safety_switch_on(message)
    outdated = switch and heartbeats.armed and (message is state.armed_after or not moment.is_within(heard.at + FRESH))
    return new(
        SystemStatus,
        (
            switch and not outdated,
            outdated,
            sensors.readiness(message, profile),
            None if errors is None else errors.unix_us,
            lost is not None and abs(lost.mono - state.heartbeats.state_since.mono) <= TOGETHER,
        ),
    )


def faults(state: VehicleState, moment: Moment, options: HardwareOptions) -> tuple[SensorFault, ...]:
    """The bits that have been faulty for long enough, some time after the boot."""
    if not state.faults or not moment.has_come(state.boot.at + GRACE):
        return ()
    return tuple(
        SensorFault(bit, weight is SOFT, fault.since.unix_us)
        for bit, weight, fault in state.counting_faults(options)
        if fault.messages >= sensors.DEBOUNCE_MESSAGES or moment.has_come(fault.since.mono + sensors.DEBOUNCE_SECONDS)
    )


def latched(state: VehicleState, moment: Moment, options: HardwareOptions) -> Latched:
    """The causes that were announced and are still active."""
    if not state.latches and state.failsafe_cleared is None:
        return NOTHING_LATCHED
    errors = state.error_bits(options) if moment.is_fresh(state.latest.sys_status, options.sys_status_timeout) else ()
    lasting = tuple(
        Cause(code, latch.text, latch.since.unix_us)
        for code, latch in state.latches.items()
        if not moment.has_come(latches.ends_at(code, latch, state.heartbeats, errors, options.text_hold_s))
    )
    seen = state.latest.heartbeat
    outlived = seen is not None and latches.has_outlived_termination(state.latches, state.heartbeats.armed, seen.at)
    cleared = state.failsafe_cleared
    return Latched(lasting, outlived, cleared is not None and seen is not None and seen.at <= cleared + latches.CLEARED)


def explained(state: VehicleState, moment: Moment, options: HardwareOptions) -> Explained:
    """The texts that the autopilot sent."""
    not_ready, failsafe = state.not_ready, state.failsafe
    return new(Explained, (not_ready and not_ready.text, failsafe and failsafe.text))


def mode_hints(state: VehicleState, moment: Moment, options: HardwareOptions) -> ModeHints:
    """The mode according to messages other than HEARTBEAT."""
    seen, current = state.latest.heartbeat, state.latest.current_mode
    if seen is None or (current is None and not state.modes):
        return NO_HINTS
    number = seen.message.custom_mode
    standard_mode = MAV_STANDARD_MODE_NON_STANDARD
    if current is not None and current.message.custom_mode == number and moment.is_fresh(current, CURRENT_MODE_FRESH):
        standard_mode = current.message.standard_mode
    return ModeHints(state.modes.get(number), standard_mode)


def claimed(state: VehicleState, moment: Moment, options: HardwareOptions) -> Claimed:
    """Whether another sender claims the ids. Disarmed is doubtful while any live claim is armed."""
    claims = state.claims
    conflict = claims.conflict
    mine = claims.mine
    if conflict is None and not claims.others and (mine is None or mine.doubt_at == NEVER):
        return UNDISPUTED
    if conflict is not None and not moment.has_come(conflict.last + HOLD):
        since = conflict.since.unix_us
        armed = state.heartbeats.armed
        all_armed = armed and moment.has_come(claims.disarmed_at + HOLD)
        all_disarmed = not armed and moment.has_come(claims.armed_at + HOLD)
        one_mode = moment.has_come(claims.differed_at + HOLD)
        return new(Claimed, (since, True, all_armed, all_disarmed, one_mode))
    if not state.heartbeats.armed and (
        (mine is not None and not moment.has_come(mine.doubt_at + LIVE))
        or any(not moment.has_come(c.doubt_at + LIVE) for c in claims.others.values())
    ):
        return DOUBTED
    return UNDISPUTED


def text_overdue(state: VehicleState, moment: Moment, options: HardwareOptions) -> bool:
    """Whether the missing chunks of a text are overdue."""
    return any(moment.has_come(partial.at + text_assembly.PATIENCE) for _, partial in state.texts)


Settle = Callable[["VehicleState", "Moment", "HardwareOptions"], Any]

SETTLE: Final[dict[str, Settle]] = {
    "kind": kind,
    "heartbeat": heartbeat,
    "state_since": state_since,
    "fresh": fresh,
    "landed_state": landed_state,
    "movement": movement,
    "receiver_stands": receiver_stands,
    "turns": turns,
    "has_no_lift": has_no_lift,
    "outputs": motor_outputs,
    "outputs_vetoed": outputs_vetoed,
    "esc_turning": esc_turning,
    "stop": stop,
    "applet": applet,
    "stop_switch": stop_switch,
    "stop_excused": stop_excused,
    "assumed_free": assumed_free,
    "sys_status": sys_status,
    "faults": faults,
    "latched": latched,
    "explained": explained,
    "mode_hints": mode_hints,
    "claimed": claimed,
    "text_overdue": text_overdue,
}
"""The function that settles each fact, in the order of `Facts`."""
assert tuple(SETTLE) == Facts._fields

_ALL: Final = tuple(SETTLE.values())


def facts_of(state: VehicleState, moment: Moment, options: HardwareOptions) -> Facts:
    """The facts of a vehicle at a moment. `moment.next` is then the first time at which one may change."""
    return new(Facts, [settle(state, moment, options) for settle in _ALL])
