"""`VehicleModel`: which messages are due, and when. It has no socket, thread or clock: time is an argument."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from ..clock import Instant
from .codec import encode
from .event_table import VehicleFiles
from .file_server import FileServer
from .firmware import ARDUPILOT, PX4, not_armable
from .messages import (
    BUILDERS,
    HEARTBEAT,
    HIGH_LATENCY2,
    SYS_STATUS,
    Snapshot,
    applet_report,
    applet_value,
    heartbeat,
    statustexts,
)
from .scenario import Action, Scenario, Step, Text

REBOOT_GAP = 1.2
"""Seconds from the command to the first HEARTBEAT of the new boot, as recorded."""
PREARM_TICK = -1
"""An entry among the streams: the pre-arm checks run once a second."""
APPLET_TICK = -2
"""An entry among the streams: the applet repeats its report once a second."""
PREARM_REPEAT = 30.0
"""Seconds after which ArduPilot repeats why it cannot arm."""
REPEATS_FROM = 8.0
"""Seconds after the boot before a link repeats messages: earlier repeats look like messages of another boot."""
SAME_TIME = 1e-6
"""Tolerance of due times in seconds, because sums of intervals are not exact."""
CATCH_UP = 10.0
"""The most seconds of streams that are sent after a pause; more would flood the receiver."""


class Outgoing(NamedTuple):
    """A message and its sequence number."""

    message: Any
    """One of pymavlink or of `mavlink.definitions`."""
    seq: int

    def frame(self, system: int = 1, component: int = 1) -> bytes:
        """The unsigned MAVLink 2 frame, sent by this system and component."""
        return encode(self.message, system=system, component=component, sequence=self.seq)


class VehicleModel:
    """One vehicle that plays a scenario. `start` and all times are seconds on a monotonic clock.

    `speed` makes the scenario's steps pass faster; the streams keep their rates. `on_step` is called with each step.
    """

    def __init__(
        self,
        scenario: Scenario,
        start: float,
        speed: float = 1.0,
        loop: bool = False,
        on_step: Callable[[Step], None] = lambda step: None,
    ) -> None:
        self.scenario = scenario
        self.firmware = scenario.firmware
        self.state = scenario.start
        self._speed = speed
        self._loop = loop
        self._on_step = on_step
        self._out: list[Outgoing] = []
        self._repeats: deque[tuple[float, Outgoing]] = deque()
        """The messages that the link will repeat, each with its time."""
        self._now = start
        self._unix_us = 0
        self._schedule: list[tuple[float, Step]] = []
        self.files: VehicleFiles | None = None
        self._power_on(start)

    def serve(self, files: VehicleFiles | None) -> None:
        """Offer these files, with the metadata that names them; None: none."""
        self.files = files
        self._restart_server()

    def _restart_server(self) -> None:
        self.file_server = None if self.files is None else FileServer(self.files.files)

    def _power_on(self, at: float) -> None:
        self.state = self.scenario.start
        self.silent = self.ended = False
        self._schedule = []
        self._plan(at, self.scenario.steps)
        self._boot(at)

    def _boot(self, at: float) -> None:
        """Reset what a reboot resets."""
        self.boot = at
        self._restart_server()
        self._seq = 0
        self._texts = 0
        self.peer_seen = self.gcs_seen = False
        self._prearm_ok = not not_armable(self.state)
        self._prearm_said = at
        self._intervals = {HEARTBEAT: 1.0, PREARM_TICK: 1.0, APPLET_TICK: 1.0}
        self._intervals |= {message: 1 / hz for message, hz in self.default_streams.items()}
        self._due = {message: at + interval for message, interval in self._intervals.items()}
        for message in self.default_streams:
            self._due[message] += self.scenario.streams_after
        if self.scenario.satellite:
            del self._intervals[HEARTBEAT], self._due[HEARTBEAT]
            self._due[HIGH_LATENCY2] = at
        else:
            self._due[HEARTBEAT] = at

    def _plan(self, start: float, steps: Iterable[Step]) -> None:
        self._schedule += [(start + step.at / self._speed, step) for step in steps]
        self._schedule.sort(key=lambda planned: planned[0])

    @property
    def now(self) -> float:
        """The time of the last `run`."""
        return self._now

    @property
    def default_streams(self) -> dict[int, float]:
        """Message id to Hz: the streams that run without a request."""
        streams = self.scenario.streams
        return dict(self.firmware.streams if streams is None else streams)

    @property
    def finished(self) -> bool:
        """True when no step is left."""
        return self.ended or not self._schedule

    @property
    def listening(self) -> bool:
        """Whether the vehicle can receive a message now."""
        return not (self.silent or self.ended) and self._now >= self.boot

    def run(self, now: Instant) -> list[Outgoing]:
        """Advance to `now`; the messages that became due, in order."""
        unix_at_zero = now.unix_us - now.mono * 1e6
        for message, due in self._due.items():
            self._due[message] = max(due, now.mono - CATCH_UP)
        while (at := min(self._next_step(), *self._due.values())) <= now.mono + SAME_TIME and not self.ended:
            self._at(at, unix_at_zero)
            if self._next_step() <= at:
                self.do(self._schedule.pop(0)[1])
            else:
                self._stream(min(self._due, key=self._due.__getitem__))
        self._at(now.mono, unix_at_zero)
        out, self._out = self._out, []
        while self._repeats and self._repeats[0][0] <= now.mono:
            out.append(self._repeats.popleft()[1])
        return out

    def _next_step(self) -> float:
        return self._schedule[0][0] if self._schedule else float("inf")

    def _at(self, mono: float, unix_at_zero: float) -> None:
        self._now = mono
        self._unix_us = round(unix_at_zero + mono * 1e6)

    def _stream(self, message_id: int) -> None:
        self._due[message_id] += self._intervals[message_id]
        if message_id == PREARM_TICK:
            self._check_prearm()
        elif message_id == APPLET_TICK:
            self._report_stop()
        elif self.state.initialised or message_id != SYS_STATUS:
            self.send(BUILDERS[message_id](self.snapshot()))

    def _check_prearm(self) -> None:
        """ArduPilot announces failing checks when they start to fail, and every 30 s after that."""
        before = self._prearm_ok
        self._prearm_ok = self.state.armed or not not_armable(self.state)
        if not self._prearm_ok and (before or self._now - self._prearm_said >= PREARM_REPEAT):
            self._prearm_said = self._now
            self.say_prearm()

    def say_prearm(self) -> None:
        """Announce every reason why the vehicle cannot be armed, if the firmware does so."""
        if self.firmware.prearm_prefix:
            for reason in not_armable(self.state):
                self.say(Text(2, self.firmware.prearm_prefix + reason))

    def _report_stop(self) -> None:
        """The applet reports to a peer, as texts do: at once on a change, and a second after its last report."""
        if self.state.applet and self._heard:
            self.send(applet_report(self.snapshot()))
            self._due[APPLET_TICK] = self._now + self._intervals[APPLET_TICK]

    @property
    def _heard(self) -> bool:
        """Whether the link is active for ArduPilot: it has received a message, or streams run."""
        return self.peer_seen or max(self._intervals) > HEARTBEAT

    def snapshot(self) -> Snapshot:
        """The inputs of a message, at the current time."""
        boot_ms = round(max(0.0, self._now - self.boot) * 1000)
        return Snapshot(self.firmware, self.state, self._prearm_ok, boot_ms, self._unix_us)

    def send(self, message: NamedTuple) -> None:
        """Send a message now. A message on a cut link also uses a sequence number."""
        if self._now < self.boot or self.ended:
            return
        if not self.silent:
            outgoing = Outgoing(message, self._seq)
            self._out.append(outgoing)
            if self.scenario.repeats is not None and self._now >= self.boot + REPEATS_FROM:
                self._repeats.append((self._now + self.scenario.repeats, outgoing))
        self._seq = (self._seq + 1) % 256

    def say(self, text: Text) -> None:
        """Send a STATUSTEXT: PX4 only to a ground station, others on an active link."""
        if not self.scenario.satellite and (self.gcs_seen if self.firmware.autopilot == PX4 else self._heard):
            self._texts = self._texts % 0xFFFF + 1
            for message in statustexts(self.firmware, text, self._texts):
                self.send(message)

    def do(self, step: Step) -> None:
        """Apply a step now."""
        before, self.state = self.state, self.state._replace(**step.changes)
        if step.note:
            self._on_step(step)
        # ArduPilot reports a mode change at once, arming with the next regular HEARTBEAT; PX4 reports both with it.
        at_once = self.firmware.autopilot == ARDUPILOT and not self.scenario.satellite
        if self.state.custom_mode != before.custom_mode and at_once:
            self.send(heartbeat(self.snapshot()))
        if applet_value(self.state) != applet_value(before):
            self._report_stop()
        for step_text in step.texts:
            self.say(step_text)
        text = self.firmware.armed_text if self.state.armed else self.firmware.disarmed_text
        if self.state.armed != before.armed and text:
            self.say(Text(6, text))
        if step.action is not None:
            self._act(step.action)

    def _act(self, action: Action) -> None:
        if action in (Action.SILENCE, Action.RESUME):
            self.silent = action is Action.SILENCE
        elif action is Action.REBOOT:
            self.do(Step(0.0, "", {"safety_switch": True}))  # as ArduPilot does before it goes; the applet reports it
            self.state = self.firmware.booting._replace(applet=self.state.applet)
            self._boot(self._now + REBOOT_GAP)
            self._plan(self.boot, self.firmware.boot)
        elif self._loop:
            self._power_on(self._now + REBOOT_GAP)
        else:
            self.ended = True

    def interval(self, message_id: int) -> float | None:
        """The seconds between two messages of a stream; None: it does not run."""
        return self._intervals.get(message_id)

    def request(self, message_id: int, interval: float | None) -> None:
        """Stream a message every `interval` seconds from now on; None stops it."""
        self._intervals.pop(message_id, None)
        self._due.pop(message_id, None)
        if interval is not None:
            self._intervals[message_id] = interval
            self._due[message_id] = self._now + interval
