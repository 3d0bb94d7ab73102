"""The installed command as a process, and its lines with their arrival times. Every wait has a deadline."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from datetime import datetime
from typing import IO, Any, NamedTuple, TypeVar

from ..deadline import SOON, Deadline, allow

COMMAND = tuple(shlex.split(os.environ.get("TESTED_COMMAND", f"{sys.executable} -m mav_robot_status.cli")))
"""The command under test. Another version of the program can be named in the environment."""
T = TypeVar("T")


class Line(NamedTuple):
    """One JSON line."""

    at: float
    """When it arrived: seconds on the monotonic clock."""
    status: dict[str, Any]

    @property
    def stamp(self) -> float:
        """When the gateway made it: Unix seconds."""
        return datetime.fromisoformat(self.status["stamp"].replace("Z", "+00:00")).timestamp()


def run(*arguments: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run the command to its end."""
    command = [*COMMAND, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=allow(30), check=False, **options)


class Gateway:
    """A gateway that runs until `stop` or until it ends by itself."""

    def __init__(self, *arguments: str, reads: bool = True) -> None:
        """Start it. With `reads` false nobody reads its standard output, which is a pipe."""
        self.lines: list[Line] = []
        self.log: list[str] = []
        self._news = threading.Condition()
        self.started = time.monotonic()
        self.process = subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert self.process.stdout is not None
        assert self.process.stderr is not None
        self._threads = [threading.Thread(target=self._read, args=(self.process.stderr, self._take_log), daemon=True)]
        if reads:
            self._threads.append(
                threading.Thread(target=self._read, args=(self.process.stdout, self._take_line), daemon=True)
            )
        for thread in self._threads:
            thread.start()

    @property
    def port(self) -> int:
        """The port of the first link that listens."""
        return self.ports(1)[0]

    def ports(self, count: int) -> list[int]:
        """The ports of the first links that listen."""

        def listening() -> list[int] | None:
            found = [int(m[1]) for line in self.log if (m := re.search(r"listening on \S+:(\d+)/udp", line))]
            return found if len(found) >= count else None

        return self._until(listening, f"{count} ports")

    @property
    def address(self) -> tuple[str, int]:
        """Where the gateway listens."""
        return "127.0.0.1", self.port

    def wait_for(
        self, wanted: Callable[[dict[str, Any]], bool], after: float = 0.0, what: str = "line", seconds: float = SOON
    ) -> Line:
        """The first line after the instant `after` for which `wanted` is true."""

        def found() -> Line | None:
            return next((line for line in self.lines if line.at > after and wanted(line.status)), None)

        return self._until(found, what, seconds)

    def wait_for_lines(self, count: int, after: float = 0.0) -> Line:
        """Line number `count` after the instant `after`."""
        return self._until(lambda: [line for line in self.lines if line.at > after][count - 1 :], f"{count} lines")[0]

    def wait_for_log(self, pattern: str, seconds: float = SOON) -> re.Match[str]:
        """The first match of `pattern` in the log."""

        def found() -> re.Match[str] | None:
            return next((m for line in self.log if (m := re.search(pattern, line))), None)

        return self._until(found, pattern, seconds)

    def wait_for_end(self, seconds: float = SOON) -> int:
        """The exit code."""
        code = self.process.wait(allow(seconds))
        for thread in self._threads:
            thread.join(allow(seconds))
        return code

    def stop(self, number: signal.Signals = signal.SIGTERM) -> int:
        """End it with a signal; the exit code."""
        self.process.send_signal(number)
        return self.wait_for_end()

    def state(self) -> str:
        """The state of the process as in ps: R, S, T, ..."""
        with open(f"/proc/{self.process.pid}/stat", encoding="ascii") as stat:
            return stat.read().rpartition(")")[2].split()[0]

    def memory(self) -> float:
        """Resident memory in MB."""
        with open(f"/proc/{self.process.pid}/status", encoding="ascii") as status:
            return int(next(line for line in status if line.startswith("VmRSS")).split()[1]) / 1024

    def cpu(self) -> float:
        """Seconds of processor time used so far."""
        with open(f"/proc/{self.process.pid}/stat", encoding="ascii") as stat:
            fields = stat.read().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / 100

    def close(self) -> None:
        """Kill it if it still runs."""
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        for thread in self._threads:
            thread.join(allow(SOON))
        for pipe in (self.process.stdout, self.process.stderr):
            if pipe is not None:
                pipe.close()

    def _until(self, found: Callable[[], T | None], what: str, seconds: float = SOON) -> T:
        deadline = Deadline(seconds)
        with self._news:
            while not (result := found()):
                log = "\n".join(self.log[-20:])
                assert deadline.left, f"no {what}; last lines {self.lines[-2:]}, log: {log}"
                self._news.wait(deadline.left)
        return result

    def _read(self, pipe: IO[bytes], take: Callable[[str], None]) -> None:
        for raw in pipe:
            with self._news:
                take(raw.decode())
                self._news.notify_all()

    def _take_line(self, text: str) -> None:
        self.lines.append(Line(time.monotonic(), json.loads(text)))

    def _take_log(self, text: str) -> None:
        self.log.append(text.rstrip())
