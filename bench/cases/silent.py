"""A known vehicle that sends nothing: what the gateway costs when it only publishes, and how often it wakes up.

All programs run at the same time: together they use a small part of a core.
"""

from __future__ import annotations

import time
from contextlib import ExitStack
from typing import TYPE_CHECKING, NamedTuple

from ..case import Bench, Case, Found
from ..contenders import LOOP, MAVSDK
from ..feed import Feed
from ..process import free_port
from ..results import OURS, PYMAVLINK, SECOND_MACHINE, Sample, Skip, Target

if TYPE_CHECKING:
    from ..process import Child

LINES, CHANGES, NOTHING = "lines at 10 Hz", "--changes-only", "nothing published"
COST, WAKE_UPS = "CPU, ms/s", "wake-ups/s"
RATE, KNOWN = 80, 2.0
LOST = 4.5
"""Seconds until the link counts as lost, and a second more: then the status has changed for the last time."""
SECONDS = 10.0
OPTIONS = {LINES: (), CHANGES: ("--changes-only",), NOTHING: ("--json", "none", "--rate", "0", "--passive")}
PEERS = (PYMAVLINK, LOOP, MAVSDK)


class Watched(NamedTuple):
    """A running program, and what it had used at the start of the measurement."""

    setup: str
    who: str
    child: Child
    cpu: float = 0.0
    wake_ups: int = 0


def measure(bench: Bench) -> Found:
    """One round."""
    skipped: list[Skip] = []
    with ExitStack() as ended:
        running, feeds = [], []
        ours = [(setup, OURS) for setup in OPTIONS]
        for setup, who in (*ours, *((LINES, peer) for peer in bench.programs(PEERS, skipped))):
            port, start = free_port(), bench.contenders
            child = start.start_ours(port, *OPTIONS[setup]) if who == OURS else start.start(who, port)
            running.append(Watched(setup, who, ended.enter_context(child)))
            child.listens(port)
            feeds.append(ended.enter_context(Feed(bench.frames(), port)))
        for feed in feeds:
            feed.begin(RATE, KNOWN)
        for feed in feeds:
            feed.end()
        time.sleep(LOST)
        yield from _measured(running, 2.0 if bench.quick else SECONDS)
    yield from skipped


def _measured(running: list[Watched], seconds: float) -> Found:
    before = [one._replace(cpu=one.child.cpu(), wake_ups=one.child.wake_ups()) for one in running]
    start = time.perf_counter()
    time.sleep(seconds)
    took = time.perf_counter() - start
    for setup, who, child, cpu, wake_ups in before:
        yield Sample(setup, COST, who, 1000 * (child.cpu() - cpu) / took)
        yield Sample(setup, WAKE_UPS, who, (child.wake_ups() - wake_ups) / took)


CASE = Case(
    "silent",
    "A known vehicle that is silent",
    measure,
    (Target(LINES, COST, "known vehicle, silent, lines at 10 Hz: at most 2.5 ms/s", 2.5, machine=SECOND_MACHINE),),
)
