"""A live table in the terminal: on Textual if it is installed, else a plain one; in a pipe a line for each change."""

from __future__ import annotations

import locale
import os
import shutil
import signal
import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec

from ...extras import install
from .log_lines import LogLines
from .robots import Source
from .text import Signs

__all__ = ["Source", "is_screen", "show", "terminal_size"]

KEYS = "j k PgDn PgUp: scroll; q: quit"
HINT = "For search, sorting and the mouse: "
NO_UTF8 = "Search, sorting and the mouse need a terminal with UTF-8"


def is_screen() -> bool:
    """Whether standard input and output are a terminal with a movable cursor."""
    return sys.stdin.isatty() and sys.stdout.isatty() and os.environ.get("TERM", "dumb") not in ("dumb", "unknown", "")


def terminal_size() -> os.terminal_size:
    """The size of the terminal; 80 x 24 for one that reports none, as serial consoles do."""
    size = shutil.get_terminal_size()
    return os.terminal_size((size.columns or 80, size.lines or 24))  # Python 3.10 passes a 0 on


def show(source: Source, footer: Callable[[], Sequence[str]] | None = None) -> int:
    """Show a source until it ends or the user quits; a signal raises KeyboardInterrupt. Returns the exit code.

    `footer` gives the lines below the table instead of those of the log. The table is the plain one then.
    """
    utf8 = locale.nl_langinfo(locale.CODESET).upper().replace("-", "") == "UTF8"
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.default_int_handler)
    signs = Signs(utf8)
    if not is_screen():
        from .plain import print_changes

        print_changes(source, signs)
        return 0
    with LogLines().instead_of_stderr() as log:
        if not footer and utf8 and find_spec("textual") is not None:
            from .screen import run

            return run(source, log, signs)
        from .plain import redraw

        command = install("watch")
        redraw(source, signs, footer or (lambda: _footer(log, utf8, command)))
    if utf8 and not footer and len(command) > terminal_size().columns:  # in one piece, to be copied
        sys.stderr.write(f"{HINT}{command}\n")
    return 0


def _footer(log: LogLines, utf8: bool, command: str) -> tuple[str, ...]:
    """The last line of the log, the keys, and the command for more of them if it fits into one line."""
    hint = f"{HINT}{command}" if utf8 else NO_UTF8
    width = terminal_size().columns
    shown = next((text for text in (hint, command) if len(text) <= width), "")
    return (*[text for text, _ in list(log.lines)[-1:]], KEYS, *([shown] if shown else []))
