"""Runs the screen of `watch` on the terminal, until the user or a signal ends it."""

from __future__ import annotations

import os
import signal
import sys
import termios
import threading
from types import FrameType
from typing import Any, Final

from textual.drivers.linux_driver import LinuxDriver

from . import terminal_size
from .app import WatchApp
from .log_lines import LogLines
from .robots import Source
from .text import Signs

PATIENCE: Final = 3.0
"""Seconds for the terminal to take the last output."""
ENDS: Final = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Output(LinuxDriver):
    """Draws on standard output: standard error may be a file with the log."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._file = sys.__stdout__

    def _get_terminal_size(self) -> tuple[int, int]:
        return terminal_size()


def run(source: Source, log: LogLines, signs: Signs) -> int:
    """Show the source. Returns the exit code."""
    app, before = WatchApp(source, log, signs, Output), termios.tcgetattr(0)

    def give_up() -> None:
        termios.tcsetattr(0, termios.TCSANOW, before)
        os._exit(0)

    def end(number: int, frame: FrameType | None) -> None:
        """Not a handler of asyncio: the loop may be waiting for a terminal that takes no output any more."""
        timer = threading.Timer(PATIENCE, give_up)
        timer.daemon = True
        timer.start()
        app.call_later(app.exit)

    for number in ENDS:
        signal.signal(number, end)
    app.run()
    return app.return_code or 0
