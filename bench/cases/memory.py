"""Resident memory after the frames of a minute, and its growth over many more frames."""

from __future__ import annotations

from ..case import Bench, Case, Found
from ..feed import Feed
from ..process import free_port
from ..results import OURS, PYMAVLINK, Sample, Target

SETUP = "one vehicle, JSON and MAVLink out"
AFTER, GROWTH = "resident after a minute, MB", "growth after that, MB"
MINUTE = 60 * 80  # frames
RATE = 400  # frames/s: the minute takes twelve seconds
FAST = 16_000
FRAMES, LONG = 400_000, 10_000_000
SETTLED = 50_000
"""Frames before the growth is measured. After them every cache is full."""


def measure(bench: Bench) -> Found:
    """One round."""
    frames = LONG if bench.long else bench.number(FRAMES)
    starts = {OURS: bench.contenders.start_ours, PYMAVLINK: bench.contenders.start_pymavlink}
    for who, start in starts.items():
        port = free_port()
        with start(port) as child, Feed(bench.frames(), port) as feed:
            child.listens(port)
            feed.send(RATE, bench.lasting(MINUTE / RATE))
            yield Sample(SETUP, AFTER, who, child.memory())
            if bench.quick and who != OURS:
                continue
            feed.send(FAST, SETTLED / FAST)
            before = child.memory()
            fed = feed.measure(child, FAST, frames / FAST)
            over = f"growth over {frames:,} frames" + (f", {fed.note}" if fed.note else "")
            yield Sample(SETUP, GROWTH, who, child.memory() - before, over)


CASE = Case(
    "memory",
    "Memory",
    measure,
    (
        Target(SETUP, AFTER, "resident memory after a minute: below 25 MB", 25.0),
        Target(SETUP, GROWTH, "no growth: at most 0.5 MB", 0.5),
    ),
)
