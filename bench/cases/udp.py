"""UDP to status at steady rates, one frame a datagram."""

from __future__ import annotations

import re
from typing import NamedTuple

from ..case import Bench, Case, Found
from ..contenders import ANY, COALESCING, LOOP, MAVPROXY, MAVSDK, ROUTER
from ..feed import Feed
from ..process import BenchError, free_port
from ..results import OURS, PYMAVLINK, Sample, Skip, Target
from ..workload import HALF, QUARTER, WORKLOADS, Workload

EVERYONE = (OURS, COALESCING, LOOP, PYMAVLINK, ANY, MAVSDK, ROUTER, MAVPROXY)
METRIC = "CPU per frame, us"
READ = "frames read, by its own count, %"
SECONDS = {80: 10.0, 800: 5.0, 8000: 4.0}
BURST = 8
"""Frames that an autopilot sends at once: at 80 frames/s one burst every 100 ms."""


class Spacing(NamedTuple):
    """The rate in frames a second, and how many come at once."""

    rate: int
    burst: int = 1

    def setup(self, traffic: Workload) -> str:
        """In words, for the tables."""
        how = f"in bursts of {self.burst}" if self.burst > 1 else "evenly spaced"
        return f"{self.rate} frames/s, {how}, {traffic.name}"


EVENLY = (Spacing(80), Spacing(800), Spacing(8000))
SPACINGS = ((QUARTER, EVENLY), (HALF, (*EVENLY, Spacing(80, BURST), Spacing(800, BURST))))


def measure(bench: Bench) -> Found:
    """One round."""
    skipped: list[Skip] = []
    for who in bench.programs(EVERYONE, skipped):
        for traffic, spacings in SPACINGS:
            try:
                yield from _one(bench, who, traffic, spacings)
            except BenchError as error:
                skipped.append(Skip(traffic.name, who, str(error)))
    yield from skipped


def _one(bench: Bench, who: str, traffic: Workload, spacings: tuple[Spacing, ...]) -> Found:
    port = free_port()
    with bench.contenders.start(who, port) as child, Feed(bench.frames(traffic=traffic), port) as feed:
        child.listens(port)
        feed.warm_up(seconds=bench.lasting(1.0))
        for spacing in spacings:
            seconds = bench.lasting(SECONDS[spacing.rate])
            fed = feed.measure(child, spacing.rate, seconds, spacing.burst)
            yield Sample(spacing.setup(traffic), METRIC, who, fed.per_frame, fed.note)
        if who in (OURS, COALESCING):
            found = _logged_frames(child.stop())
            yield Sample(f"all of them, {traffic.name}", READ, who, 100 * found / feed.total)


def _logged_frames(log: str) -> int:
    """The number of frames in the log line that our command writes when it ends."""
    found = re.search(r": (\d+) frames, ", log)
    if found is None:
        raise BenchError(f"no log line with the number of frames: {log[-300:]}")
    return int(found[1])


def _targets(spacing: Spacing, traffic: Workload) -> tuple[Target, ...]:
    setup = spacing.setup(traffic)
    words = setup.replace(", evenly spaced", "")
    if spacing.rate == 8000:
        return (
            Target(setup, METRIC, f"{words}: at most 1/3 of pymavlink's CPU", 1 / 3, peer=PYMAVLINK),
            Target(
                setup, METRIC, f"{words}, with coalescing: at most mavlink-routerd's CPU", 1.0,
                peer=ROUTER, who=COALESCING,
            ),
        )  # fmt: skip
    return (
        Target(setup, METRIC, f"{words}: at most MAVSDK's CPU", 1.0, peer=MAVSDK),
        Target(setup, METRIC, f"{words}: at most 1.3 of a Python loop's CPU", 1.3, peer=LOOP),
    )  # fmt: skip


CASE = Case(
    "udp",
    "UDP to status at steady rates",
    measure,
    tuple(target for traffic in WORKLOADS for spacing in EVENLY for target in _targets(spacing, traffic)),
)
