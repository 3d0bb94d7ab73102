"""Traffic for a process, and the CPU time that the process uses for it."""

from __future__ import annotations

import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from .process import ROOT, BenchError, Child, drained, queue

if TYPE_CHECKING:
    from pathlib import Path

PACE = 0.97
"""A sender below this fraction of the requested rate was at its limit."""
SETTLE = 0.2  # s between the warm-up and the measurement


class Fed(NamedTuple):
    """The result of one measurement."""

    sent: int
    lost: int
    """Datagrams that the kernel dropped because the queue was full, or that the process did not read in time."""
    seconds: float
    cpu: float
    """Seconds of CPU time."""
    requested: int
    """The requested rate in frames a second."""
    behind: float = 0.0
    """Seconds until the process has read all frames, after the last one was sent."""

    @property
    def rate(self) -> float:
        """Frames a second that were sent."""
        return self.sent / self.seconds

    @property
    def per_frame(self) -> float:
        """CPU time per frame, in microseconds."""
        return self.cpu * 1e6 / max(1, self.sent - self.lost)

    @property
    def share(self) -> float:
        """CPU load in per cent of a core."""
        return 100 * self.cpu / self.seconds

    @property
    def slow_sender(self) -> bool:
        """Whether the sender did not reach the requested rate."""
        return self.rate < PACE * self.requested

    @property
    def note(self) -> str:
        """A remark that limits the value; empty if there is none."""
        lost = f"{100 * self.lost / self.sent:.1f} % of the frames were lost" if self.lost else ""
        slow = f"the sender reached only {self.rate:,.0f} frames/s" if self.slow_sender else ""
        return ", ".join(text for text in (lost, slow) if text)


class Feed:
    """The sending process (`bench.sender`), and measurements with it."""

    def __init__(self, frames: Path, port: int) -> None:
        self._port = port
        self.total = 0
        """Frames sent so far."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "bench.sender", str(frames), str(port)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT,
        )  # fmt: skip

    def __enter__(self) -> Feed:
        return self

    def __exit__(self, *_: Any) -> None:
        self._process.kill()
        self._process.communicate()

    def raw(self, data: bytes) -> None:
        """Send one datagram."""
        self._command(f"raw {data.hex()}")

    def send(self, rate: int, seconds: float, burst: int = 1) -> tuple[int, float]:
        """Send, `burst` frames at once. Return the number of frames and the seconds that this took."""
        self.begin(rate, seconds, burst)
        return self.end()

    def begin(self, rate: int, seconds: float, burst: int = 1) -> None:
        """Begin to send, and return at once. `end` waits for the end."""
        self._command(f"{rate} {seconds} {burst}")

    def end(self) -> tuple[int, float]:
        """Wait until everything is sent. Return the number of frames and the seconds that this took."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise BenchError("the sender has ended")
        sent, took = line.split()
        self.total += int(sent)
        return int(sent), float(took)

    def measure(self, child: Child, rate: int, seconds: float, burst: int = 1) -> Fed:
        """The CPU time of the child from the first frame until it has read all of them."""
        dropped_before, cpu_before = self._dropped(), child.cpu()
        sent, took = self.send(rate, seconds, burst)
        ended = time.perf_counter()
        complete = drained(self._port)
        behind = time.perf_counter() - ended
        lost = self._dropped() - dropped_before
        return Fed(sent, lost if complete else max(lost, 1), took, child.cpu() - cpu_before, rate, behind)

    def warm_up(self, rate: int = 800, seconds: float = 1.0) -> None:
        """Traffic before the measurement: opens connections and fills caches."""
        self.send(rate, seconds)
        drained(self._port)
        time.sleep(SETTLE)

    def _dropped(self) -> int:
        found = queue(self._port)
        return found.dropped if found else 0

    def _command(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
