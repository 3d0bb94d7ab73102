"""The state of one vehicle. Messages change it, time alone does not.

It holds no clock and no socket, so a recording gives the same state as the live link did. Only the record itself
changes. Its parts are values, except for the records that messages change in place.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...clock import Instant
from ...mavlink.enumerations import MAV_VTOL_STATE_MC, MAV_VTOL_STATE_UNDEFINED
from .autopilots import announced_as
from .estop import outputs, pending_command
from .estop import state as estop
from .estop.motor_test import MotorTest
from .faults import latches, parts, sensors, text_assembly
from .heartbeat.state import HeartbeatHistory, first_heartbeat
from .identity import FIXED_PITCH, Family, family_of, sensor_name
from .motion.lift import Lift
from .motion.state import Motion
from .px4_events import sequence as event_sequence
from .readiness import arming_report
from .readiness import state as reasons
from .satellite import state as high_latency

if TYPE_CHECKING:
    from ...mavlink.definitions import Heartbeat, SysStatus
    from .autopilots import Autopilot
    from .autopilots.firmware import Firmware
    from .autopilots.modes import AvailableMode
    from .autopilots.profile import Version
    from .autopilots.sensor_weights import Weight
    from .estop.applet import Applet
    from .options import HardwareOptions
    from .px4_events import EventTable
    from .satellite.state import HighLatency

EXPLAINS: Final = 2.0
"""Seconds around a disarm within which a text may tell why."""


class Statement(NamedTuple):
    """A text of the autopilot, and when it was first sent."""

    text: str
    since: Instant
    last: float


class ToldFirmware(NamedTuple):
    """A version, and when and in which message the autopilot reported it."""

    firmware: Firmware
    at: float
    """Monotonic seconds."""
    source: str


@dataclass(slots=True)
class VehicleState:
    """One vehicle."""

    latest: LatestMessages
    heartbeats: HeartbeatHistory
    booted: float
    """When the autopilot booted by its clock, monotonic seconds; the first heartbeat while there is no clock."""
    vehicle_type: int
    autopilot: int
    has_clock: bool = False
    """Whether `booted` is by its clock."""
    arrived: float = -math.inf
    """When the latest news of any kind arrived while the link was alive, monotonic seconds."""
    lost_at: float = -math.inf
    """Since when frames were lost, the latest time, monotonic seconds."""
    disarmed_at: float | None = None
    """When it was last disarmed in motion; None: it was armed since."""
    unexplained: bool = False
    """Whether it was disarmed in motion, and frames that may tell why are lost."""
    timeout: float | None = field(default=None, compare=False)
    """Seconds after which its link counts as lost, if the site says so. It is given from outside."""
    told_armed: float = -math.inf
    """When a text, an event or an acknowledgement last said that it may have been armed, monotonic seconds."""
    shown: Autopilot | None = None
    """The software identified by SYS_STATUS, if it differs from the announced one."""
    faults: sensors.Faults = field(default_factory=dict)
    latches: latches.Latches = field(default_factory=dict)
    stop: estop.Stop = estop.NOTHING
    motion: Motion = field(default_factory=Motion)
    gps_motion: Motion = field(default_factory=Motion)
    """The motion according to the GPS receiver; only used while the autopilot has no estimate."""
    lift: Lift = field(default_factory=Lift)
    unaided: bool = False
    """Whether ArduPilot's estimator reports that its position is not measured."""
    unaided_at: float = -math.inf
    """The time of the latest such report."""
    tilted: bool = False
    """Whether that report lacks an attitude: nothing that the estimator says is right then."""
    denied_at: float = -math.inf
    """When the autopilot last said in a text that its estimate is wrong; monotonic seconds."""
    turning: float = 0.0
    """The rotation in the latest ATTITUDE, rad/s."""
    rotation: Motion = field(default_factory=Motion)
    """The motion according to rotation alone. Its FALSE means nothing."""
    watch: outputs.Watch = field(default_factory=outputs.Watch)
    test: MotorTest = field(default_factory=MotorTest)
    """The evidence that a motor turns while disarmed."""
    switches: Mapping[int, int] = field(default_factory=dict)
    """RCn_OPTION by channel, as far as received."""
    texts: text_assembly.TextAssembly = text_assembly.EMPTY
    modes: Mapping[int, AvailableMode] = field(default_factory=dict)
    firmware: ToldFirmware | None = None
    """The version of the autopilot's firmware, if it reported it since its boot."""
    readiness: reasons.Readiness = reasons.NOTHING
    """The reasons why it cannot be armed."""
    faulty_parts: parts.Faults = field(default_factory=dict)
    failsafe: Statement | None = None
    """The text about a failsafe that its state reports."""
    failsafe_cleared: float | None = None
    """When a text ended the last known failsafe, monotonic seconds."""
    internal_errors_since: Instant | None = None
    rc_lost_since: Instant | None = None
    """When PX4's RC_RECEIVER bit turned unhealthy; without RC it is so for a whole flight."""
    asked: pending_command.Pending = pending_command.NONE
    """Commands of other components to this vehicle, without an acknowledgement yet."""
    applet: Applet | None = None
    """The latest word of the applet on the autopilot. None: it is not heard."""
    applet_ignored: int = 0
    """Words of the applet without a meaning."""
    reports_mission: bool = False
    """Whether MISSION_CURRENT has a mission_state."""
    high_latency: HighLatency | None = None
    """What HIGH_LATENCY2 says, if that is all that the vehicle sends. None: it sends HEARTBEATs."""
    armed_after: SysStatus | None = None
    """The latest SYS_STATUS before the arming, or before the connection to an armed vehicle."""
    stop_switch_at: float = -math.inf
    """When a switch of option 31 was last in its stop position, monotonic seconds."""
    assumed_free: bool = False
    """`estop_assume_visible`: no e-stop was engaged when it was armed."""
    events: event_sequence.EventSequence = event_sequence.NOTHING
    """The latest EVENTs of PX4."""
    arming: arming_report.ArmingReport = arming_report.NOTHING
    """Its latest report of the arming checks."""
    boots: int = 0
    """Reboots seen."""
    started_at: float | None = None
    """When the autopilot sent a text that it sends only while it starts, since the last heartbeat."""
    event_table: EventTable | None = field(default=None, compare=False)
    """The words for its events. It is given from outside, and outlives reboots."""

    profile: Autopilot = field(init=False)
    """The meaning of its messages."""
    family: Family = field(init=False)
    """The kind of vehicle."""

    def __post_init__(self) -> None:
        self.profile = self.shown or announced_as(self.autopilot)
        self.family = family_of(self.vehicle_type)

    @property
    def version(self) -> Firmware | None:
        """The version of its firmware, if it was told."""
        return None if self.firmware is None else self.firmware.firmware

    def counting_faults(self, options: HardwareOptions) -> list[tuple[int, Weight, sensors.Fault]]:
        """The faults in SYS_STATUS that have a meaning for this vehicle, at this site."""
        check, status = self.profile.stops.check, self.latest.sys_status
        least: Firmware | Version | None = self.version
        if least is None and check is not None and status is not None and sensors.has_prearm_check(status.message):
            least = check.prearm_check
        return [
            found
            for found in sensors.counting(self.faults, self.profile, least, self.heartbeats.armed)
            if sensor_name(found[0]) not in options.ignore_sensors
        ]

    def error_bits(self, options: HardwareOptions) -> frozenset[int]:
        """The bits of SYS_STATUS that are errors."""
        return frozenset(bit for bit, _, _ in self.counting_faults(options)) if self.faults else frozenset()

    def become(self, other: VehicleState) -> None:
        """Replace everything by the contents of `other`, except for what is given from outside."""
        for name in self.__slots__:
            if name not in ("event_table", "timeout", "arrived"):
                setattr(self, name, getattr(other, name))

    def note_loss(self, since: float) -> None:
        """Note that frames are lost since a time."""
        self.lost_at = since
        if self.disarmed_at is not None and abs(since - self.disarmed_at) <= EXPLAINS:
            self.unexplained = True

    def show(self, profile: Autopilot) -> None:
        """Note that its software is this one, although it announces another one."""
        self.shown = self.profile = profile


def begin(heartbeat: Heartbeat, now: Instant) -> VehicleState:
    """The state of a vehicle at its first heartbeat."""
    latest = LatestMessages()
    latest.heartbeat = heard(heartbeat, now.mono, None)
    return VehicleState(
        latest=latest,
        heartbeats=first_heartbeat(heartbeat, now),
        booted=now.mono,
        vehicle_type=heartbeat.type,
        autopilot=heartbeat.autopilot,
    )


def timeout_of(state: VehicleState, options: HardwareOptions) -> float:
    """Seconds without a heartbeat after which the link of a vehicle counts as lost."""
    if state.timeout is not None:
        return state.timeout
    if state.high_latency is None:
        return options.heartbeat_timeout
    return max(high_latency.timeout(state.high_latency), options.heartbeat_timeout)


def honours_stop(state: VehicleState) -> bool:
    """Whether a stop by switch or command stops the motors of this vehicle."""
    honoured_by = state.profile.stops.honoured_by
    return honoured_by is not None and state.family in honoured_by


def is_multicopter(state: VehicleState) -> bool:
    """Whether only the thrust of its motors can hold it in the air, and VFR_HUD.throttle is that thrust."""
    if not state.profile.speeds.hud_shows_thrust:
        return False
    return state.vehicle_type in FIXED_PITCH or vtol_state(state) == MAV_VTOL_STATE_MC


def vtol_state(state: VehicleState) -> int:
    """MAV_VTOL_STATE of the latest EXTENDED_SYS_STATE; UNDEFINED until one arrives."""
    seen = state.latest.extended_sys_state
    return MAV_VTOL_STATE_UNDEFINED if seen is None else seen.message.vtol_state


FRESH: Final = 2.5  # seconds, or three measured intervals
LONGEST_INTERVALS = 10.0  # seconds: limit for three intervals of a slow stream
REMEMBERED = 6  # arrivals, hence five intervals


@dataclass(slots=True)
class Heard:
    """The latest message of one kind and the arrivals before it."""

    message: Any
    at: float
    times: deque[float]
    """The last arrivals, this one included."""


def heard(message: Any, at: float, before: Heard | None) -> Heard:
    """`message`, received at `at` after `before`. Changes and returns `before` if it exists."""
    if before is None:
        return Heard(message, at, deque((at,), REMEMBERED))
    before.message = message
    before.at = at
    before.times.append(at)
    return before


def is_fresh(what: Heard | None, now: float, least: float) -> bool:
    """True while `what` is not older than `least` seconds, or than three measured intervals if that is longer."""
    if what is None:
        return False
    return now <= what.at + least or now <= slowly_fresh_until(what)


def slowly_fresh_until(what: Heard) -> float:
    """The time until which a message of a slow stream is fresh: three of its intervals, at most LONGEST_INTERVALS."""
    return what.at + min(3 * interval(what), LONGEST_INTERVALS)


def interval(what: Heard) -> float:
    """The median of the last intervals in seconds; 0 without intervals."""
    times = what.times
    if len(times) < 2:
        return 0.0
    gaps = sorted(b - a for a, b in pairwise(times))
    return gaps[len(gaps) // 2]


@dataclass(slots=True)
class LatestMessages:
    """The latest message of each kind that a status needs; None until it arrives."""

    heartbeat: Heard | None = None
    sys_status: Heard | None = None
    extended_sys_state: Heard | None = None
    global_position: Heard | None = None
    local_position: Heard | None = None
    vfr_hud: Heard | None = None
    gps: Heard | None = None
    """GPS_RAW_INT with a fix and a speed."""
    attitude: Heard | None = None
    current_mode: Heard | None = None
    esc: Heard | None = None
    """The latest ESC telemetry that showed a turning motor."""
