"""The output watch: an emergency stop that only the motor outputs show.

ArduPilot's motor e-stop forces the motor and throttle outputs to their stop value (`SRV_Channel::should_e_stop`) and
changes neither HEARTBEAT nor SYS_STATUS while armed. The worst error is to report a live robot as stopped, so "held"
needs proof: the same channels have left their stop value since the last arming, throttle is demanded, and no speed
grows. A motor that is switched off while armed, without such proof, is only a reason to doubt.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from ....mavlink import enumerations as mavlink
from ..identity import PLANE, ROVER, Family

if TYPE_CHECKING:
    from ..heartbeat.state import HeartbeatHistory

OFF_STOP: Final = 20  # us: further from the stop value than this is driven
AT_STOP: Final = 5  # us: as near as this is held
LEAST_PULSE: Final = 800  # us: a lower output is switched off, and proves nothing
SEVERAL: Final = 3  # motors that all leave their stop value when armed: only a multirotor does that
DEMAND: Final = 15  # %: VFR_HUD.throttle from which an output at stop is suspicious
HOLD: Final = 0.95  # s: one second, less the jitter of a stream
SWITCHED_OFF: Final = 1.4  # s: longer than the heartbeat that shows a disarm may be late, less the jitter of a stream
FOLLOWS: Final = 0.2  # relative: the pulse per percent of throttle may differ by this much at two throttles
LOW_THROTTLE, HIGH_THROTTLE = 60, 75  # %: one of the throttles is at most the first, the other at least the second
LEAST_SLOPE: Final = 5.0  # us per percent: no control surface is that far off at such a throttle
FLYING: Final = 5.0  # m/s: a plane without power that is this fast sinks or slows down
LOSS: Final = 0.5  # m/s: it does so by at least this much
BEATS_APART: Final = 3.5  # s: a stop value is learnt only between two disarmed heartbeats this close
GROWTH: Final = 0.5  # m/s: such an increase of speed while held shows that the vehicle is driven
STRAIGHT: Final = 0.15  # rad/s: a rover that turns faster may be driven by a channel that is not the assumed one

# SERVOn_FUNCTION: 31 heli RSC, 33-40 and 82-85 and 160-179 motors, 70 throttle, 73/74 throttle left and right.
MOTOR_FUNCTIONS: Final = frozenset({31, *range(33, 41), 70, 73, 74, *range(82, 86), *range(160, 180)})
HELICOPTER_FUNCTIONS: Final = frozenset({31})  # the others may move its swash plate

# Motor channels (from 1) without received parameters, by MAV_TYPE: ArduPilot's defaults.
ASSUMED_CHANNELS: Final[Mapping[int, tuple[int, ...]]] = {
    mavlink.MAV_TYPE_QUADROTOR: (1, 2, 3, 4),
    mavlink.MAV_TYPE_HEXAROTOR: (1, 2, 3, 4, 5, 6),
    mavlink.MAV_TYPE_OCTOROTOR: (1, 2, 3, 4, 5, 6, 7, 8),
    mavlink.MAV_TYPE_TRICOPTER: (1, 2, 4),
    mavlink.MAV_TYPE_GROUND_ROVER: (3,),
    mavlink.MAV_TYPE_SURFACE_BOAT: (3,),
    mavlink.MAV_TYPE_GROUND_QUADRUPED: (),
    mavlink.MAV_TYPE_FIXED_WING: (3,),
    mavlink.MAV_TYPE_SUBMARINE: (1, 2, 3, 4, 5, 6),
}
LIFT: Final = (5, 6, 7, 8)
"""The default channels of the lift motors of a QuadPlane, whose type in the HEARTBEAT is that of a plane."""
STOPS_NEAR: Final = {Family.ROVER: (1400, 1600), Family.SUB: (1400, 1600)}
"""The range of a stop value that was not learnt, us: for motors that reverse. For all others it is LOW_END."""
LOW_END: Final = (LEAST_PULSE, 1250)

Outputs = tuple[int, ...]


@dataclass(slots=True)
class Watch:
    """The evidence from the outputs: a record that each SERVO_OUTPUT_RAW changes in place."""

    functions: Mapping[int, int] = field(default_factory=dict)
    """SERVOn_FUNCTION by channel, as far as received; changed by `name`."""
    stop: Mapping[int, int] = field(default_factory=dict)
    """The stop value of each motor channel, us."""
    candidate: Outputs = ()
    """Outputs while disarmed that wait for the next heartbeat to confirm the disarm."""
    proved: bool = False
    """Whether, since boot, the channels have shown that they are motors: off stop while throttle was demanded, or all
    off stop at once."""
    driven_seen: bool = False
    """Whether a motor was driven since the last arming."""
    driven: bool = False
    """Whether the latest outputs drive a motor."""
    off_since: float | None = None
    """Since when all motors of a hovering vehicle are at their stop value, while armed and after they were driven."""
    slope: float = 0.0
    """Of an assumed throttle channel: us per percent of a high throttle. 0: none seen."""
    held_since: float | None = None
    held: bool = False
    """Whether the outputs were at stop again after HOLD, and a throttle that arrived in between was demanded."""
    idle_since: float | None = None
    idle: bool = False
    """As `held`, without a proof that the channels are motors, and that they were driven."""
    speed_then: float = 0.0
    """Speed over ground of a rover or a plane when the hold began, m/s."""
    at: float | None = None
    """When the latest outputs arrived."""
    values: Outputs = ()
    motors: tuple[int, ...] = field(init=False)
    """The channels of MOTOR_FUNCTIONS."""
    rotors: tuple[int, ...] = field(init=False)
    """The channels of HELICOPTER_FUNCTIONS."""

    def __post_init__(self) -> None:
        self.name(self.functions)

    def name(self, functions: Mapping[int, int]) -> None:
        """Store the functions of the channels."""
        self.functions = functions
        self.motors = tuple(sorted(c for c, function in functions.items() if function in MOTOR_FUNCTIONS))
        self.rotors = tuple(sorted(c for c, function in functions.items() if function in HELICOPTER_FUNCTIONS))


def channels(watch: Watch, vehicle_type: int) -> tuple[tuple[int, ...], bool]:
    """The motor channels (from 1), and whether they are assumed."""
    known = watch.rotors if vehicle_type == mavlink.MAV_TYPE_HELICOPTER else watch.motors
    if known:
        return known, False
    return ASSUMED_CHANNELS.get(vehicle_type, ()), True


def heard_outputs(
    watch: Watch,
    values: Outputs,
    vehicle_type: int,
    heartbeats: HeartbeatHistory,
    throttle: float | None,
    throttle_at: float,
    speed: float,
    now: float,
    hovers: bool = False,
) -> None:
    """Process a SERVO_OUTPUT_RAW; `throttle` in percent, None if it is not fresh; `throttle_at`: when it arrived.

    A throttle from before a stop of its own would make a vehicle seem held that only rests.
    `hovers`: motors that are switched off would let the vehicle fall, so the autopilot does not do that by itself.
    """
    watch.at, watch.values = now, values
    if not heartbeats.armed:
        watch.candidate, watch.driven, watch.held_since, watch.off_since = values, False, None, None
        watch.held, watch.idle_since, watch.idle = False, None, False
        return
    motors, assumed = channels(watch, vehicle_type)
    known = _distances(watch, motors)
    complete = len(known) == len(motors) > 0
    off_stop = bool(known) and max(known) > OFF_STOP
    at_stop = complete and max(known) <= AT_STOP
    lifts = assumed and vehicle_type == mavlink.MAV_TYPE_FIXED_WING
    lifting = False
    if lifts:
        lift = _distances(watch, LIFT)
        lifting = len(lift) == len(LIFT) and min(lift) > OFF_STOP
        pulses = sum(values[c - 1] >= LEAST_PULSE for c in LIFT)
        at_stop = at_stop and len(lift) == pulses and max(lift, default=0) <= AT_STOP
        hovers = hovers and pulses == len(LIFT)
    demanded = throttle is not None and throttle >= DEMAND
    if not watch.proved:
        watch.proved = _is_proof(watch, known, motors, assumed, vehicle_type, throttle if demanded else None)
    _note_rest(watch, at_stop and demanded, throttle_at, speed, now)
    watch.driven = (off_stop and (watch.proved or not assumed)) or lifting
    watch.driven_seen = watch.driven_seen or watch.driven
    if not (hovers and at_stop and watch.driven_seen):
        watch.off_since = None
    elif watch.off_since is None:
        watch.off_since = now


def _note_rest(watch: Watch, rests: bool, throttle_at: float, speed: float, now: float) -> None:
    """Note since when the outputs are at their stop value while throttle is demanded (`rests`), and are held there."""
    if not rests:
        watch.idle_since, watch.idle = None, False
    elif watch.idle_since is None:
        watch.idle_since = now
    elif now >= watch.idle_since + HOLD and throttle_at > watch.idle_since:
        watch.idle = True
    if not (rests and watch.proved and watch.driven_seen):
        watch.held_since, watch.held = None, False
    elif watch.held_since is None:
        watch.held_since, watch.speed_then = now, speed
    elif now >= watch.held_since + HOLD and throttle_at > watch.held_since:
        watch.held = True


def _distances(watch: Watch, motors: tuple[int, ...]) -> list[int]:
    """How far (us) the motors are from their known stop values, without those whose output is switched off."""
    stop, values = watch.stop, watch.values
    return [
        abs(values[c - 1] - stop[c]) for c in motors if c in stop and c <= len(values) and values[c - 1] >= LEAST_PULSE
    ]


def _is_proof(
    watch: Watch,
    known: list[int],
    motors: tuple[int, ...],
    assumed: bool,
    vehicle_type: int,
    throttle: float | None,
) -> bool:
    """Whether the distances `known` prove that the channels are motors; `throttle` in percent, None if not demanded."""
    off = sum(distance > OFF_STOP for distance in known)
    if off >= SEVERAL and (vehicle_type == mavlink.MAV_TYPE_SUBMARINE or off == len(motors)):
        return True
    if throttle is None or not off:
        return False
    if assumed and vehicle_type == mavlink.MAV_TYPE_FIXED_WING:
        return _follows(watch, known[0] / throttle, throttle)
    # one of several assumed channels may move a gimbal
    return not (assumed and len(motors) >= SEVERAL)


def _follows(watch: Watch, slope: float, throttle: float) -> bool:
    """Whether an output has the same `slope` (us per percent) at a high and at a low throttle.

    Then it is the throttle of a plane. A control surface does not follow the throttle.
    """
    if throttle >= HIGH_THROTTLE:
        watch.slope = slope
    return throttle <= LOW_THROTTLE and slope >= LEAST_SLOPE and abs(slope - watch.slope) <= FOLLOWS * watch.slope


def heartbeat_arrived(
    watch: Watch,
    heartbeats: HeartbeatHistory,
    before: HeartbeatHistory | None,
    outputs_enabled: bool,
    vehicle_type: int,
    now: float,
) -> None:
    """Process a heartbeat: stop values are learnt while disarmed, each arming resets the proofs."""
    if heartbeats.armed:
        if before is not None and not before.armed:
            watch.candidate, watch.held_since, watch.off_since = (), None, None
            watch.driven = watch.driven_seen = watch.held = False
        return
    candidate, watch.candidate = watch.candidate, ()
    if before is None or before.armed or not candidate or not outputs_enabled:
        return
    if now - before.runs[-1].last <= BEATS_APART:
        motors, assumed = channels(watch, vehicle_type)
        if assumed and vehicle_type == mavlink.MAV_TYPE_FIXED_WING:
            motors += LIFT
        learnt = {c: candidate[c - 1] for c in motors if c <= len(candidate)}
        watch.stop = {c: value for c, value in learnt.items() if value >= LEAST_PULSE}


def is_at_stop(watch: Watch, vehicle_type: int) -> bool:
    """Whether every motor output is known to be at its stop value: then a turning motor is not driven."""
    motors, _ = channels(watch, vehicle_type)
    known = _distances(watch, motors)
    return len(known) == len(motors) > 0 and max(known) <= OFF_STOP


def may_drive(watch: Watch, family: Family, vehicle_type: int) -> bool:
    """Whether a motor output is off its stop value: the learnt one, else the usual range. Not a proof."""
    low, high = STOPS_NEAR.get(family, LOW_END)
    for c in channels(watch, vehicle_type)[0]:
        value = watch.values[c - 1] if c <= len(watch.values) else 0
        if value < LEAST_PULSE:
            continue
        if abs(value - watch.stop[c]) > OFF_STOP if c in watch.stop else not low <= value <= high:
            return True
    return False


def hovers(family: Family, vehicle_type: int, vtol_state: int) -> bool:
    """Whether the vehicle would fall without motors: a multirotor, or a plane on its lift motors."""
    if family is PLANE:
        return vtol_state in (mavlink.MAV_VTOL_STATE_MC, mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC)
    return family is Family.COPTER and vehicle_type != mavlink.MAV_TYPE_HELICOPTER


def proves_stop(family: Family, vehicle_type: int, vtol_state: int) -> bool:
    """Whether held outputs prove a stop. On its lift motors a plane demands throttle while its propeller stands.

    A sub demands throttle while it idles. The outputs of a helicopter or a blimp may move its swash plate or its fins.
    """
    if family is PLANE:
        return vtol_state == mavlink.MAV_VTOL_STATE_UNDEFINED
    return family is ROVER or hovers(family, vehicle_type, vtol_state)


def may_be_held(family: Family, vehicle_type: int) -> bool:
    """Whether held outputs are evidence of a stop at all. See `proves_stop`."""
    return family in (PLANE, ROVER, Family.COPTER) and vehicle_type != mavlink.MAV_TYPE_HELICOPTER


def is_vetoed(watch: Watch, family: Family, vehicle_type: int, speed: float, climb: float, turning: float) -> bool:
    """Whether the motion shows that the vehicle is driven although the outputs seem held.

    A stopped copter falls, a stopped rover coasts, a stopped plane sinks or slows down. `speed` over ground and `climb`
    in m/s. `turning` in rad/s, infinite if it is not known: one motor of a rover with a motor on each side may stand
    still during a turn.
    """
    grown = speed - watch.speed_then
    if family is not ROVER:
        keeps_flying = family is PLANE and speed > FLYING and climb > -LOSS and grown > -LOSS
        return climb > GROWTH or keeps_flying
    assumed = channels(watch, vehicle_type)[1]
    return (assumed and turning > STRAIGHT) or grown > GROWTH
