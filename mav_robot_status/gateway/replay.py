"""Replays a recorded log through the pipeline, at full speed, on the log's time."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final, NamedTuple

from ..clock import later
from ..interface import LinkState
from ..links.log import LogReader
from .live_hardware import combined, open_interface
from .logs.onboard_recording import OnboardRecording, form_of
from .logs.recorded_log import Recording
from .mavlink_hardware import robot_hw
from .pipeline import NEVER, Pipeline

if TYPE_CHECKING:
    from collections.abc import Collection, Hashable, Iterable, Sequence
    from typing import TextIO

    from ..clock import Instant
    from ..config import Config
    from ..hardware.mavlink.interface import MavlinkRobotHW
    from ..hardware.onboard_log.interface import OnboardLogRobotHW
    from ..interface import Audience
    from ..links.log import Stamped
    from .observer import Observer

log = logging.getLogger(__name__)

MOST_OVERDUE: Final = 3
"""Consecutive ticks that a third party's part may request without progress of the time."""


class NoMavlinkPort:
    """The MAVLink port of a replay: it has no receivers."""

    def audiences(self) -> Sequence[Audience]:
        """No receivers."""
        return ()

    def requests(self) -> Collection[tuple[Hashable, int]]:
        """No requests."""
        return ()

    def send(self, message: NamedTuple, system: int, audience: Audience) -> None:
        """Send nothing."""


class RecordedLink(NamedTuple):
    """Where the frames of a log were heard. It has the timeout of the first link of the configuration."""

    heartbeat_timeout: float | None

    def __str__(self) -> str:
        return "the log"


def replay(config: Config, path: str, stdout: TextIO, *, raw: bool = False) -> None:
    """Replay the log at `path`. `raw`: the log has no time stamps.

    Raises UsageError if it cannot be read, BrokenPipeError if stdout is closed.
    """
    recording = open_recording(path, raw)
    log.info("replaying %s", path)
    pipeline = ReplayPipeline(config, stdout, recording=recording)
    try:
        pipeline.now = run_through(pipeline, recording)
    finally:
        pipeline.close(pipeline.now)
    log.info("%s", recording.summary())


def open_recording(path: str, raw: bool = False) -> Recording | OnboardRecording:
    """Open a log. Its first bytes decide what it is. Raises UsageError if it cannot be read."""
    reader = LogReader(path)
    form = None if raw else form_of(reader.head)
    return Recording(reader, raw) if form is None else OnboardRecording(reader, form)


class ReplayPipeline(Pipeline):
    """A pipeline for a recorded log."""

    def __init__(
        self,
        config: Config,
        stdout: TextIO,
        observers: Sequence[Observer] = (),
        recording: Recording | OnboardRecording | None = None,
    ) -> None:
        """Make the parts. Hardware interfaces other than that of the log register their handles and open nothing."""
        self.vehicles = robot_hw(config)
        """Those of a log of MAVLink."""
        own = recording.hardware(config) if isinstance(recording, OnboardRecording) else None
        self.log_hw: MavlinkRobotHW | OnboardLogRobotHW = own or self.vehicles
        """That of the log."""
        others = [open_interface(interface, replay=True, clock=lambda: self.now) for interface in config.interfaces]
        hw = combined(config, self.log_hw, others)
        self.max_gap = config.max_gap
        self.source = next((RecordedLink(link.heartbeat_timeout) for link in config.links), RecordedLink(None))
        super().__init__(config, hw, NoMavlinkPort(), stdout, patient=True, observers=observers)

    def hears_nothing(self) -> bool:
        """Whether every vehicle is lost, or was never heard."""
        return all(handle.detail.link is not LinkState.CONNECTED for handle in self.hw.handles)

    def close(self, now: Instant) -> None:
        """Stop the controllers; close the publishers and the hardware."""
        try:
            super().close(now)
        finally:
            self.hw.close()


def run_through(pipeline: ReplayPipeline, recording: Iterable[Stamped]) -> Instant:
    """Feed a recording to the pipeline. Returns the last instant; everything due before it is done."""
    hw = pipeline.log_hw
    last = NEVER
    due = -math.inf  # time starts at the first record
    for now, frame, new_segment in recording:
        if new_segment:
            pipeline.forget(last)
        elif due < now.mono or hw.deadline < now.mono:
            if last is NEVER:
                pipeline.tick(now)  # publish configured vehicles before their first heartbeat
                last = now
            due = pipeline.next_due(last.mono)
            if due < now.mono:
                run_until(pipeline, last, now)
                due = pipeline.next_due(now.mono)
        last = now
        if frame is None:
            continue
        hw.on_frame(frame, now, pipeline.source)
        if hw.deadline == -math.inf:
            pipeline.tick(now)
            due = pipeline.next_due(now.mono)
    return last


def run_until(pipeline: ReplayPipeline, last: Instant, until: Instant) -> None:
    """Tick at every due time between two records, as a live gateway does.

    Ends at the loss of all vehicles if the rest is longer than `max_gap`: every further line would be the same.
    """
    moment = last
    overdue = 0
    while (due := pipeline.next_due(moment.mono)) < until.mono and overdue <= MOST_OVERDUE:
        overdue = overdue + 1 if due <= moment.mono else 0
        if due > moment.mono:
            moment = later(last, due - last.mono)._replace(mono=due)
        pipeline.tick(moment)
        if until.mono - moment.mono > pipeline.max_gap and pipeline.hears_nothing():
            break
