"""The highest rate at which no frame is lost, and the CPU time per frame there."""

from __future__ import annotations

import math

from ..case import Bench, Case, Found
from ..contenders import COALESCING, MAVPROXY, MAVSDK, ROUTER
from ..feed import Fed, Feed
from ..process import BenchError, Child, free_port
from ..results import OURS, PYMAVLINK, Sample, Skip, Target

EVERYONE = (OURS, COALESCING, PYMAVLINK, MAVSDK, ROUTER, MAVPROXY)
SETUP = "one frame a datagram"
RATE, CPU = "highest lossless rate, frames/s", "CPU per frame there, us"
FIRST = 500  # frames/s
HIGHEST = 1_024_000
FINE = 1.1  # the search ends at this ratio of the bounds
TRIES = 2  # attempts at a rate if frames are lost or the sender is slow: other programs use the machine too
BEHIND = 0.1  # fraction of the sending time; a longer delay means that frames only fill the socket's queue
SECONDS = 2.0


def measure(bench: Bench) -> Found:
    """One round."""
    skipped: list[Skip] = []
    for who in bench.contenders.each(EVERYONE, skipped):
        port = free_port()
        try:
            with bench.contenders.start(who, port) as child, Feed(bench.frames(), port) as feed:
                child.listens(port)
                feed.warm_up()
                best = _search(child, feed, bench.lasting(SECONDS))
        except BenchError as error:
            skipped.append(Skip("", who, str(error)))
            continue
        if best is None:
            skipped.append(Skip(SETUP, who, f"already loses frames at {FIRST} frames/s"))
            continue
        limit = f"the sender's limit was {best.rate:,.0f} frames/s" if best.slow_sender else ""
        yield Sample(SETUP, RATE, who, best.rate, limit)
        yield Sample(SETUP, CPU, who, best.per_frame)
    yield from skipped


def _search(child: Child, feed: Feed, seconds: float) -> Fed | None:
    """Double the rate until frames are lost, then bisect on a logarithmic scale."""
    best: Fed | None = None
    rate, low, high = float(FIRST), 0.0, math.inf
    while high / max(low, 1.0) > FINE:
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


CASE = Case(
    "saturate",
    "UDP to status at the highest lossless rate",
    measure,
    (
        Target(SETUP, CPU, "at saturation: at most 1/7 of pymavlink's CPU per frame", 1 / 7, peer=PYMAVLINK),
        Target(SETUP, RATE, "lossless rate: at least 6 times pymavlink's", at_least=6.0, peer=PYMAVLINK),
    ),
)
