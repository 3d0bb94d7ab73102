"""The facts of a vehicle: the complete input of the rules. A new status is derived only when they change.

The subjects make them from the state, see `subjects`. A rule can read nothing else, and every fact is compared. Times
of arrival are not facts, because each message changes them; the words of a `Reason` read them from the state.
"""

from __future__ import annotations

from math import inf, nextafter
from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface.status import TriState
from ...mavlink.enumerations import MAV_MODE_FLAG_SAFETY_ARMED
from .state import slowly_fresh_until

if TYPE_CHECKING:
    from ...mavlink.definitions import Heartbeat
    from .autopilots import Autopilot
    from .autopilots.firmware import Firmware
    from .autopilots.modes import ModeHints
    from .identity import Family
    from .state import Heard


class Kind(NamedTuple):
    """The kind of vehicle."""

    profile: Autopilot
    family: Family
    vehicle_type: int
    """MAV_TYPE."""
    autopilot: int
    """MAV_AUTOPILOT."""
    firmware: Firmware | None
    """The version of the firmware. None: not reported since its boot, or a build without one."""


class Fresh(NamedTuple):
    """Which messages are recent enough to be used."""

    heartbeat: bool
    sys_status: bool
    landed_state: bool
    velocity: str | None
    """The name of the message that gives the speed."""
    global_position: bool
    gps: bool
    link: bool
    """Whether any news arrived lately, so that the link is connected."""
    arming_told: bool
    """Whether an arming was announced after the latest HEARTBEAT."""


class Movement(NamedTuple):
    """The motion according to speed and rotation."""

    value: TriState
    """With hysteresis."""
    is_slow: bool
    """Whether an unknown motion is below the lower thresholds, not yet for long enough."""
    is_fast: bool
    """Whether an unknown motion is above the upper thresholds, not yet for long enough."""
    is_measured: bool
    """Whether the latest sample is an estimate."""
    moves_disarmed: bool
    """Whether the estimate shows motion over ground while the vehicle is disarmed."""


class Outputs(NamedTuple):
    """The state of the motor outputs."""

    fresh: bool
    driven: bool
    held: bool
    """Whether they are held at their stop value, for long enough, while throttle is demanded."""
    at_stop: bool
    """Whether each is at its stop value: then a turning motor is not driven."""
    idle: bool
    """Whether they stand at their stop value while throttle is demanded, without a proof that they are motors."""


class MotorTest(NamedTuple):
    """Whether a motor turns although the vehicle is disarmed."""

    turns: bool
    """Whether the outputs show it, now or a moment ago."""
    may_turn: bool
    """Whether an output, a text, a command or rpm is evidence of it."""


class Stop(NamedTuple):
    """What the autopilot has reported about an emergency stop."""

    said: TriState
    text: str | None
    is_ready: bool
    """Whether the pre-arm checks, which fail while it is engaged, pass."""
    doubt: str | None
    """Why a stop may last, although no evidence of it counts any more."""
    unexplained: bool
    """Whether it was disarmed in motion, and frames that may tell why are lost."""


class Applet(NamedTuple):
    """The word of the applet on the autopilot."""

    stopped: TriState
    """UNKNOWN: it is not heard, or says nothing about this vehicle."""
    is_contradicted: bool
    """Whether a motor is driven although it reports a stop."""
    is_heard: bool
    """Whether it is heard at all."""


class SystemStatus(NamedTuple):
    """The contents of the latest SYS_STATUS."""

    safety_switch: bool
    """Whether it shows that the safety switch holds the outputs."""
    switch_outdated: bool
    """Whether the vehicle is armed, and the safety switch that it shows may have been released since."""
    ready: TriState
    """Whether the pre-arm checks pass. UNKNOWN: not reported."""
    internal_errors_since: int | None
    """Unix microseconds."""
    rc_lost_with_state: bool
    """Whether the RC receiver was lost when the vehicle entered its state."""
    unhealthy: int
    """What a disarmed PX4 reports as enabled and unhealthy, the extended word shifted up by 32. Otherwise 0."""


class Cause(NamedTuple):
    """A cause of an error, by its code."""

    code: int
    text: str | None
    since_us: int


class Latched(NamedTuple):
    """The causes that were announced and are still active."""

    causes: tuple[Cause, ...]
    termination_outlived: bool
    """Whether the vehicle is still armed some time after it announced a termination."""
    failsafe_over: bool
    """Whether a text ended the last known failsafe, and the state in the HEARTBEAT may be older than that."""


class SensorFault(NamedTuple):
    """A bit of SYS_STATUS that has been faulty for long enough."""

    bit: int
    is_soft: bool
    since_us: int


class Claimed(NamedTuple):
    """Whether two vehicles use the ids. `belief` decides that, not the state."""

    conflict_since: int | None
    """Unix microseconds. None: no conflict."""
    mixed: bool
    """Whether the two cannot be told apart, so that nothing is known."""


UNDISPUTED: Final = Claimed(None, False)


class Seldom(NamedTuple):
    """What HIGH_LATENCY2 says besides the mode."""

    armed: TriState
    moves: bool
    failures: tuple[Cause, ...]


class NotReady(NamedTuple):
    """A reason why the vehicle cannot be armed."""

    text: str | None
    since_us: int
    """Unix microseconds."""


class Explained(NamedTuple):
    """The texts that the autopilot sent."""

    not_ready: tuple[NotReady, ...]
    """The reasons why it cannot be armed, by texts."""
    failsafe: str | None
    """The text about a failsafe that its state reports."""


class Parts(NamedTuple):
    """What the parts of the vehicle report about themselves."""

    faults: tuple[Cause, ...]
    not_ready: tuple[NotReady, ...]


class Arming(NamedTuple):
    """The latest report of the arming checks."""

    can_arm: TriState
    """Whether they pass in the current mode. UNKNOWN: there is no report, or not all of it has arrived."""
    modes_blocked: tuple[str, ...] | None
    """The flight modes in which they fail. None: not known."""
    failing: tuple[NotReady, ...]
    """The checks that fail in the current mode of a disarmed vehicle, the most restrictive first."""


class Facts(NamedTuple):
    """Everything that a status depends on."""

    kind: Kind
    heartbeat: Heartbeat
    """The latest one, or what a HIGH_LATENCY2 says instead."""
    seldom: Seldom | None
    """What HIGH_LATENCY2 says, if the vehicle sends no HEARTBEAT. None: it sends HEARTBEATs."""
    state_since: int
    """When it entered its MAV_STATE, Unix microseconds."""
    fresh: Fresh
    landed_state: int
    movement: Movement
    receiver_stands: bool
    """Whether the GPS receiver reports that it stands still."""
    turns: bool
    """Whether it turns, according to the rotation alone."""
    has_no_lift: bool
    """Whether an aircraft that reports to be in the air has no throttle that carries it."""
    lies: bool
    """Whether a multicopter has not moved since it lay on the ground for certain."""
    outputs: Outputs
    motor_test: MotorTest
    outputs_vetoed: bool
    """Whether a motion shows that the vehicle is driven although the outputs seem held."""
    esc_turning: bool
    """Whether ESC telemetry shows a motor that turns."""
    stop: Stop
    applet: Applet
    stop_switch: bool
    """Whether an RC switch that stops the motors is in its stop position."""
    stop_excused: bool
    """Whether a switch exists whose stop the pre-arm checks ignore."""
    assumed_free: bool
    """Whether no stop was engaged when it was armed, and none was reported since."""
    sys_status: SystemStatus
    faults: tuple[SensorFault, ...]
    latched: Latched
    explained: Explained
    parts: Parts
    arming: Arming
    mode_hints: ModeHints
    claimed: Claimed
    text_overdue: bool
    """Whether the missing chunks of a text are overdue."""

    @property
    def armed(self) -> bool:
        """The only armed indication that exists."""
        return bool(self.heartbeat.base_mode & MAV_MODE_FLAG_SAFETY_ARMED)


class Deadline:
    """A time, in monotonic seconds.

    Facts compare all other times through it. `next` is therefore the first time at which a fact may change without a
    message, and no list of such times is needed.
    """

    __slots__ = ("next", "now")

    def __init__(self, now: float) -> None:
        self.now = now
        self.next = inf

    def has_come(self, at: float) -> bool:
        """Whether it is `at` or later."""
        if self.now >= at:
            return True
        if at < self.next:
            self.next = at
        return False

    def is_within(self, limit: float) -> bool:
        """Whether it is not later than `limit`."""
        if self.now > limit:
            return False
        if limit < self.next:
            self.next = nextafter(limit, inf)
        return True

    def is_fresh(self, what: Heard | None, least: float) -> bool:
        """Whether `what` is not older than `least` seconds, or than three measured intervals if that is longer."""
        return what is not None and (self.is_within(what.at + least) or self.is_within(slowly_fresh_until(what)))
