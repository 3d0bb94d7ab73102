"""`UrRobotHW`: the hardware interface of an arm of Universal Robots. It never sends a command that moves anything."""

from __future__ import annotations

import logging
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
    RobotMode,
    RobotStatus,
)
from ..tcp_source import FaultLog, TcpSource
from .dashboard import Dashboard
from .rtde import ProtocolError, Session, Step
from .status import NAMES, Context, Joints, Sample, sample_of, values_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...clock import Instant
    from ...links.tcp import TcpLink

log = logging.getLogger(__name__)

RATE: Final = 10.0
"""Samples a second."""
SILENCE: Final = 3.0
"""Seconds without a sample after which the link is lost, and a connection is of no use."""
ANSWER: Final = 1.0
"""Seconds to wait for the version of the controller, which only a person reads."""
ASSUMED: Final = {"none": RobotMode.UNKNOWN, "auto": RobotMode.AUTO, "manual": RobotMode.MANUAL}


@dataclass(frozen=True)
class UrOptions(Options):
    """The options of the hardware interface `ur`."""

    host: Annotated[str, Option("the controller")]
    port: Annotated[float, Option("RTDE port", low=1, high=65535)] = 30004
    dashboard_port: Annotated[float, Option("port of the dashboard server", low=1, high=65535)] = 29999
    assume_mode: Annotated[str, Option("the mode if the dashboard does not report it", choices=tuple(ASSUMED))] = "none"


class UrRobotHW(RobotHW):
    """One arm, as a handle with the name of the interface."""

    options_type = UrOptions
    stops_cut_power = False
    """A stop of category 1 brakes under power: e_stopped comes before drives_powered FALSE."""

    def __init__(self, context: HardwareContext) -> None:
        super().__init__()
        options = UrOptions.read("ur", context.options)
        self._assumed = ASSUMED[options.assume_mode]
        self._robot = IndustrialRobotStatusHandle(context.name)
        self._robot.detail = Detail(link=LinkState.NEVER_SEEN)
        self.handles.register_handle(self._robot)
        self._session: Session | None = None
        self._dashboard = Dashboard()
        self._sample_by = math.inf
        """When the connection is given up, unless a sample arrives before: monotonic seconds."""
        self._go_on_at = math.inf
        """When the session goes on without the version of the controller: monotonic seconds."""
        self._sample: Sample | None = None
        self._joints = Joints()
        self._name, self._log = context.name, FaultLog(context.name)
        self._missing: tuple[str, ...] = ()
        """The missing values that were last logged."""
        self._rtde: TcpSource | None = None
        self._dash: TcpSource | None = None
        if not context.replay:
            self._rtde = TcpSource(options.host, options.port, self._heard_rtde)
            self._dash = TcpSource(options.host, options.dashboard_port, self._heard_dashboard)

    def sources(self) -> Sequence[TcpSource]:
        """RTDE and the dashboard server."""
        return [source for source in (self._rtde, self._dash) if source is not None]

    def close(self) -> None:
        """Close both connections."""
        for source in self.sources():
            source.close()

    def next_due(self, until: float = -math.inf) -> float:
        """When a sample is overdue, an answer is too old, or a question is due."""
        heard = self._robot.heard_at
        due = math.inf if heard is None or self._sample is None else heard + SILENCE
        due = math.nextafter(min(due, self._sample_by), math.inf)
        due = min(due, self._go_on_at)
        if self._dash is not None and self._dash.link.connected:
            due = min(due, self._dashboard.ask_at)
        return due

    def read(self, now: Instant) -> None:
        """Put the latest sample into the handle."""
        for source in self.sources():
            source.turn(now)
        heard = self._robot.heard_at
        if heard is not None and now.mono - heard > SILENCE:
            self._lose(now)
        if self._sample is None or heard is None:
            return
        context = Context(
            self._joints.value,
            self._dashboard.mode(now.mono),
            self._assumed,
            None if self._session is None else self._session.firmware,
        )
        self.set_status(self._robot, *values_of(self._sample, context, self._robot.detail, now.unix_us, heard))

    def write(self, now: Instant) -> None:
        """Begin a session on each new connection, and ask what is due."""
        if self._rtde is None or self._dash is None:
            return
        if self._rtde.is_new():
            self._session, self._sample_by, self._go_on_at = Session(NAMES, RATE), now.mono + SILENCE, math.inf
        if self._dash.is_new():
            self._dashboard = Dashboard()
        if self._session is not None:
            self._continue(self._session, self._rtde.link, now)
        if self._dash.link.connected and (question := self._dashboard.ask(now.mono)):
            self._dash.link.send(question)

    def _continue(self, session: Session, rtde: TcpLink, now: Instant) -> None:
        """Send what the session asks. After SILENCE without a sample it is of no use."""
        if now.mono > self._sample_by:
            self._give_up(f"{session.step.value} did not arrive within {SILENCE:g} s", now)
            return
        if now.mono >= self._go_on_at:
            session.go_on()
        if session.sent and rtde.connected:
            out, session.sent = session.sent, b""
            rtde.send(out)
            self._go_on_at = now.mono + ANSWER if session.step is Step.CONTROLLER else math.inf

    def _give_up(self, why: str, now: Instant) -> None:
        """Nothing more of this connection counts. If it has already ended, the link has logged that."""
        self._session, self._sample_by, self._go_on_at = None, math.inf, math.inf
        if self._rtde is not None and self._rtde.link.connected:
            self._log.fault(why, now.mono)
            self._rtde.link.reconnect()

    def forget(self) -> None:
        """No sample was heard."""
        super().forget()
        self._sample, self._joints = None, Joints()
        self._robot.detail = Detail(link=LinkState.NEVER_SEEN)

    def _heard_rtde(self, data: bytes, now: Instant) -> None:
        session = self._session
        if session is None:  # the controller does not speak first
            return
        try:
            samples = session.feed(data)
        except ProtocolError as error:
            self._give_up(str(error), now)
            return
        if session.missing not in ((), self._missing):
            self._missing = session.missing
            log.warning("%s: the controller does not know %s", self._name, ", ".join(self._missing))
        for values in samples:
            self._take(sample_of(values), now)

    def _take(self, sample: Sample, now: Instant) -> None:
        self._log.works()
        self._sample = sample
        self._joints.heard(sample.joint_speeds, now.mono)
        self._robot.heard_at, self._sample_by = now.mono, now.mono + SILENCE

    def _heard_dashboard(self, data: bytes, now: Instant) -> None:
        self._dashboard.feed(data, now.mono)

    def _lose(self, now: Instant) -> None:
        """Nothing is known after SILENCE."""
        if self._sample is None:
            return
        self._sample, self._joints = None, Joints()
        before = self._robot.detail
        stale = Inhibit("LINK_STALE", None, now.unix_us)
        vehicle = before.vehicle._replace(flight_mode=None, state=None)
        self.set_status(self._robot, RobotStatus(), Detail(inhibits=(stale,), vehicle=vehicle, link=LinkState.LOST), {})
