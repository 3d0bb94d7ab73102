"""A recorded log watched from beginning to end: whoever draws it sees the handles whenever they may have changed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from .explain import NO_OUTPUT, silent
from .plant import Plant
from .recorded import Recording
from .replay import Nobody, run_through

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from ..clock import Instant
    from ..config import Config
    from ..interface import IndustrialRobotStatusHandle
    from ..link.log import Stamped


class Observer(Protocol):
    """Who watches."""

    def begin(self, now: Instant) -> None:
        """The log begins, or its clock was set and it begins anew."""

    def look(self, handles: Iterable[IndustrialRobotStatusHandle], now: Instant) -> None:
        """The handles of the vehicles heard so far may have changed."""

    def end(self, now: Instant) -> None:
        """The log ends."""


def watch(config: Config, path: str, observer: Observer, progress: Callable[[float], None]) -> str:
    """Let `observer` watch the log at `path`, and tell `progress` how much of it is read (0 to 1).

    Returns a line about what was read. Raises UsageError if the log cannot be read.
    """
    recording = Recording(path)
    plant = _WatchedPlant(config, observer)
    observer.end(run_through(plant, _segments(recording, observer, progress)))
    return recording.summary()


def _segments(recording: Recording, observer: Observer, progress: Callable[[float], None]) -> Iterator[Stamped]:
    """The recording; the observer is told where a segment begins."""
    first = True
    for stamped in recording:
        now, _, new_segment = stamped
        if first or new_segment:
            observer.begin(now)
            first = False
        yield stamped
        progress(recording.share)


class _WatchedPlant(Plant):
    """A plant without publishers, with an observer."""

    def __init__(self, config: Config, observer: Observer) -> None:
        super().__init__(silent(config), Nobody(), NO_OUTPUT, patient=True)
        self._observer = observer

    def tick(self, now: Instant) -> None:
        """Tick, and let the observer look."""
        super().tick(now)
        self._observer.look([tracked.handle for tracked in self.hw.vehicles], now)
