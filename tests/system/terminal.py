"""A third party's program: the test types into it and waits for its output. Every wait has a deadline."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

from ..deadline import Deadline, allow

T = TypeVar("T")

PATIENCE = 30.0
"""Seconds on an idle machine for a third party's program, including its start."""


class Terminal:
    """A program that runs until `close`."""

    def __init__(self, *command: str, **options: Any) -> None:
        """Start it; `options` are those of `subprocess.Popen`."""
        self._pieces: list[str] = []
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    @property
    def text(self) -> str:
        """Its output so far."""
        return "".join(self._pieces)

    def type(self, line: str) -> None:
        """Type a line."""
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def wait_for(self, found: Callable[[str], T], what: str) -> T:
        """The first true value that `found` returns for the output."""
        deadline = Deadline(PATIENCE)
        while not (result := found(self.text)):
            if not self._thread.is_alive() or not deadline.left:
                raise AssertionError(f"no {what} in the output of {self.process.args!r}:\n{self.text[-3000:]}")
            time.sleep(0.1)  # tshark prints a lot, and a search of it takes time
        return result

    def close(self) -> None:
        """Terminate it, and kill it if that is not enough."""
        assert self.process.stdin is not None
        self.process.stdin.close()  # MAVProxy waits for a line until then
        self.process.terminate()
        try:
            self.process.wait(allow(5.0))
        except subprocess.TimeoutExpired:
            self.process.kill()
        self.process.wait()
        self._thread.join()
        assert self.process.stdout is not None
        self.process.stdout.close()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._pieces.append(line)
