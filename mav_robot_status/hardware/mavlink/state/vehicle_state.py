"""The state of one vehicle. Messages change it (`handlers`), time alone does not.

It holds no clock and no socket, so a recording gives the same state as the live link did. Only the record itself
changes; what it is made of, but for the observation, are values.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from ....clock import Instant
from ..autopilots import announced_as
from ..identity import Family, family_of
from . import estop, latches, outputs, sensors, text_assembly
from .boot_clock import BootClock
from .claims import Claims
from .heartbeat_history import HeartbeatHistory, first_heartbeat
from .latest_messages import LatestMessages, heard
from .motion import Motion
from .pending_command import PendingCommand

if TYPE_CHECKING:
    from ....mavlink.definitions import Heartbeat
    from ..autopilots import Autopilot
    from ..autopilots.modes import AvailableMode


class Statement(NamedTuple):
    """A text of the autopilot, and when it was first sent."""

    text: str
    since: Instant
    last: float


@dataclass(slots=True)
class VehicleState:
    """One vehicle."""

    latest: LatestMessages
    heartbeats: HeartbeatHistory
    boot: BootClock
    vehicle_type: int
    autopilot: int
    shown: Autopilot | None = None
    """The software identified by SYS_STATUS, if it differs from the announced one."""
    faults: sensors.Faults = field(default_factory=dict)
    latches: latches.Latches = field(default_factory=dict)
    stop: estop.Stop = estop.NOTHING
    motion: Motion = field(default_factory=Motion)
    gps_motion: Motion = field(default_factory=Motion)
    """The motion according to the GPS receiver; only used while the autopilot has no estimate."""
    unaided: bool = False
    """Whether ArduPilot's estimator reports that its position is not measured."""
    unaided_at: float = -math.inf
    """The time of the latest such report."""
    turning: float = 0.0
    """The rotation in the latest ATTITUDE, rad/s."""
    watch: outputs.Watch = field(default_factory=outputs.Watch)
    switches: Mapping[int, int] = field(default_factory=dict)
    """RCn_OPTION by channel, as far as received."""
    texts: text_assembly.TextAssembly = text_assembly.EMPTY
    modes: Mapping[int, AvailableMode] = field(default_factory=dict)
    version: tuple[int, int] | None = None
    """The version of the autopilot's software, if received: major, minor."""
    not_ready: Statement | None = None
    """The reason why it cannot be armed."""
    failsafe: Statement | None = None
    """The text about a failsafe that its state reports."""
    internal_errors_since: Instant | None = None
    rc_lost_since: Instant | None = None
    """When PX4's RC_RECEIVER bit turned unhealthy; without RC it is so for a whole flight."""
    asked: PendingCommand | None = None
    """A command of another component to this vehicle, without an acknowledgement yet."""
    assumed_free: bool = False
    """`estop_assume_visible`: no e-stop was engaged when it was armed."""
    event: int | None = None
    """The sequence number of the latest EVENT."""
    boots: int = 0
    """Reboots seen."""
    claims: Claims[Any] = field(default_factory=Claims, compare=False)
    """Who speaks with its ids. It outlives reboots, and the vehicle itself."""

    profile: Autopilot = field(init=False)
    """The meaning of its messages."""
    family: Family = field(init=False)
    """The kind of vehicle."""

    def __post_init__(self) -> None:
        self.profile = self.shown or announced_as(self.autopilot)
        self.family = family_of(self.vehicle_type)

    def become(self, other: VehicleState) -> None:
        """Replace everything by the contents of `other`."""
        for name in self.__slots__:
            setattr(self, name, getattr(other, name))

    def show(self, profile: Autopilot) -> None:
        """Note that its software is this one, although it announces another one."""
        self.shown = self.profile = profile
        self.latest.unsettled = True


def begin(heartbeat: Heartbeat, now: Instant, claims: Claims[Any] | None = None) -> VehicleState:
    """The state of a vehicle at its first heartbeat."""
    latest = LatestMessages()
    latest.heartbeat = heard(latest, heartbeat, now.mono, None)
    return VehicleState(
        latest=latest,
        heartbeats=first_heartbeat(heartbeat, now),
        boot=BootClock(now.mono),
        vehicle_type=heartbeat.type,
        autopilot=heartbeat.autopilot,
        claims=claims or Claims(),
    )
