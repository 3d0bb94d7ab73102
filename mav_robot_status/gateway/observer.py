"""The base class of parts that observe a running gateway without changing it."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..clock import Instant
    from ..interface import IndustrialRobotStatusInterface
    from ..links.base import Address
    from ..mavlink.framing import Frame


class Observer:
    """Called in the gateway's thread. A subclass overrides only the methods that it needs.

    A gateway without observers makes no calls. An exception of an observer ends the gateway.
    """

    def on_data(self, data: bytes, source: Address, now: Instant) -> None:
        """A link received these bytes: a datagram, or a piece of a stream."""

    def on_frame(self, frame: Frame, now: Instant) -> None:
        """The MAVLink hardware interface processed a frame of a vehicle that has a handle."""

    def on_tick(self, handles: IndustrialRobotStatusInterface, now: Instant) -> None:
        """The pipeline ticked: the handles and the publishers are up to date at `now`."""
