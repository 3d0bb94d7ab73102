"""The terminal in full-screen mode. It is restored in every case."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import termios
import tty
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from types import FrameType, TracebackType

ENTER: Final = b"\x1b[?1049h\x1b[?25l\x1b[?7l\x1b[2J"
"""Alternate screen, no cursor, no line wrap, clear."""
LEAVE: Final = b"\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l"
ENDS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end the program. They raise KeyboardInterrupt."""
READ_AT_ONCE: Final = 1024


def is_screen() -> bool:
    """Whether standard input and output are a terminal with a movable cursor."""
    return sys.stdin.isatty() and sys.stdout.isatty() and os.environ.get("TERM", "dumb") not in ("dumb", "unknown", "")


class Screen:
    """A context that uses standard input and output as a screen. Only for the main thread."""

    def __init__(self) -> None:
        self._in, self._out = sys.stdin.fileno(), sys.stdout.fileno()
        self._before: list[Any] = termios.tcgetattr(self._in)
        self._shown: list[bytes] = []
        """The lines on the screen; empty: unknown."""
        self._handlers: dict[int, Any] = {}
        self._suspend = False
        self._wake_read, self._wake_write = os.pipe()

    def __enter__(self) -> Screen:
        os.set_blocking(self._wake_write, False)
        signals: dict[signal.Signals, Any] = dict.fromkeys(ENDS, signal.default_int_handler)
        for number, handler in {**signals, signal.SIGWINCH: self._resized, signal.SIGTSTP: self._stopped}.items():
            self._handlers[number] = signal.signal(number, handler)
        try:
            self._take()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            for end in ENDS:  # the program is already ending
                signal.signal(end, signal.SIG_IGN)
        finally:
            self._give_back()
            for number, handler in self._handlers.items():
                signal.signal(number, handler)
            os.close(self._wake_read)
            os.close(self._wake_write)

    def size(self) -> tuple[int, int]:
        """Columns and lines."""
        try:
            columns, lines = os.get_terminal_size(self._out)
        except OSError:
            columns = lines = 0
        return columns or 80, lines or 24

    def wait(self, seconds: float) -> bytes | None:
        """Wait for input. Empty after `seconds` or a change of size; None if the terminal is closed."""
        ready = select.select([self._in, self._wake_read], [], [], seconds)[0]
        if self._wake_read in ready:
            os.read(self._wake_read, READ_AT_ONCE)
        if self._suspend:
            self._sleep()
        if self._in not in ready:
            return b""
        try:
            return os.read(self._in, READ_AT_ONCE) or None
        except OSError:  # the terminal is closed
            return None

    def show(self, lines: list[bytes]) -> bool:
        """Write the lines that differ from those shown. False if the terminal does not accept output."""
        if len(lines) != len(self._shown):
            self._shown = []
        changed = [
            b"\x1b[%d;1H" % (number + 1) + line
            for number, line in enumerate(lines)
            if not self._shown or self._shown[number] != line
        ]
        if changed and not self._write(b"".join([*([] if self._shown else [b"\x1b[2J"]), *changed])):
            return False
        self._shown = lines
        return True

    def forget(self) -> None:
        """Redraw everything the next time."""
        self._shown = []

    def _write(self, data: bytes) -> bool:
        """Write without waiting for a terminal that is stopped (Ctrl-S) or slow. False if nothing was written."""
        with contextlib.suppress(OSError):
            if select.select([], [self._out], [], 0)[1]:
                while data:
                    data = data[os.write(self._out, data) :]
                return True
        return False

    def _take(self) -> None:
        tty.setcbreak(self._in, termios.TCSANOW)
        self._shown = []
        self._write(ENTER)

    def _give_back(self) -> None:
        self._write(LEAVE)
        with contextlib.suppress(termios.error):
            termios.tcsetattr(self._in, termios.TCSANOW, self._before)

    def _sleep(self) -> None:
        """Ctrl-Z: restore the terminal, stop the process, and set the terminal up again on SIGCONT."""
        self._suspend = False
        self._give_back()
        signal.signal(signal.SIGTSTP, signal.SIG_DFL)
        signal.raise_signal(signal.SIGTSTP)
        signal.signal(signal.SIGTSTP, self._stopped)
        self._take()

    def _wake(self) -> None:
        with contextlib.suppress(OSError):
            os.write(self._wake_write, b"x")

    def _resized(self, number: int, frame: FrameType | None) -> None:
        self._shown = []
        self._wake()

    def _stopped(self, number: int, frame: FrameType | None) -> None:
        self._suspend = True
        self._wake()
