"""A recorded log through the plant, as fast as it can be read, on the log's own time."""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Any, Final

from ..clock import later
from .plant import NEVER, Plant
from .recorded import Recording

if TYPE_CHECKING:
    from collections.abc import Collection, Hashable, Iterable, Sequence
    from typing import TextIO

    from ..clock import Instant
    from ..config import Config
    from ..interface import Audience
    from ..link.log import Stamped

log = logging.getLogger(__name__)

MOST_OVERDUE: Final = 3
"""Rounds without progress in which a part of a third party may ask to be called again at once."""


class Nobody:
    """The MAVLink port of a replay: there is nobody to send to."""

    def audiences(self) -> Sequence[Audience]:
        """Nobody."""
        return ()

    def requests(self) -> Collection[tuple[Hashable, int]]:
        """Nobody asks."""
        return ()

    def send(self, message: Any, system: int, audience: Audience) -> None:
        """Send nothing."""


def replay(config: Config, path: str, stdout: TextIO) -> None:
    """Replay the log at `path`. Raises UsageError if it cannot be read, BrokenPipeError if nobody reads the lines."""
    recording = Recording(path)
    log.info("replaying %s", path)
    plant = Plant(config, Nobody(), stdout, patient=True)
    try:
        plant.now = run_through(plant, recording)
    finally:
        plant.close(plant.now)
    log.info("%s", recording.summary())


def run_through(plant: Plant, recording: Iterable[Stamped]) -> Instant:
    """Feed a recording to the plant; gives the last instant of it. The plant has lived what came before the next."""
    hw = plant.hw
    take = hw.take
    last = NEVER
    due = -math.inf  # the first record is where it begins
    for now, frame, new_segment in recording:
        mono = now.mono
        if new_segment:
            plant.forget(last)
        elif due < mono or hw.deadline < mono:
            if last is NEVER:
                plant.tick(now)  # vehicles that are expected have lines before they are heard
                last = now
            due = plant.next_due(last.mono, mono)
            if due < mono:
                live_through(plant, last, now)
                due = plant.next_due(mono)
        if frame is not None:
            take(frame, now)
            if hw.stirred:
                plant.tick(now)
                due = plant.next_due(mono)
        last = now
    return last


def live_through(plant: Plant, last: Instant, until: Instant) -> None:
    """Do what falls due between two records at the time when it falls due, as a live gateway would."""
    moment = last
    overdue = 0
    while (due := plant.next_due(moment.mono)) < until.mono and overdue <= MOST_OVERDUE:
        overdue = overdue + 1 if due <= moment.mono else 0
        if due > moment.mono:
            moment = later(last, due - last.mono)._replace(mono=due)
        plant.tick(moment)
