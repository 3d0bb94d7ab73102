"""UDP to status at steady rates, one frame a datagram. Every program has its default options."""

from __future__ import annotations

import re

from ..case import Bench, Case, Found
from ..contenders import COALESCING, MAVPROXY, MAVSDK, ROUTER
from ..feed import Feed
from ..process import BenchError, free_port
from ..results import OURS, PYMAVLINK, Sample, Skip, Target

RATES = (80, 800, 8000)
EVERYONE = (OURS, COALESCING, PYMAVLINK, MAVSDK, ROUTER, MAVPROXY)
METRIC = "CPU per frame, us"
READ = "frames read, by its own count, %"
SECONDS = 6.0


def measure(bench: Bench) -> Found:
    """One round."""
    skipped: list[Skip] = []
    for who in bench.contenders.each(EVERYONE, skipped):
        port = free_port()
        try:
            with bench.contenders.start(who, port) as child, Feed(bench.frames(), port) as feed:
                child.listens(port)
                feed.warm_up()
                for rate in RATES:
                    fed = feed.measure(child, rate, bench.lasting(SECONDS))
                    yield Sample(f"{rate} frames/s", METRIC, who, fed.per_frame, fed.note)
                if who in (OURS, COALESCING):
                    yield Sample("all of them", READ, who, 100 * _logged_frames(child.stop()) / feed.total)
        except BenchError as error:
            skipped.append(Skip("", who, str(error)))
    yield from skipped


def _logged_frames(log: str) -> int:
    """The number of frames in the log line that our command writes when it ends."""
    found = re.search(r": (\d+) frames, \d+ lost", log)
    if found is None:
        raise BenchError(f"no log line with the number of frames: {log[-300:]}")
    return int(found[1])


CASE = Case(
    "udp",
    "UDP to status at steady rates",
    measure,
    (
        Target("8000 frames/s", METRIC, "8000 frames/s: at most 1/3 of pymavlink's CPU", 1 / 3, peer=PYMAVLINK),
        Target(
            "8000 frames/s", METRIC, "8000 frames/s with coalescing: at most mavlink-routerd's CPU", 1.0,
            peer=ROUTER, who=COALESCING,
        ),
    ),
)  # fmt: skip
