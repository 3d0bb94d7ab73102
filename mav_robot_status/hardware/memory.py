"""What is remembered of one vehicle: a value; each message gives the next one (`hearing`).

It holds no clock and no socket, so a recording gives the same memory as the live link did.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from ..clock import Instant
from . import causes, estop, outputs, sensors, statustext
from .boot import Boot
from .commands import Asked
from .flight_mode import AvailableMode
from .identity import Family, Stack, family_of, stack_of
from .motion import UNKNOWN as STILL_UNKNOWN
from .motion import Motion
from .observation import Heard, Observation, heard
from .pulse import Pulse, first_beat

if TYPE_CHECKING:
    from ..mavlink.definitions import Heartbeat

NO_MODES: Final[Mapping[int, AvailableMode]] = {}


class Said(NamedTuple):
    """The autopilot's own words on something, and since when it says them."""

    text: str
    since: Instant
    last: float


class Memory(NamedTuple):
    """One vehicle."""

    observation: Observation
    pulse: Pulse
    boot: Boot
    vehicle_type: int
    autopilot: int
    impostor: bool = False
    """Whether this ArduPilot has shown that it is INAV."""
    faults: sensors.Faults = sensors.NO_FAULTS
    latches: causes.Latches = causes.NO_LATCHES
    stop: estop.Stop = estop.NOTHING
    motion: Motion = STILL_UNKNOWN
    gps_motion: Motion = STILL_UNKNOWN
    """What the receiver's own ground speed says; only used while the autopilot has no estimate."""
    watch: outputs.Watch = outputs.NOT_WATCHED
    texts: statustext.Assembly = statustext.EMPTY
    modes: Mapping[int, AvailableMode] = NO_MODES
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

    @property
    def stack(self) -> Stack:
        """The software on the autopilot."""
        return stack_of(self.autopilot, self.impostor)

    @property
    def family(self) -> Family:
        """The kind of vehicle."""
        return family_of(self.vehicle_type)


def begin(heartbeat: Heartbeat, now: Instant) -> Memory:
    """The memory of a vehicle at its first heartbeat."""
    return Memory(
        observation=Observation(heartbeat=heard(heartbeat, now.mono, None)),
        pulse=first_beat(heartbeat, now),
        boot=Boot(now.mono),
        vehicle_type=heartbeat.type,
        autopilot=heartbeat.autopilot,
    )


def observed(memory: Memory, **what: Heard) -> Memory:
    """The memory with these fields of its observation replaced."""
    return memory._replace(observation=memory.observation._replace(**what))
