"""What the gateway expects of a controller: ros_control's life cycle, and the time of the next update."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from ..clock import Instant
from .handle import IndustrialRobotStatusHandle
from .publisher import Publisher
from .registry import InterfaceManager


class Controller(Protocol):
    """A controller. The gateway makes it without arguments; times are instants and monotonic seconds."""

    handle: IndustrialRobotStatusHandle
    """The handle that it reads, after `init`."""

    def init(self, hw: InterfaceManager, parameters: Mapping[str, object], publishers: Sequence[Publisher]) -> None:
        """Read the parameters and find the handle. Raises MavRobotStatusError if that fails."""

    def starting(self, time: Instant) -> None:
        """The first `update` follows at once."""

    def update(self, time: Instant, period: float) -> None:
        """Publish what is due at `time`. `period`: seconds since the last update, or since `starting`."""

    def stopping(self, time: Instant) -> None:
        """No `update` follows, except after another `starting`."""

    def next_due(self, now: float) -> float:
        """When `update` has something to do unless the handle changes first; later than `now`.

        Called after each `update`. inf: only when the handle changes.
        """
