"""Time from the start of the process to its first JSON line. A heartbeat is always waiting.

`python -c pass` is the floor for a program in Python: the time until such a process has ended.
"""

from __future__ import annotations

import contextlib
import socket
import subprocess
import sys
import threading
import time
from statistics import median

from pymavlink.dialects.v20 import ardupilotmega as dialect

from ..case import Bench, Case, Found
from ..process import BenchError, free_port
from ..results import OURS, PYMAVLINK, Sample

SETUP = "start to first JSON line"
WALL, CPU = "time, ms", "CPU, ms"
NOTHING = "python -c pass"
TIMES, QUICK_TIMES = 7, 2
EVERY = 0.005  # s between heartbeats


def measure(bench: Bench) -> Found:
    """One round: all programs in turn, several times; the medians."""
    starts = {OURS: bench.contenders.start_ours, PYMAVLINK: bench.contenders.start_pymavlink}
    times: dict[str, list[float]] = {who: [] for who in (*starts, NOTHING)}
    used: dict[str, list[float]] = {who: [] for who in starts}
    for _ in range(QUICK_TIMES if bench.quick else TIMES):
        began = time.perf_counter()
        subprocess.run([sys.executable, "-c", "pass"], check=True, stdin=subprocess.DEVNULL)
        times[NOTHING].append(time.perf_counter() - began)
        for who, start in starts.items():
            port = free_port()
            with _Heartbeats(port):
                began = time.perf_counter()
                with start(port, pipe=True) as child:
                    assert child.process.stdout is not None
                    if not child.process.stdout.readline():
                        raise BenchError(f"{who} has ended without a JSON line: {child.stop()}")
                    times[who].append(time.perf_counter() - began)
                    used[who].append(child.cpu())
    for metric, found in ((WALL, times), (CPU, used)):
        for who, values in found.items():
            yield Sample(SETUP, metric, who, median(values) * 1000)


class _Heartbeats:
    """Heartbeats to a port, from a thread."""

    def __init__(self, port: int) -> None:
        self._port = port
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> None:
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            out.connect(("127.0.0.1", self._port))
            while not self._stop.wait(EVERY):
                with contextlib.suppress(OSError):  # the receiver does not listen yet
                    out.send(dialect.MAVLink_heartbeat_message(10, 3, 81, 0, 3, 3).pack(mav))
                    mav.seq = (mav.seq + 1) & 255


CASE = Case("start", "Start", measure)
