"""What is remembered of one vehicle: each message changes it (`hearing`), time alone does not.

It holds no clock and no socket, so a recording gives the same memory as the live link did. Only the record itself
changes; what it is made of, but for the observation, are values.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from ..clock import Instant
from . import causes, estop, outputs, sensors, statustext
from .boot import Boot
from .commands import Asked
from .flight_mode import AvailableMode
from .identity import Family, Stack, family_of, stack_of
from .motion import Motion
from .observation import Observation, heard
from .pulse import Pulse, first_beat

if TYPE_CHECKING:
    from ..mavlink.definitions import Heartbeat


class Said(NamedTuple):
    """The autopilot's own words on something, and since when it says them."""

    text: str
    since: Instant
    last: float


@dataclass(slots=True)
class Memory:
    """One vehicle."""

    observation: Observation
    pulse: Pulse
    boot: Boot
    vehicle_type: int
    autopilot: int
    impostor: bool = False
    """Whether this ArduPilot has shown that it is INAV."""
    faults: sensors.Faults = field(default_factory=dict)
    latches: causes.Latches = field(default_factory=dict)
    stop: estop.Stop = estop.NOTHING
    motion: Motion = field(default_factory=Motion)
    gps_motion: Motion = field(default_factory=Motion)
    """What the receiver's own ground speed says; only used while the autopilot has no estimate."""
    unaided: bool = False
    """Whether ArduPilot's estimator has said that nothing measures where it is."""
    unaided_at: float = -math.inf
    """When it said so, or the contrary."""
    turning: float = 0.0
    """The rotation that the latest ATTITUDE tells, rad/s."""
    watch: outputs.Watch = field(default_factory=outputs.Watch)
    switches: Mapping[int, int] = field(default_factory=dict)
    """RCn_OPTION by channel, as far as heard."""
    texts: statustext.Assembly = statustext.EMPTY
    modes: Mapping[int, AvailableMode] = field(default_factory=dict)
    version: tuple[int, int] | None = None
    """Of the autopilot's software, if it was heard: major, minor."""
    not_ready: Said | None = None
    """Why it cannot be armed."""
    failsafe: Said | None = None
    """What it said of a failsafe that its state reports."""
    internal_errors_since: Instant | None = None
    rc_lost_since: Instant | None = None
    """When PX4's RC_RECEIVER bit turned unhealthy; without RC it is so for a whole flight."""
    asked: Asked | None = None
    """A command of somebody else to this vehicle that it has not acknowledged yet."""
    assumed_free: bool = False
    """`estop_assume_visible`: no e-stop was engaged when it was armed."""
    event: int | None = None
    """The sequence number of the latest EVENT."""
    boots: int = 0
    """Reboots seen."""
    formerly: tuple[int, int] | None = None
    """The autopilot and vehicle type that spoke with these ids before."""

    stack: Stack = field(init=False)
    """The software on the autopilot."""
    family: Family = field(init=False)
    """The kind of vehicle."""

    def __post_init__(self) -> None:
        self.stack = stack_of(self.autopilot, self.impostor)
        self.family = family_of(self.vehicle_type)

    def become(self, other: Memory) -> None:
        """Forget everything for what `other` remembers."""
        for name in self.__slots__:
            setattr(self, name, getattr(other, name))

    def unmask(self) -> None:
        """This ArduPilot has shown that it is INAV."""
        self.impostor = True
        self.stack = stack_of(self.autopilot, self.impostor)


def begin(heartbeat: Heartbeat, now: Instant) -> Memory:
    """The memory of a vehicle at its first heartbeat."""
    return Memory(
        observation=Observation(heartbeat=heard(heartbeat, now.mono, None)),
        pulse=first_beat(heartbeat, now),
        boot=Boot(now.mono),
        vehicle_type=heartbeat.type,
        autopilot=heartbeat.autopilot,
    )
