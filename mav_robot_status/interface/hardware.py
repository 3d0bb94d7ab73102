"""The port between a robot's hardware interface and the gateway.

A hardware interface converts the messages of a robot to statuses in handles. Its sources do the I/O.
The gateway polls the sources and calls everything in one thread. One turn of the gateway is ros_control's: `read` the
robot into the handles, update the controllers, `write` to the robot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

from ..clock import Instant
from .handle import IndustrialRobotStatusHandle
from .registry import IndustrialRobotStatusInterface, InterfaceManager
from .status import Detail, Evidence, RobotStatus


class IoSource(Protocol):
    """One socket, serial device or timer of a hardware interface. Nothing here blocks, and no input makes it raise."""

    def fileno(self) -> int:
        """The descriptor to poll for input. -1: there is nothing to poll now. It may change between two turns."""

    def receive(self, now: Instant, limit: int) -> int | None:
        """Read the pending input, at most `limit` datagrams or pieces, and hand it to the hardware interface.

        Called when the descriptor is readable. `read` of the hardware interface follows in the same turn. Returns how
        many there were, or None if that is not counted: above 2000 a second, input gathers for 2 ms before a call.
        """

    def next_due(self) -> float:
        """When (monotonic seconds) `service` has something to do. inf: never; -inf: at once."""

    def service(self, now: Instant) -> None:
        """Do what is due: connect, reconnect, send a request."""

    def close(self) -> None:
        """Close the descriptor. The gateway may call this again."""


class HardwareInterface(Protocol):
    """One robot, or several. `RobotHW` is a base class with a default for everything but `read`.

    The gateway calls `read` in every turn, at least once a second, and after each `receive` of a source.
    """

    handles: IndustrialRobotStatusInterface
    """The handles. The constructor registers those that the configuration names; others may follow."""
    changed: bool
    """True after `read` has put another status or detail into a handle. The gateway sets it back to False."""

    def read(self, now: Instant) -> None:
        """Put into the handles what is known at `now`. Fields whose messages timed out become UNKNOWN here.

        A second call with the same `now` changes nothing.
        """

    def write(self, now: Instant) -> None:
        """Send to the robot what is due at `now`. The gateway calls this after the controllers have been updated."""

    def next_due(self, until: float = -math.inf) -> float:
        """When (monotonic seconds) `read`, `write` or a source has something to do. inf: only when input arrives.

        `until` is a hint that may be ignored: an answer before `until` must be exact, a later one may be too
        early.
        """

    def explain(self, handle: str, now: Instant) -> None:
        """Update the evidence in this handle to `now`. Called only while a user views it."""

    def forget(self) -> None:
        """Reset to the state before the first message. The handles stay; their statuses become UNKNOWN."""

    def sources(self) -> Sequence[IoSource]:
        """The sources to poll now. Called in every turn."""

    def close(self) -> None:
        """The last call: close all sources. The gateway may call this again."""


class HardwareContext(NamedTuple):
    """The arguments of a hardware interface: the registered class is called as `make(context)`.

    It raises UsageError for an invalid option, and LinkError for a port or device that it cannot open.
    """

    name: str
    """Its `name` in the configuration. By convention the handle of a single robot has this name."""
    options: Mapping[str, object] = {}
    """Its other options in the configuration, as plain values."""
    replay: bool = False
    """True while a recorded log is replayed. Register the handles and open nothing."""


class RobotHW(InterfaceManager):
    """ros_control's RobotHW: a base class for hardware interfaces. A subclass registers handles and overrides `read`.

    An interface with a single socket can be its own source: it adds `fileno` and `receive`, and `sources` returns
    `[self]`.
    """

    stops_cut_power = True
    """Whether an emergency stop removes the power at once. Then a robot that is stopped and powered is a fault."""
    motion_needs_power = True
    """Whether the robot cannot move while its drives have no power. False: a motion command may switch them on."""

    def __init__(self) -> None:
        super().__init__()
        self.handles = IndustrialRobotStatusInterface()
        self.changed = False
        self.register_interface(self.handles)

    def set_status(
        self,
        handle: IndustrialRobotStatusHandle,
        status: RobotStatus,
        detail: Detail | None = None,
        evidence: Mapping[str, Evidence] | None = None,
    ) -> None:
        """Put a status into a handle, and set `changed` if it differs. None keeps the present value."""
        if status != handle.status:
            handle.status, self.changed = status, True
        if detail is not None and detail != handle.detail:
            handle.detail, self.changed = detail, True
        if evidence is not None:
            handle.evidence = evidence

    def read(self, now: Instant) -> None:
        """Does nothing; a subclass overrides this."""

    def write(self, now: Instant) -> None:
        """Send nothing."""

    def next_due(self, until: float = -math.inf) -> float:
        """Never."""
        return math.inf

    def service(self, now: Instant) -> None:
        """Nothing is due."""

    def explain(self, handle: str, now: Instant) -> None:
        """Does nothing: `read` updates the evidence."""

    def forget(self) -> None:
        """The handles are as created."""
        for handle in self.handles:
            self.set_status(handle, RobotStatus(), Detail(handle.detail.system, handle.detail.component), {})
            handle.heard_at = None

    def sources(self) -> Sequence[IoSource]:
        """None."""
        return ()

    def close(self) -> None:
        """Nothing is open."""
