"""What a controller expects of the places where its statuses go, and what those are given to work with."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, TextIO

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..clock import Instant
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


class MavlinkPort(Protocol):
    """Where MAVLink goes out: to everyone who listens, under our identity."""

    def send(self, message: Any, system: int) -> None:
        """Send a message of `mavlink.definitions` about the vehicle with this system id."""


class PublisherContext(NamedTuple):
    """What a publisher is created with."""

    options: Mapping[str, object]
    """The options of its mapping in the configuration."""
    mavlink: MavlinkPort
    stdout: TextIO
    patient: bool = False
    """True on replay: nothing is lost to a slow reader, the log waits instead."""
