"""Time from a HEARTBEAT that changes `armed` to the JSON line with the change: alone, and beside other frames."""

from __future__ import annotations

import itertools
import json
import os
import select
import socket
import time
from statistics import median, quantiles
from typing import TYPE_CHECKING, Any

from .. import workload
from ..case import Bench, Case, Found
from ..contenders import LOOP
from ..process import BenchError, Child, free_port
from ..results import FIRST_MACHINE, OURS, PYMAVLINK, Sample, Target

if TYPE_CHECKING:
    from collections.abc import Callable

UNLOADED = "HEARTBEAT to JSON line, unloaded"
LOADED = "HEARTBEAT to JSON line, beside 800 frames/s"
P50, P99 = "p50, us", "p99, us"
EVERY = 0.0617  # s: at most 20 lines a second on change; not a multiple of the period of 100 ms
RATE = 800  # frames/s
TIMES = 250
FIRST = 10
"""The first ones are a warm-up."""
LONGEST = 2.0  # s
HEARTBEAT = 0
ARMED: dict[str, Callable[[dict[str, Any]], Any]] = {
    OURS: lambda line: line["drives_powered"],
    PYMAVLINK: lambda line: line["armed"],
    LOOP: lambda line: line["armed"],
}


def measure(bench: Bench) -> Found:
    """One round."""
    programs = bench.contenders
    starts = {OURS: programs.start_ours, PYMAVLINK: programs.start_pymavlink, LOOP: programs.start_loop}
    for setup, rate in ((UNLOADED, 0), (LOADED, RATE)):
        for who, start in starts.items():
            port = free_port()
            with start(port, pipe=True) as child:
                child.listens(port)
                times = times_of(child, port, ARMED[who], bench.number(TIMES), rate)
            yield Sample(setup, P50, who, median(times))
            yield Sample(setup, P99, who, quantiles(times, n=100)[98])


def times_of(
    child: Child, port: int, armed: Callable[[dict[str, Any]], Any], number: int, rate: int = 0
) -> list[float]:
    """Microseconds from sending to reading, for each change. `rate`: other frames of the vehicle a second."""
    times = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.connect(("127.0.0.1", port))
        vehicle = _Vehicle(out, rate)
        lines = _Lines(child, vehicle)
        for i in range(number + FIRST):
            arm = i % 2 == 0
            start = vehicle.heartbeat(arm)
            while armed(lines.read()) is not arm:
                pass
            if i >= FIRST:
                times.append((time.perf_counter() - start) * 1e6)
            lines.skip(EVERY)
    return times


class _Vehicle:
    """A vehicle that sends on one socket. Its frames have consecutive sequence numbers."""

    def __init__(self, out: socket.socket, rate: int) -> None:
        self._out = out
        self._gap = 1 / rate if rate else float("inf")
        self._due = time.perf_counter() + self._gap
        self._sequence = 0
        self._heartbeats = {arm: workload.heartbeat(armed=arm) for arm in (False, True)}
        others = workload.frames(workload.SHORT_LOOP, workload=workload.HALF) if rate else []
        self._others = itertools.cycle(
            frame for frame in others if int.from_bytes(frame[7:10], "little") != HEARTBEAT
        )  # fmt: skip

    def heartbeat(self, arm: bool) -> float:
        """Send a HEARTBEAT. Return the time before it was sent."""
        return self._send(self._heartbeats[arm])

    def wait(self, descriptor: int, seconds: float) -> bool:
        """Wait until the descriptor can be read, and send the other frames meanwhile. False on timeout."""
        deadline = time.perf_counter() + seconds
        while True:
            now = time.perf_counter()
            if now >= self._due:
                self._send(next(self._others))
                self._due = max(self._due + self._gap, now)
            wait = min(deadline, self._due) - time.perf_counter()
            if select.select([descriptor], [], [], max(0.0, wait))[0]:
                return True
            if time.perf_counter() >= deadline:
                return False

    def _send(self, frame: bytes) -> float:
        made = workload.numbered(frame, self._sequence)
        self._sequence = (self._sequence + 1) & 255
        start = time.perf_counter()
        self._out.send(made)
        return start


class _Lines:
    """The JSON lines of a child. Reading times out."""

    def __init__(self, child: Child, vehicle: _Vehicle) -> None:
        assert child.process.stdout is not None
        self._descriptor = child.process.stdout.fileno()
        self._vehicle = vehicle
        self._rest = b""

    def read(self) -> dict[str, Any]:
        while b"\n" not in self._rest:
            if not self._vehicle.wait(self._descriptor, LONGEST):
                raise BenchError(f"no line within {LONGEST} s")
            self._rest += os.read(self._descriptor, 1 << 16)
        line, _, self._rest = self._rest.partition(b"\n")
        found: dict[str, Any] = json.loads(line)
        return found

    def skip(self, seconds: float) -> None:
        """Discard the lines of this time."""
        deadline = time.perf_counter() + seconds
        while self._vehicle.wait(self._descriptor, max(0.0, deadline - time.perf_counter())):
            self._rest += os.read(self._descriptor, 1 << 16)
        # of a line whose end is still to come, the end alone must not be read
        self._rest = self._rest.rpartition(b"\n")[2]


CASE = Case(
    "latency",
    "Latency",
    measure,
    (
        Target(UNLOADED, P50, "latency, p50: at most 1.1 times pymavlink's", 1.1, peer=PYMAVLINK),
        Target(UNLOADED, P99, "latency, p99: below 1 ms", 1000.0, machine=FIRST_MACHINE),
        Target(LOADED, P50, "latency beside 800 frames/s, p50: at most pymavlink's", 1.0, peer=PYMAVLINK),
    ),
)
