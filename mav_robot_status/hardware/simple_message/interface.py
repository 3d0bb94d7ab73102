"""`SimpleMessageRobotHW`: a robot whose controller serves its status to ROS-Industrial. It sends nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final

from ...interface import (
    Detail,
    HardwareContext,
    IndustrialRobotStatusHandle,
    Inhibit,
    LinkState,
    Option,
    Options,
    RobotHW,
    RobotStatus,
)
from ...simple_message import ORDERS, STATE_PORT, FrameError, StatusFrame, StatusReader
from ..tcp_source import FaultLog, TcpSource
from .status import values_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...clock import Instant

SILENCE: Final = 3.0
"""Seconds without a frame after which the link is lost."""


@dataclass(frozen=True)
class SimpleMessageHardwareOptions(Options):
    """The options of the hardware interface `simple_message`."""

    host: Annotated[str, Option("the controller, or another gateway")]
    port: Annotated[float, Option("state port", low=1, high=65535)] = STATE_PORT
    byte_order: Annotated[str, Option("byte order of the controller", choices=tuple(ORDERS))] = "little"


class SimpleMessageRobotHW(RobotHW):
    """One robot, as a handle with the name of the interface."""

    options_type = SimpleMessageHardwareOptions
    stops_cut_power = False
    """An arm may brake under power: e_stopped comes before drives_powered FALSE."""
    motion_needs_power = False
    """A controller may switch the drives on for a motion command."""

    def __init__(self, context: HardwareContext) -> None:
        super().__init__()
        options = SimpleMessageHardwareOptions.read("simple_message", context.options)
        self._robot = IndustrialRobotStatusHandle(context.name)
        self._robot.detail = Detail(link=LinkState.NEVER_SEEN)
        self.handles.register_handle(self._robot)
        self._byte_order = options.byte_order
        self._reader = StatusReader(options.byte_order)
        self._frame: StatusFrame | None = None
        self._frame_by = math.inf
        """When the connection is given up, unless a frame arrives before: monotonic seconds."""
        self._log = FaultLog(context.name)
        self._source = None if context.replay else TcpSource(options.host, options.port, self._heard)

    def sources(self) -> Sequence[TcpSource]:
        """The connection."""
        return () if self._source is None else (self._source,)

    def close(self) -> None:
        """Close the connection."""
        if self._source is not None:
            self._source.close()

    def next_due(self, until: float = -math.inf) -> float:
        """When a frame is overdue."""
        heard = self._robot.heard_at
        due = math.inf if heard is None or self._frame is None else heard + SILENCE
        return math.nextafter(min(due, self._frame_by), math.inf)

    def read(self, now: Instant) -> None:
        """Put the latest frame into the handle."""
        for source in self.sources():
            source.turn(now)
        heard = self._robot.heard_at
        if heard is not None and now.mono - heard > SILENCE:
            self._lose(now)
        if self._frame is not None and heard is not None:
            self.set_status(self._robot, *values_of(self._frame, self._robot.detail, now.unix_us, heard))

    def write(self, now: Instant) -> None:
        """Make a silent connection again."""
        self._begin(now)
        if now.mono > self._frame_by:
            self._give_up(f"no status arrived within {SILENCE:g} s", now)

    def forget(self) -> None:
        """No frame was heard."""
        super().forget()
        self._frame = None
        self._robot.detail = Detail(link=LinkState.NEVER_SEEN)

    def _begin(self, now: Instant) -> None:
        """Start afresh on a new connection: nothing of the old one counts."""
        if self._source is not None and self._source.is_new():
            self._reader, self._frame_by = StatusReader(self._byte_order), now.mono + SILENCE

    def _heard(self, data: bytes, now: Instant) -> None:
        self._begin(now)
        try:
            frames = self._reader.feed(data)
        except FrameError as error:
            self._give_up(str(error), now)
            return
        if frames:
            self._log.works()
            self._frame, self._robot.heard_at, self._frame_by = frames[-1], now.mono, now.mono + SILENCE

    def _give_up(self, why: str, now: Instant) -> None:
        """The connection is of no use. If it has already ended, the link has logged that."""
        self._frame_by = math.inf
        if self._source is not None and self._source.link.connected:
            self._log.fault(why, now.mono)
            self._source.link.reconnect()

    def _lose(self, now: Instant) -> None:
        """Nothing is known after SILENCE."""
        if self._frame is None:
            return
        self._frame = None
        stale = Inhibit("LINK_STALE", None, now.unix_us)
        vehicle = self._robot.detail.vehicle
        self.set_status(self._robot, RobotStatus(), Detail(inhibits=(stale,), vehicle=vehicle, link=LinkState.LOST), {})
