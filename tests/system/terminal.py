"""Somebody else's program: what is typed into it, and what it prints. Every wait has an end."""

from __future__ import annotations

import subprocess
import threading
import time
from collections.abc import Callable
from typing import Any, TypeVar

T = TypeVar("T")

PATIENCE = 30.0
"""Seconds for what a program does that we did not write, its start included, on a busy machine."""


class Terminal:
    """A program that runs until `close`."""

    def __init__(self, *command: str, **options: Any) -> None:
        """Start it; `options` are those of `subprocess.Popen`."""
        self.text = ""
        """What it has printed so far."""
        self._news = threading.Condition()
        self.process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **options
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def type(self, line: str) -> None:
        """Type a line."""
        assert self.process.stdin is not None
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()

    def wait_for(self, found: Callable[[str], T], what: str) -> T:
        """What `found` returns of the text, as soon as it is true."""
        deadline = time.monotonic() + PATIENCE
        with self._news:
            while not (result := found(self.text)):
                left = deadline - time.monotonic()
                if left <= 0 or not self._thread.is_alive():
                    raise AssertionError(f"no {what} in what {self.process.args!r} printed:\n{self.text[-3000:]}")
                self._news.wait(left)
        return result

    def close(self) -> None:
        """End it for sure."""
        assert self.process.stdin is not None
        self.process.stdin.close()  # or MAVProxy goes on waiting for a line
        self.process.terminate()
        try:
            self.process.wait(5.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
        self.process.wait()
        self._thread.join()
        assert self.process.stdout is not None
        self.process.stdout.close()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            with self._news:
                self.text += line
                self._news.notify_all()
        with self._news:
            self._news.notify_all()
