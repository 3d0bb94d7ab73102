"""The highest rate at which no frame is lost, and the CPU time per frame there."""

from __future__ import annotations

import math

from ..case import Bench, Case, Found
from ..contenders import COALESCING, MAVPROXY, MAVSDK, ROUTER
from ..feed import Fed, Feed
from ..process import BenchError, Child, free_port
from ..results import OURS, PYMAVLINK, Sample, Skip, Target
from ..workload import HALF, WORKLOADS, Workload

EVERYONE = (OURS, COALESCING, PYMAVLINK, MAVSDK, ROUTER, MAVPROXY)
RATE, CPU = "highest lossless rate, frames/s", "CPU per frame there, us"
FIRST, QUICK_FIRST = 500, 8000  # frames/s
HIGHEST = 1_024_000
FINE, QUICK_FINE = 1.1, 1.3  # the search ends at this ratio of the bounds
TRIES = 2  # attempts at a rate if frames are lost or the sender is slow: other programs use the machine too
BEHIND = 0.1  # fraction of the sending time; a longer delay means that frames only fill the socket's queue
SECONDS = 1.2


def measure(bench: Bench) -> Found:
    """One round. A quick run has one workload."""
    skipped: list[Skip] = []
    for who in bench.programs(EVERYONE, skipped):
        for traffic in (HALF,) if bench.quick else WORKLOADS:
            try:
                yield from _one(bench, who, traffic)
            except BenchError as error:
                skipped.append(Skip(_setup(traffic), who, str(error)))
    yield from skipped


def _setup(traffic: Workload) -> str:
    return f"one frame a datagram, {traffic.name}"


def _one(bench: Bench, who: str, traffic: Workload) -> Found:
    setup, port = _setup(traffic), free_port()
    with bench.contenders.start(who, port) as child, Feed(bench.frames(traffic=traffic), port) as feed:
        child.listens(port)
        feed.warm_up(seconds=bench.lasting(1.0))
        first, fine = (QUICK_FIRST, QUICK_FINE) if bench.quick else (FIRST, FINE)
        best = _search(child, feed, bench.lasting(SECONDS), first, fine)
    if best is None:
        yield Skip(setup, who, f"already loses frames at {first} frames/s")
        return
    limit = f"the sender's limit was {best.rate:,.0f} frames/s" if best.slow_sender else ""
    yield Sample(setup, RATE, who, best.rate, limit)
    yield Sample(setup, CPU, who, best.per_frame)


def _search(child: Child, feed: Feed, seconds: float, first: int, fine: float) -> Fed | None:
    """Double the rate until frames are lost, then bisect on a logarithmic scale."""
    best: Fed | None = None
    rate, low, high = float(first), 0.0, math.inf
    while high / max(low, 1.0) > fine:
        fed = _lossless(child, feed, round(rate), seconds)
        if fed is None:
            high = rate
            if low == 0.0:
                return None
        else:
            best, low = fed, rate
            if fed.slow_sender:
                return fed
        rate = low * 2 if high == math.inf else math.sqrt(low * high)
        if rate > HIGHEST:
            return best
    return best


def _lossless(child: Child, feed: Feed, rate: int, seconds: float) -> Fed | None:
    best: Fed | None = None
    for _ in range(TRIES):
        fed = feed.measure(child, rate, seconds)
        if not fed.lost and fed.behind < BEHIND * fed.seconds:
            best = fed
            if not fed.slow_sender:
                break
    return best


def _targets(traffic: Workload) -> tuple[Target, ...]:
    setup, words = _setup(traffic), traffic.name
    return (
        Target(
            setup, CPU, f"at saturation, {words}: at most 1/7 of pymavlink's CPU per frame", 1 / 7, peer=PYMAVLINK
        ),
        Target(
            setup, RATE, f"lossless rate, {words}: at least 6 times pymavlink's", at_least=6.0, peer=PYMAVLINK
        ),
    )  # fmt: skip


CASE = Case(
    "saturate",
    "UDP to status at the highest lossless rate",
    measure,
    tuple(target for traffic in WORKLOADS for target in _targets(traffic)),
)
