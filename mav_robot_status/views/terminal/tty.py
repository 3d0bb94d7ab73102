"""The terminal as a screen of our own: taken over, written to, and given back as it was, whatever happens."""

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
"""The other screen, no cursor, no wrapping of lines that are too long; empty."""
LEAVE: Final = b"\x1b[0m\x1b[?7h\x1b[?25h\x1b[?1049l"
ENDS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Signals that end the program, as KeyboardInterrupt."""
READ_AT_ONCE: Final = 1024


def is_screen() -> bool:
    """Whether standard input and output are a terminal with a cursor that can be moved."""
    return sys.stdin.isatty() and sys.stdout.isatty() and os.environ.get("TERM", "dumb") not in ("dumb", "unknown", "")


class Screen:
    """Standard input and output, as long as it is entered. Only in the main thread."""

    def __init__(self) -> None:
        self._in, self._out = sys.stdin.fileno(), sys.stdout.fileno()
        self._before: list[Any] = termios.tcgetattr(self._in)
        self._shown: list[bytes] = []
        """What each line shows now; empty: nothing is known of the screen."""
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
            for end in ENDS:  # it ends already
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
        """What was typed within so many seconds; empty if nothing was, or the size changed. None: nobody is left."""
        ready = select.select([self._in, self._wake_read], [], [], seconds)[0]
        if self._wake_read in ready:
            os.read(self._wake_read, READ_AT_ONCE)
        if self._suspend:
            self._sleep()
        if self._in not in ready:
            return b""
        try:
            return os.read(self._in, READ_AT_ONCE) or None
        except OSError:  # the terminal is gone
            return None

    def show(self, lines: list[bytes]) -> bool:
        """Write the lines that differ from those shown; False if the terminal takes nothing now, or is gone."""
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
        """Draw everything the next time."""
        self._shown = []

    def _write(self, data: bytes) -> bool:
        """A terminal that is held (Ctrl-S), or far away on a bad line, is not waited for."""
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
        """Ctrl-Z: give the terminal back, stop, and take it again when we go on."""
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
