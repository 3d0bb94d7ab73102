"""Replays a recorded log, and shows the handles to a viewer after each tick."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

from ..clock import Instant
from ..config import Config
from ..gateway.logs.onboard_recording import OnboardRecording
from ..gateway.logs.recorded_log import Recording
from ..gateway.observer import Observer
from ..gateway.replay import ReplayPipeline, open_recording, run_through
from ..interface import IndustrialRobotStatusHandle, IndustrialRobotStatusInterface, LinkState
from ..links.log import Stamped
from ..streams import NO_OUTPUT
from .explain import silent


class Viewer(Protocol):
    """Collects the statuses of a log, for a report."""

    def begin(self, now: Instant) -> None:
        """The log begins, or a new segment after a clock jump."""

    def sample(self, handles: Iterable[IndustrialRobotStatusHandle], now: Instant) -> None:
        """The handles of the vehicles heard so far may have changed."""

    def end(self, now: Instant) -> None:
        """The log ends."""


def watch(config: Config, path: str, viewer: Viewer, progress: Callable[[float], None]) -> str:
    """Show the log at `path` to `viewer`, and report the fraction read (0 to 1) to `progress`.

    Returns a summary line of the log. Raises UsageError if the log cannot be read.
    """
    recording = open_recording(path)
    pipeline = ReplayPipeline(silent(config), NO_OUTPUT, [_Look(viewer)], recording)
    viewer.end(run_through(pipeline, _segments(recording, viewer, progress)))
    return recording.summary()


def _segments(
    recording: Recording | OnboardRecording, viewer: Viewer, progress: Callable[[float], None]
) -> Iterator[Stamped]:
    """The recording. Notifies the viewer at the start of each segment."""
    first = True
    for stamped in recording:
        now, _, new_segment = stamped
        if first or new_segment:
            viewer.begin(now)
            first = False
        yield stamped
        progress(recording.share)


class _Look(Observer):
    """Shows the handles of the vehicles heard so far to a viewer."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._heard: set[str] = set()

    def on_tick(self, handles: IndustrialRobotStatusInterface, now: Instant) -> None:
        self._heard |= {handle.name for handle in handles if handle.detail.link is not LinkState.NEVER_SEEN}
        self._viewer.sample([handle for handle in handles if handle.name in self._heard], now)
