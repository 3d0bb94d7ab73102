"""The command on a terminal of its own: a pty with a terminal emulator behind it, which is read and typed to."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import termios
import threading
import time
from collections.abc import Callable
from typing import Any

import pyte

from .gateway_process import COMMAND, SOON

PLAIN_ENVIRONMENT = {name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "TMUX", "COLUMNS")}


class Screen:
    """A program on a terminal."""

    def __init__(
        self,
        *arguments: str,
        columns: int = 80,
        lines: int = 24,
        command: tuple[str, ...] = COMMAND,
        **environment: str,
    ) -> None:
        """Start the command with these arguments."""
        self._master, self.terminal = pty.openpty()
        self.emulator = pyte.Screen(columns, lines)
        self._stream = pyte.ByteStream(self.emulator)
        self.raw = b""
        """All that was written to the terminal."""
        self._lock = threading.Lock()
        self._set_size(columns, lines)
        self.before = termios.tcgetattr(self.terminal)
        self._stop = threading.Event()
        self.process = subprocess.Popen(
            [*command, *arguments],
            stdin=self.terminal,
            stdout=self.terminal,
            stderr=self.terminal,
            env={**PLAIN_ENVIRONMENT, "TERM": "xterm-256color", "LC_ALL": "C.UTF-8", **environment},
            start_new_session=True,
            preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    @property
    def text(self) -> list[str]:
        """What is on the screen, line by line."""
        with self._lock:
            return [line.rstrip() for line in self.emulator.display]

    def cell(self, line: int, column: int) -> Any:
        """One cell with its colours."""
        with self._lock:
            return self.emulator.buffer[line][column]

    def type(self, keys: str) -> None:
        """Type keys."""
        os.write(self._master, keys.encode())

    def resize(self, columns: int, lines: int) -> None:
        """Make the terminal another size, as a person does who drags its corner."""
        with self._lock:
            self.emulator.resize(lines, columns)
        self._set_size(columns, lines)

    def wait_for(self, wanted: Callable[[list[str]], Any], what: str, timeout: float = SOON) -> float:
        """When `wanted` was true of the screen's lines: seconds on the monotonic clock."""
        deadline = time.monotonic() + timeout
        while not wanted(self.text):
            if time.monotonic() > deadline or self.process.poll() is not None:
                raise AssertionError(f"no {what} within {timeout} s on the screen:\n" + "\n".join(self.text))
            time.sleep(0.01)
        return time.monotonic()

    def wait_for_text(self, text: str, timeout: float = SOON) -> float:
        """When the text was somewhere on the screen."""
        return self.wait_for(lambda lines: any(text in line for line in lines), repr(text), timeout)

    def wait_for_end(self) -> int:
        """The exit code."""
        code = self.process.wait(SOON)
        time.sleep(0.2)  # the thread reads what was written last
        return code

    def attributes(self) -> Any:
        """The terminal's settings (termios)."""
        return termios.tcgetattr(self.terminal)

    def close(self) -> None:
        """End it for sure."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self._stop.set()
        self._thread.join()
        os.close(self._master)
        os.close(self.terminal)

    def _set_size(self, columns: int, lines: int) -> None:
        fcntl.ioctl(self._master, termios.TIOCSWINSZ, struct.pack("HHHH", lines, columns, 0, 0))

    def _read(self) -> None:
        while not self._stop.is_set():
            if select.select([self._master], [], [], 0.02)[0]:
                data = os.read(self._master, 65536)
                with self._lock:
                    self.raw += data
                    self._stream.feed(data)
