"""Forwarding from one UDP port to another while publishing the status."""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator

from ..case import Bench, Case, Found
from ..contenders import MAVPROXY, ROUTER, Missing
from ..feed import Feed
from ..process import BenchError, free_port, queue
from ..results import OURS, PYMAVLINK, Sample, Skip, Target

FASTEST = 40_000
RATES = (8000, FASTEST)
EVERYONE = (OURS, PYMAVLINK, ROUTER, MAVPROXY)
WHOLE, ADDED = "CPU per frame, us", "CPU per frame that forwarding adds, us"
DELIVERED = "delivered, %"
SECONDS = 4.0


def measure(bench: Bench) -> Found:
    """One round."""
    skipped: list[Skip] = []
    if bench.contenders.has_option("--forward"):
        alone = dict(_alone(bench))
    for who in bench.programs(EVERYONE, skipped):
        port = free_port()
        try:
            with (
                _Sink() as sink,
                bench.contenders.start_forwarding(who, port, sink.port) as child,
                Feed(bench.distinct_frames(), port) as feed,
            ):
                child.listens(port)
                feed.warm_up()
                sink.delivered()
                for rate in RATES:
                    fed = feed.measure(child, rate, bench.lasting(SECONDS))
                    setup = f"{rate} frames/s"
                    yield Sample(setup, WHOLE, who, fed.per_frame, fed.note)
                    yield Sample(setup, DELIVERED, who, 100 * sink.delivered() / fed.sent)
                    added = fed.per_frame - alone[rate] if who == OURS else fed.per_frame
                    if who in (OURS, ROUTER):
                        yield Sample(setup, ADDED, who, added)
        except (BenchError, Missing) as error:
            skipped.append(Skip("", who, str(error)))
    yield from skipped


def _alone(bench: Bench) -> Iterator[tuple[int, float]]:
    """CPU time per frame of our status without forwarding, for each rate."""
    port = free_port()
    with bench.contenders.start_ours(port, "--json", "none") as child, Feed(bench.distinct_frames(), port) as feed:
        child.listens(port)
        feed.warm_up()
        for rate in RATES:
            yield rate, feed.measure(child, rate, bench.lasting(SECONDS)).per_frame


class _Sink:
    """The target of the forwarding. Datagrams are counted afterwards, from its queue and the kernel's drop counter."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self.port = int(self._socket.getsockname()[1])
        self._dropped = 0

    def __enter__(self) -> _Sink:
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def delivered(self) -> int:
        """Datagrams since the last call."""
        found = queue(self.port)
        dropped = found.dropped if found else 0
        number, self._dropped = dropped - self._dropped, dropped
        with contextlib.suppress(BlockingIOError):
            while True:
                self._socket.recv(2048)
                number += 1
        return number


CASE = Case(
    "forward",
    "Forwarding",
    measure,
    (
        *(
            Target(
                f"{rate} frames/s", ADDED,
                f"forwarding at {rate} frames/s: adds at most 1.5 times mavlink-routerd's CPU", 1.5, peer=ROUTER,
            )
            for rate in RATES
        ),
        Target(
            f"{FASTEST} frames/s", WHOLE,
            f"forwarding at {FASTEST} frames/s, whole: at most 2 times mavlink-routerd's CPU", 2.0, peer=ROUTER,
        ),
        Target(
            f"{FASTEST} frames/s", DELIVERED, f"forwarding at {FASTEST} frames/s: everything is delivered",
            at_least=100.0,
        ),
    ),
)  # fmt: skip
