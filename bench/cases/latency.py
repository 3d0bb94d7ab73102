"""Time from a HEARTBEAT that changes `armed` to the JSON line with the change, without other load."""

from __future__ import annotations

import json
import os
import select
import socket
import time
from statistics import median, quantiles
from typing import TYPE_CHECKING, Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from ..case import Bench, Case, Found
from ..process import BenchError, Child, free_port
from ..results import OURS, PYMAVLINK, Sample, Target

if TYPE_CHECKING:
    from collections.abc import Callable

SETUP = "HEARTBEAT to JSON line, unloaded"
P50, P99 = "p50, us", "p99, us"
EVERY = 0.0617  # s: at most 20 lines a second on change; not a multiple of the period of 100 ms
TIMES = 400
LONGEST = 2.0  # s
ARMED: dict[str, Callable[[dict[str, Any]], Any]] = {
    OURS: lambda line: line["drives_powered"],
    PYMAVLINK: lambda line: line["armed"],
}


def measure(bench: Bench) -> Found:
    """One round."""
    starts = {OURS: bench.contenders.start_ours, PYMAVLINK: bench.contenders.start_pymavlink}
    for who, start in starts.items():
        port = free_port()
        with start(port, pipe=True) as child:
            child.listens(port)
            times = sorted(_times(child, port, ARMED[who], round(bench.lasting(TIMES))))
        yield Sample(SETUP, P50, who, median(times))
        yield Sample(SETUP, P99, who, quantiles(times, n=100)[98])


def _times(child: Child, port: int, armed: Callable[[dict[str, Any]], Any], number: int) -> list[float]:
    """Microseconds from sending to reading, for each change."""
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    lines = _Lines(child)
    times = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.connect(("127.0.0.1", port))
        for i in range(number + 10):  # the first ten are a warm-up
            arm = i % 2 == 0
            heartbeat = dialect.MAVLink_heartbeat_message(10, 3, 209 if arm else 81, 0, 4 if arm else 3, 3).pack(mav)
            mav.seq = (mav.seq + 1) & 255
            start = time.perf_counter()
            out.send(heartbeat)
            while armed(lines.read()) is not arm:
                pass
            if i >= 10:
                times.append((time.perf_counter() - start) * 1e6)
            time.sleep(EVERY)
            lines.skip()
    return times


class _Lines:
    """The JSON lines of a child. Reading times out."""

    def __init__(self, child: Child) -> None:
        assert child.process.stdout is not None
        self._descriptor = child.process.stdout.fileno()
        self._rest = b""

    def read(self) -> dict[str, Any]:
        while b"\n" not in self._rest:
            if not select.select([self._descriptor], [], [], LONGEST)[0]:
                raise BenchError(f"no line within {LONGEST} s")
            self._rest += os.read(self._descriptor, 1 << 16)
        line, _, self._rest = self._rest.partition(b"\n")
        found: dict[str, Any] = json.loads(line)
        return found

    def skip(self) -> None:
        """Discard the periodic lines that have arrived."""
        while select.select([self._descriptor], [], [], 0)[0]:
            self._rest += os.read(self._descriptor, 1 << 16)
        self._rest = b""


CASE = Case(
    "latency",
    "Latency",
    measure,
    (
        Target(SETUP, P50, "latency, p50: at most pymavlink's", 1.0, peer=PYMAVLINK),
        Target(SETUP, P99, "latency, p99: below 1 ms", 1000.0),
    ),
)
