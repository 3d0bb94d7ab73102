"""The log while a table is on the terminal: its last lines are kept for a line of the screen."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections import deque
from collections.abc import Iterator
from typing import Final

KEPT: Final = 50


class LogLines(logging.Handler):
    """A log handler that holds the last KEPT lines, each with whether it is a warning."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: deque[tuple[str, bool]] = deque(maxlen=KEPT)

    def emit(self, record: logging.LogRecord) -> None:
        """Add a record, without its traceback."""
        self.lines.append((record.getMessage(), record.levelno >= logging.WARNING))

    @contextlib.contextmanager
    def instead_of_stderr(self) -> Iterator[LogLines]:
        """Receive the log. If standard error is a terminal, nothing is written to it meanwhile."""
        root = logging.getLogger()
        before = root.handlers[:]
        root.handlers[:] = [self] if sys.stderr.isatty() else [*before, self]
        try:
            yield self
        finally:
            root.handlers[:] = before
