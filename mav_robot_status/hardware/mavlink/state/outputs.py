"""The output watch: an emergency stop that only the motor outputs show.

ArduPilot's motor e-stop forces the motor and throttle outputs to their stop value (`SRV_Channel::should_e_stop`) and
changes neither HEARTBEAT nor SYS_STATUS while armed. The worst error is to report a live robot as stopped, so "held"
needs proof: the same channels have left their stop value since the last arming, throttle is demanded, and no speed
grows.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from ....mavlink import enumerations as mavlink
from ..identity import ROVER, Family

if TYPE_CHECKING:
    from .heartbeat_history import HeartbeatHistory

OFF_STOP: Final = 20  # us: further from the stop value than this is driven
AT_STOP: Final = 5  # us: as near as this is held
LEAST_PULSE: Final = 800  # us: a lower output is switched off, and proves nothing
SEVERAL: Final = 3  # motors that all leave their stop value when armed: only a multirotor does that
DEMAND: Final = 15  # %: VFR_HUD.throttle from which an output at stop is suspicious
HOLD: Final = 1.0  # s
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
}

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
    held_since: float | None = None
    speed_then: float = 0.0
    """Speed over ground of a rover when the hold began, m/s."""
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
    speed: float,
    now: float,
) -> None:
    """Process a SERVO_OUTPUT_RAW; `throttle` in percent, None if it is not fresh."""
    watch.at, watch.values = now, values
    if not heartbeats.armed:
        watch.candidate, watch.driven, watch.held_since = values, False, None
        return
    motors, assumed = channels(watch, vehicle_type)
    stop = watch.stop
    known = [abs(values[c - 1] - stop[c]) for c in motors if c in stop and c <= len(values)]  # distance from it, us
    complete = len(known) == len(motors)
    farthest = max(known) if known else 0
    off_stop = farthest > OFF_STOP
    at_stop = complete and bool(known) and farthest <= AT_STOP
    demanded = throttle is not None and throttle >= DEMAND
    if not watch.proved:
        # one of several assumed channels may move a gimbal; the motors of a multirotor all leave their stop value
        one_will_do = not (assumed and len(motors) >= SEVERAL)
        all_off = complete and len(known) >= SEVERAL and min(known) > OFF_STOP
        watch.proved = (off_stop and demanded and one_will_do) or all_off
    if not (at_stop and demanded and watch.proved and watch.driven_seen):
        watch.held_since = None
    elif watch.held_since is None:
        watch.held_since, watch.speed_then = now, speed
    watch.driven = off_stop and (watch.proved or not assumed)
    watch.driven_seen = watch.driven_seen or watch.driven


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
            watch.candidate, watch.held_since = (), None
            watch.driven = watch.driven_seen = False
        return
    candidate, watch.candidate = watch.candidate, ()
    if before is None or before.armed or not candidate or not outputs_enabled:
        return
    if now - before.runs[-1].last <= BEATS_APART:
        motors, _ = channels(watch, vehicle_type)
        learnt = {c: candidate[c - 1] for c in motors if c <= len(candidate)}
        watch.stop = {c: value for c, value in learnt.items() if value >= LEAST_PULSE}


def is_at_stop(watch: Watch, vehicle_type: int) -> bool:
    """Whether every motor output is known to be at its stop value: then a turning motor is not driven."""
    motors, _ = channels(watch, vehicle_type)
    known = [(watch.values[c - 1], watch.stop[c]) for c in motors if c in watch.stop and c <= len(watch.values)]
    return len(known) == len(motors) > 0 and all(abs(value - stop) <= OFF_STOP for value, stop in known)


def is_vetoed(watch: Watch, family: Family, vehicle_type: int, speed: float, turning: float) -> bool:
    """Whether `speed` (`driving_speed`) shows that the vehicle is driven although the outputs seem held.

    A stopped copter falls; a stopped rover coasts. `turning` in rad/s: one motor of a rover with a motor on each side
    may stand still during a turn.
    """
    if family is not ROVER:
        return speed > GROWTH
    assumed = channels(watch, vehicle_type)[1]
    return (assumed and turning > STRAIGHT) or speed - watch.speed_then > GROWTH
