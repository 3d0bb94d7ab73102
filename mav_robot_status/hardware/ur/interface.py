"""`UrRobotHW`: the hardware interface of an arm of Universal Robots. It never sends a command that moves anything."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

from ...clock import Instant
from ...interface import HardwareContext, Option, Options, RobotMode
from ..tcp_arm import TcpArm, Values
from ..tcp_source import TcpSource
from .dashboard import Dashboard
from .rtde import Session, Step
from .status import NAMES, Context, Joints, Sample, sample_of, values_of

log = logging.getLogger(__name__)

RATE: Final = 10.0
"""Samples a second."""
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


class UrRobotHW(TcpArm[Sample]):
    """One arm, as a handle with the name of the interface. RTDE tells its status, the dashboard server its mode."""

    options_type = UrOptions

    def __init__(self, context: HardwareContext) -> None:
        options = UrOptions.read("ur", context.options)
        self._assumed = ASSUMED[options.assume_mode]
        self._name = context.name
        self._session = Session(NAMES, RATE)
        self._dashboard = Dashboard()
        self._go_on_at = math.inf
        """When the session goes on without the version of the controller: monotonic seconds."""
        self._missing: tuple[str, ...] = ()
        """The missing values that were last logged."""
        super().__init__(context, options.host, options.port)
        self._dash = None
        if not context.replay:
            self._dash = TcpSource(options.host, options.dashboard_port, self._heard_dashboard)

    def sources(self) -> Sequence[TcpSource]:
        """RTDE and the dashboard server."""
        return [source for source in (self.source, self._dash) if source is not None]

    def next_due(self, until: float = -math.inf) -> float:
        """When a sample is overdue, a question is due, or an answer is not waited for any more."""
        due = min(super().next_due(until), self._go_on_at)
        if self._dash is not None and self._dash.link.connected:
            due = min(due, self._dashboard.ask_at)
        return due

    def write(self, now: Instant) -> None:
        """Begin a session on each new connection, and ask what is due."""
        super().write(now)
        if self.source is None or self._dash is None:
            return
        if now.mono >= self._go_on_at:
            self._session.go_on()
        if self._session.sent and self.source.link.connected:
            out, self._session.sent = self._session.sent, b""
            self.source.link.send(out)
            self._go_on_at = now.mono + ANSWER if self._session.step is Step.CONTROLLER else math.inf
        if self._dash.is_new():
            self._dashboard = Dashboard()
        if self._dash.link.connected and (question := self._dashboard.ask(now.mono)):
            self._dash.link.send(question)

    def begin(self) -> None:
        """Ask for the values."""
        self._session, self._go_on_at = Session(NAMES, RATE), math.inf

    def feed(self, data: bytes, now: Instant) -> Sample | None:
        """The last sample in `data`; the speeds of the joints count in each."""
        samples = [sample_of(values) for values in self._session.feed(data)]
        if self._session.missing not in ((), self._missing):
            self._missing = self._session.missing
            log.warning("%s: the controller does not know %s", self._name, ", ".join(self._missing))
        for sample in samples:
            self._joints.heard(sample.joint_speeds, now.mono)
        return samples[-1] if samples else None

    def values(self, message: Sample, heard_at: float, now: Instant) -> Values:
        """The status that a sample and the dashboard prove."""
        operational = self._dashboard.mode(now.mono)
        context = Context(self._joints.value, operational, self._assumed, self._session.firmware)
        return values_of(message, context, self.robot.detail, now.unix_us, heard_at)

    def awaited(self) -> str:
        """The next answer of the controller."""
        return f"{self._session.step.value} did not arrive"

    def forget(self) -> None:
        """No sample was heard."""
        super().forget()
        self._joints = Joints()

    def lose(self, now: Instant) -> None:
        """Nothing is known after SILENCE."""
        super().lose(now)
        self._joints = Joints()

    def _heard_dashboard(self, data: bytes, now: Instant) -> None:
        self._dashboard.feed(data, now.mono)
