"""Child processes and their kernel statistics: CPU time, memory, the queue of a UDP socket."""

from __future__ import annotations

import contextlib
import re
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Sequence

ROOT = Path(__file__).parents[1]
PATIENCE = 20.0  # s for a process to start or to end


class BenchError(Exception):
    """A measured program fails."""


class Child:
    """A measured process. As a context manager it always ends the process."""

    def __init__(
        self,
        command: Sequence[str],
        *,
        pipe: bool = False,
        env: dict[str, str] | None = None,
        terminal: int | None = None,
    ) -> None:
        """Start it. `pipe`: the caller reads its standard output; else it is discarded.

        `terminal`: the descriptor of a terminal for its standard input and output.
        """
        self._log: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115  # closed with the child
        self.process: subprocess.Popen[bytes] = subprocess.Popen(
            list(command),
            stdin=subprocess.DEVNULL if terminal is None else terminal,
            stdout=subprocess.PIPE if pipe else subprocess.DEVNULL if terminal is None else terminal,
            stderr=self._log,
            cwd=ROOT,
            env=env,
        )

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: Any) -> None:
        self.stop()
        if self.process.stdout is not None:
            self.process.stdout.close()
        self._log.close()

    def cpu(self) -> float:
        """Seconds of CPU time of all its threads so far, from its CPU-time clock (nanosecond resolution)."""
        return time.clock_gettime((~self.process.pid << 3) | 2)

    def memory(self) -> float:
        """Resident memory in MB."""
        return _value("VmRSS", Path(f"/proc/{self.process.pid}/status")) / 1024

    def peak_memory(self, longest: float) -> float:
        """The largest resident memory in MB, of a process that ends by itself. Raises BenchError if it fails.

        `longest`: the most seconds that it may take.
        """
        status, peak = Path(f"/proc/{self.process.pid}/status"), 0
        deadline = time.monotonic() + longest
        while self.process.poll() is None:
            if time.monotonic() > deadline:
                raise BenchError(f"has not ended after {longest:.0f} s")
            peak = max(peak, _value("VmHWM", status))
            time.sleep(0.005)
        if self.process.returncode:
            raise BenchError(f"has failed: {self.stop()[-300:].strip()}")
        return peak / 1024

    def wake_ups(self) -> int:
        """How often its threads have waited so far: the voluntary context switches."""
        tasks = Path(f"/proc/{self.process.pid}/task")
        return sum(_value("voluntary_ctxt_switches", task / "status") for task in tasks.iterdir())

    def stop(self) -> str:
        """End it, and return its standard error."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.process.wait(PATIENCE)
            self.process.kill()
            self.process.wait()
        self._log.seek(0)
        return self._log.read().decode("utf-8", "replace")

    def listens(self, port: int) -> None:
        """Wait until it has bound the UDP port. Raises BenchError on timeout."""
        deadline = time.monotonic() + PATIENCE
        while queue(port) is None:
            if self.process.poll() is not None or time.monotonic() > deadline:
                raise BenchError(f"does not listen on port {port}: {self.stop()[-300:].strip()}")
            time.sleep(0.01)


def _value(name: str, status: Path) -> int:
    """A number in a status file of the kernel; 0 if it is not there, as for a process that has just ended."""
    with contextlib.suppress(OSError):
        found = re.search(rf"^{name}:\s+(\d+)", status.read_text(), re.MULTILINE)
        return int(found[1]) if found else 0
    return 0


class Queue(NamedTuple):
    """The receiving side of a UDP socket."""

    waiting: int
    """Bytes that wait in the queue."""
    dropped: int
    """Datagrams dropped since the socket was opened, because the queue was full."""


def queue(port: int) -> Queue | None:
    """The queue of the socket that is bound to this port; None if no socket is."""
    for table in ("/proc/net/udp", "/proc/net/udp6"):
        with contextlib.suppress(OSError):
            for line in Path(table).read_text().splitlines()[1:]:
                cells = line.split()
                if int(cells[1].rpartition(":")[2], 16) == port:
                    return Queue(int(cells[4].partition(":")[2], 16), int(cells[-1]))
    return None


def drained(port: int, patience: float = 2.0) -> bool:
    """Wait until the queue of a port is empty; False on timeout."""
    deadline = time.monotonic() + patience
    while time.monotonic() < deadline:
        found = queue(port)
        if found is None or not found.waiting:
            return True
        time.sleep(0.002)
    return False


def free_port() -> int:
    """A free UDP port."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_port:
        any_port.bind(("127.0.0.1", 0))
        return int(any_port.getsockname()[1])
