"""Traffic for a process that is measured, and its CPU time while it gets it."""

from __future__ import annotations

import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any, NamedTuple

from .process import ROOT, BenchError, Child, drained, queue

if TYPE_CHECKING:
    from pathlib import Path

PACE = 0.97
"""A sender that reached less of the rate that it was told was at its limit."""
SETTLE = 0.2  # s between the warm-up and what is measured


class Fed(NamedTuple):
    """What a process did with some traffic."""

    sent: int
    lost: int
    """Datagrams that found no room in the socket's queue, or were not read in time."""
    seconds: float
    cpu: float
    """Seconds of CPU time."""
    asked: int
    """Frames a second that the sender was told to send."""
    behind: float = 0.0
    """Seconds that it went on reading when nothing was sent any more."""

    @property
    def rate(self) -> float:
        """Frames a second that were sent."""
        return self.sent / self.seconds

    @property
    def per_frame(self) -> float:
        """CPU time for each frame that was read, microseconds."""
        return self.cpu * 1e6 / max(1, self.sent - self.lost)

    @property
    def share(self) -> float:
        """Per cent of a core."""
        return 100 * self.cpu / self.seconds

    @property
    def slow_sender(self) -> bool:
        """Whether the sender could not do what it was told."""
        return self.rate < PACE * self.asked

    @property
    def note(self) -> str:
        """What one has to know to believe the value."""
        lost = f"{100 * self.lost / self.sent:.1f} % of the frames were lost" if self.lost else ""
        slow = f"the sender reached {self.rate:,.0f} frames/s only" if self.slow_sender else ""
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
        self._tell(f"raw {data.hex()}")

    def send(self, rate: int, seconds: float) -> tuple[int, float]:
        """Send; how many frames, and how many seconds it took."""
        self._tell(f"{rate} {seconds}")
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise BenchError("the sender has ended")
        sent, took = line.split()
        self.total += int(sent)
        return int(sent), float(took)

    def measure(self, child: Child, rate: int, seconds: float) -> Fed:
        """The child's CPU time while it gets traffic, until it has read everything."""
        dropped_before, cpu_before = self._dropped(), child.cpu()
        sent, took = self.send(rate, seconds)
        ended = time.perf_counter()
        complete = drained(self._port)
        behind = time.perf_counter() - ended
        lost = self._dropped() - dropped_before
        return Fed(sent, lost if complete else max(lost, 1), took, child.cpu() - cpu_before, rate, behind)

    def warm_up(self, rate: int = 800, seconds: float = 1.0) -> None:
        """Traffic before what is measured: connections are made, caches filled."""
        self.send(rate, seconds)
        drained(self._port)
        time.sleep(SETTLE)

    def _dropped(self) -> int:
        found = queue(self._port)
        return found.dropped if found else 0

    def _tell(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(line + "\n")
        self._process.stdin.flush()
