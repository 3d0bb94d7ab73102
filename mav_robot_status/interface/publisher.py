"""What a controller expects of the places where its statuses go, and what those are given to work with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TextIO

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Hashable, Mapping, Sequence

    from ..clock import Instant
    from .metrics import Metrics
    from .status import RobotStatusMsg


class Publisher(Protocol):
    """One output. It never blocks: what cannot take a message now says so, and is asked again soon after."""

    periodic: bool
    """False if only changes are wanted here."""

    def busy(self) -> bool:
        """True while a message cannot be taken (realtime_tools' trylock that fails)."""

    def publish(self, msg: RobotStatusMsg) -> None:
        """Take a message; only called while not busy."""

    def service(self, now: Instant) -> float | None:
        """Do what is waiting (a rest of a line, a change held back); when to be called again, None if nothing waits."""

    def close(self) -> None:
        """The last call: send what is left, let go of what is held."""


class Audience(NamedTuple):
    """Somebody who hears MAVLink from us: an output, or one peer on a link."""

    key: Hashable
    """Stays the same for as long as the audience is there."""
    interval: float | None = None
    """Seconds between two ROBOT_STATUS, as asked for with MAV_CMD_SET_MESSAGE_INTERVAL, whichever vehicle they are
    about. None: the default. inf: none are wanted."""
    mirror: bool = False
    """True if ground stations are there, which may not know ROBOT_STATUS; False towards a vehicle."""


class MavlinkPort(Protocol):
    """Where MAVLink goes out, under our identity."""

    def audiences(self) -> Sequence[Audience]:
        """Everyone who hears what we say about vehicles, now."""

    def requests(self) -> Collection[tuple[Hashable, int]]:
        """Who asked, since the last call, for one ROBOT_STATUS: keys of audiences, and system ids of vehicles."""

    def send(self, message: Any, system: int, audience: Audience) -> None:
        """Send a message of `mavlink.definitions` about the vehicle with this system id."""


class PublisherContext(NamedTuple):
    """What a publisher is created with."""

    options: Mapping[str, object]
    """The options of its mapping in the configuration."""
    mavlink: MavlinkPort
    stdout: TextIO
    patient: bool = False
    """True on replay: nothing is lost to a slow reader, the log waits instead."""
    explain: Callable[[str, Instant], Mapping[str, Any] | None] | None = None
    """Why each field of a handle has its value, as `explain --as-json` tells it; None for an unknown handle, or one
    whose vehicle was not heard. Only for the gateway's own thread, and not for free: a tenth of a millisecond."""
    metrics: Callable[[Instant], Metrics] | None = None
    """What the gateway counts and what is so now, as `/metrics` tells it. Only for the gateway's own thread."""
