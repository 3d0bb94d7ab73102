"""A recorded log through the plant, as fast as it can be read, on the log's own time."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from ..clock import Instant, later
from ..hardware.robot_hw import WANTED_IDS
from ..link.log import LogReader
from ..mavlink.framing import Parser
from .plant import Plant

if TYPE_CHECKING:
    from typing import TextIO

    from ..config import Config

log = logging.getLogger(__name__)


class Nobody:
    """The MAVLink port of a replay: there is nobody to send to."""

    def send(self, message: Any, system: int) -> None:
        """Send nothing."""


def replay(config: Config, path: str, stdout: TextIO) -> None:
    """Replay the log at `path`. Raises UsageError if it cannot be read, BrokenPipeError if nobody reads the lines."""
    reader = LogReader(path)
    log.info("replaying %s", path)
    plant = Plant(config, Nobody(), stdout, patient=True)
    parser = Parser(WANTED_IDS)
    last: Instant | None = None
    for record in reader:
        now = record.now
        if record.new_segment and last is not None:
            plant.forget(last)
            parser.reset()
        elif last is not None:
            live_through(plant, last, now)
        for frame in parser.feed(record.data):
            plant.take(frame, now)
        plant.tick(now)
        last = now
    if last is not None:
        plant.close(last)
    counters = parser.counters
    log.info(
        "%s; %d frames, %d lost, %d with a bad CRC, %d of unknown kind",
        reader.summary(),
        counters.frames,
        counters.lost,
        sum(counters.bad_crc.values()),
        sum(counters.unknown.values()),
    )


def live_through(plant: Plant, last: Instant, until: Instant) -> None:
    """Do what falls due between two records at the time when it falls due, as a live gateway would."""
    moment = last
    while (due := plant.next_due(moment.mono)) < until.mono:
        if due <= moment.mono:
            return
        moment = later(last, due - last.mono)._replace(mono=due)
        plant.tick(moment)
