"""The command on its own terminal: a pseudo-terminal with a terminal emulator that the test reads and types to."""

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

from ..deadline import SOON, Deadline, allow
from .gateway_process import COMMAND

PLAIN_ENVIRONMENT = {
    name: value for name, value in os.environ.items() if name not in ("NO_COLOR", "TMUX", "COLUMNS", "LINES")
}

MARK = b"\0"
"""Written to the terminal after the program has ended: everything before it is the program's."""


class Screen:
    """A program on a terminal."""

    def __init__(
        self,
        *arguments: str,
        columns: int = 80,
        lines: int = 24,
        command: tuple[str, ...] = COMMAND,
        told: bool = True,
        **environment: str,
    ) -> None:
        """Start the command with these arguments. With `told` false the terminal reports a size of 0 x 0."""
        self._master, self.terminal = pty.openpty()
        self.emulator = pyte.Screen(columns, lines)
        self._stream = pyte.ByteStream(self.emulator)
        self.raw = b""
        """Everything that was written to the terminal."""
        self._lock = threading.Lock()
        self._set_size(*((columns, lines) if told else (0, 0)))
        self.before = termios.tcgetattr(self.terminal)
        self._stop, self._marked = threading.Event(), threading.Event()
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
        """The lines on the screen."""
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
        """Resize the terminal, as a user does with the mouse."""
        with self._lock:
            self.emulator.resize(lines, columns)
        self._set_size(columns, lines)

    def wait_for(self, wanted: Callable[[list[str]], Any], what: str) -> float:
        """The instant at which `wanted` was true for the lines on the screen: seconds on the monotonic clock."""
        deadline = Deadline()
        while not wanted(self.text):
            if self.process.poll() is not None or not deadline.left:
                raise AssertionError(f"no {what} on the screen:\n" + "\n".join(self.text))
            time.sleep(0.01)
        return time.monotonic()

    def wait_for_text(self, text: str) -> float:
        """The instant at which the text was anywhere on the screen."""
        return self.wait_for(lambda lines: any(text in line for line in lines), repr(text))

    def wait_for_end(self) -> int:
        """The exit code; everything that the program wrote is in `raw`."""
        code = self.process.wait(allow(SOON))
        os.write(self.terminal, MARK)
        assert self._marked.wait(allow(SOON)), "the terminal passes nothing on"
        return code

    def attributes(self) -> Any:
        """The terminal's settings (termios)."""
        return termios.tcgetattr(self.terminal)

    def stop_reading(self) -> None:
        """Nobody reads the terminal any more, as on a line that is cut: its buffer fills up."""
        self._stop.set()
        self._thread.join()

    def close(self) -> None:
        """Kill the program if it still runs."""
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
                data, mark, _ = os.read(self._master, 65536).partition(MARK)
                with self._lock:
                    self.raw += data
                    self._stream.feed(data)
                if mark:
                    self._marked.set()
