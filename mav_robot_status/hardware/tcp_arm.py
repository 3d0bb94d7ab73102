"""`TcpArm`: an arm whose controller tells its status on a TCP connection. A subclass knows the protocol."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Sequence
from typing import Final, Generic, NamedTuple, TypeVar

from ..clock import Instant
from ..errors import ProtocolError
from ..interface import (
    Detail,
    Evidence,
    HardwareContext,
    IndustrialRobotStatusHandle,
    Inhibit,
    LinkState,
    RobotHW,
    RobotStatus,
)
from .tcp_source import FaultLog, TcpSource

SILENCE: Final = 3.0
"""Seconds without a message after which the link is lost, and a connection is of no use."""

Message = TypeVar("Message")
"""What the controller says at once: all inputs of a status."""


class Values(NamedTuple):
    """The values for a handle."""

    status: RobotStatus
    detail: Detail
    evidence: dict[str, Evidence]


class TcpArm(RobotHW, Generic[Message]):
    """One arm, as a handle with the name of the interface. It has no connection in a replay."""

    stops_cut_power = False
    """An arm may brake under power: e_stopped comes before drives_powered FALSE."""

    def __init__(self, context: HardwareContext, host: str, port: float) -> None:
        super().__init__()
        self.robot = IndustrialRobotStatusHandle(context.name)
        self.handles.register_handle(self.robot)
        self.source = None if context.replay else TcpSource(host, port, self._heard)
        self._log = FaultLog(context.name)
        self._open = False
        """Whether the present connection is of use."""
        self._message_by = math.inf
        """When the connection is given up, unless a message arrives before: monotonic seconds."""
        self.forget()

    @abstractmethod
    def begin(self) -> None:
        """A new connection begins: nothing of the old one counts."""

    @abstractmethod
    def feed(self, data: bytes, now: Instant) -> Message | None:
        """Process received bytes. Returns the last whole message in them. Raises ProtocolError."""

    @abstractmethod
    def values(self, message: Message, heard_at: float, now: Instant) -> Values:
        """The values for the handle, from the latest message and `self.robot.detail`, the previous detail."""

    @abstractmethod
    def awaited(self) -> str:
        """What has not arrived if the connection is silent."""

    def sources(self) -> Sequence[TcpSource]:
        """The connection."""
        return () if self.source is None else (self.source,)

    def close(self) -> None:
        """Close every connection."""
        for source in self.sources():
            source.close()

    def next_due(self, until: float = -math.inf) -> float:
        """When a message is overdue."""
        heard = self.robot.heard_at
        due = math.inf if heard is None or self._message is None else heard + SILENCE
        return math.nextafter(min(due, self._message_by), math.inf)

    def read(self, now: Instant) -> None:
        """Put the latest message into the handle."""
        for source in self.sources():
            source.turn(now)
        heard = self.robot.heard_at
        if heard is None or self._message is None:
            return
        if now.mono - heard > SILENCE:
            self.lose(now)
        else:
            self.set_status(self.robot, *self.values(self._message, heard, now))

    def write(self, now: Instant) -> None:
        """Give up a silent connection."""
        self._begin(now)
        if now.mono > self._message_by:
            self._give_up(f"{self.awaited()} within {SILENCE:g} s", now)

    def forget(self) -> None:
        """Nothing was heard."""
        super().forget()
        self._message: Message | None = None
        self.robot.detail = Detail(link=LinkState.NEVER_SEEN)

    def lose(self, now: Instant) -> None:
        """Nothing is known after SILENCE."""
        self._message = None
        stale = Inhibit("LINK_STALE", None, now.unix_us)
        vehicle = self.robot.detail.vehicle._replace(flight_mode=None, state=None)
        self.set_status(self.robot, RobotStatus(), Detail(inhibits=(stale,), vehicle=vehicle, link=LinkState.LOST), {})

    def _begin(self, now: Instant) -> None:
        if self.source is not None and self.source.is_new():
            self._open, self._message_by = True, now.mono + SILENCE
            self.begin()

    def _heard(self, data: bytes, now: Instant) -> None:
        self._begin(now)
        if not self._open:
            return
        try:
            message = self.feed(data, now)
        except ProtocolError as error:
            self._give_up(str(error), now)
            return
        if message is not None:
            self._log.works()
            self._message, self.robot.heard_at, self._message_by = message, now.mono, now.mono + SILENCE

    def _give_up(self, why: str, now: Instant) -> None:
        """Nothing more of this connection counts. If it has already ended, the link has logged that."""
        self._open, self._message_by = False, math.inf
        if self.source is not None and self.source.link.connected:
            self._log.fault(why, now.mono)
            self.source.link.reconnect()
