"""The output watch: an emergency stop that nothing but the motor outputs shows.

ArduPilot's motor e-stop forces the motor and throttle outputs to their stop value (`SRV_Channel::should_e_stop`) and
changes neither HEARTBEAT nor SYS_STATUS while armed. The worst error is to call a live robot stopped, so "held" needs
proof: the same channels have left their stop value since the last arming, throttle is demanded, and nothing moves
faster.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

from ..interface.status import TriState
from .identity import HELICOPTER, ROVER, Family

if TYPE_CHECKING:
    from .pulse import Pulse

OFF_STOP: Final = 20  # us: further from the stop value than this is driven
AT_STOP: Final = 5  # us: as near as this is held
LEAST_PULSE: Final = 800  # us: an output of less is switched off, and teaches nothing
SEVERAL: Final = 3  # motors that all leave their stop value when armed: nothing but a multirotor does that
DEMAND: Final = 15  # %: VFR_HUD.throttle from which an output at stop is suspicious
HOLD: Final = 1.0  # s
BEATS_APART: Final = 3.5  # s: a stop value counts only from between two disarmed heartbeats this near
GROWTH: Final = 0.5  # m/s: a speed that has grown this much while held says that something drives
STRAIGHT: Final = 0.15  # rad/s: a rover that turns faster may be driven by a channel that is not the assumed one

# SERVOn_FUNCTION: 31 heli RSC, 33-40 and 82-85 and 160-179 motors, 70 throttle, 73/74 throttle left and right.
MOTOR_FUNCTIONS: Final = frozenset({31, *range(33, 41), 70, 73, 74, *range(82, 86), *range(160, 180)})
HELICOPTER_FUNCTIONS: Final = frozenset({31})  # the others may move its swash plate

# Motor channels (from 1) where no parameter was heard, by MAV_TYPE: ArduPilot's defaults.
ASSUMED_CHANNELS: Final[Mapping[int, tuple[int, ...]]] = {
    2: (1, 2, 3, 4),
    13: (1, 2, 3, 4, 5, 6),
    14: (1, 2, 3, 4, 5, 6, 7, 8),
    15: (1, 2, 4),
    10: (3,),
    11: (3,),
    46: (),
}
HELD_FAMILIES: Final = frozenset({Family.COPTER, Family.ROVER})

Outputs = tuple[int, ...]


@dataclass(slots=True)
class Watch:
    """What the outputs have shown: a record that each SERVO_OUTPUT_RAW changes in place."""

    functions: Mapping[int, int] = field(default_factory=dict)
    """SERVOn_FUNCTION by channel, as far as heard; changed by `name`."""
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
        """Learn what the channels are for."""
        self.functions = functions
        self.motors = tuple(sorted(c for c, function in functions.items() if function in MOTOR_FUNCTIONS))
        self.rotors = tuple(sorted(c for c, function in functions.items() if function in HELICOPTER_FUNCTIONS))


def channels(watch: Watch, vehicle_type: int) -> tuple[tuple[int, ...], bool]:
    """The motor channels (from 1), and whether they are assumed."""
    known = watch.rotors if vehicle_type == HELICOPTER else watch.motors
    if known:
        return known, False
    return ASSUMED_CHANNELS.get(vehicle_type, ()), True


def heard_outputs(
    watch: Watch, values: Outputs, vehicle_type: int, pulse: Pulse, throttle: float | None, speed: float, now: float
) -> None:
    """One more SERVO_OUTPUT_RAW; `throttle` in percent, None if not freshly heard."""
    watch.at, watch.values = now, values
    if not pulse.armed:
        watch.candidate, watch.driven, watch.held_since = values, False, None
        return
    motors, assumed = channels(watch, vehicle_type)
    stop = watch.stop
    known = [abs(values[c - 1] - stop[c]) for c in motors if c in stop and c <= len(values)]  # how far off it, us
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


def heard_beat(
    watch: Watch, pulse: Pulse, before: Pulse | None, outputs_enabled: bool, vehicle_type: int, now: float
) -> None:
    """One more heartbeat: stop values are learnt while disarmed, proofs end with each arming."""
    if pulse.armed:
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
    """Whether every motor output is known to be at its stop value: what turns then is not driven."""
    motors, _ = channels(watch, vehicle_type)
    known = [(watch.values[c - 1], watch.stop[c]) for c in motors if c in watch.stop and c <= len(watch.values)]
    return len(known) == len(motors) > 0 and all(abs(value - stop) <= OFF_STOP for value, stop in known)


def is_vetoed(watch: Watch, family: Family, vehicle_type: int, speed: float, turning: float) -> bool:
    """Whether `speed` (`hearing.movement.driving_speed`) says that something drives though the outputs are held.

    A copter that is stopped falls, whatever it did before; a rover coasts. `turning` in rad/s: a rover with a motor on
    each side stands still with one of them while it turns.
    """
    if family is not ROVER:
        return speed > GROWTH
    assumed = channels(watch, vehicle_type)[1]
    return (assumed and turning > STRAIGHT) or speed - watch.speed_then > GROWTH


def verdict(
    watch: Watch, family: Family, vehicle_type: int, speed: float, now: float, turning: float = 0.0
) -> TriState:
    """TRUE held, FALSE driven, UNKNOWN neither (or not for long enough) at `now`."""
    if watch.driven:
        return TriState.FALSE
    if watch.held_since is None or now < watch.held_since + HOLD:
        return TriState.UNKNOWN
    if family not in HELD_FAMILIES or vehicle_type == HELICOPTER:
        return TriState.UNKNOWN
    if is_vetoed(watch, family, vehicle_type, speed, turning):
        return TriState.UNKNOWN
    return TriState.TRUE
