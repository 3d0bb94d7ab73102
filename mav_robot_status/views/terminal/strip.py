"""The log while the screen is ours: the last lines are kept for the strip at the bottom."""

from __future__ import annotations

import contextlib
import logging
import sys
from collections import deque
from typing import TYPE_CHECKING, Final

from .state import Logged

if TYPE_CHECKING:
    from collections.abc import Iterator

KEPT: Final = 50


class Strip(logging.Handler):
    """Keeps the last lines of the log."""

    def __init__(self) -> None:
        super().__init__()
        self._lines: deque[Logged] = deque(maxlen=KEPT)
        self.count = 0
        """Lines that came so far."""

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a line; of a traceback its first."""
        self._lines.append(Logged(round(record.created * 1e6), record.getMessage(), record.levelno >= logging.WARNING))
        self.count += 1

    @property
    def lines(self) -> tuple[Logged, ...]:
        """The last lines, oldest first."""
        return tuple(self._lines)

    @contextlib.contextmanager
    def instead_of_stderr(self) -> Iterator[None]:
        """Take the log, and leave standard error out of it if that is the terminal."""
        root = logging.getLogger()
        before = root.handlers[:]
        root.handlers[:] = [self] if sys.stderr.isatty() else [*before, self]
        try:
            yield
        finally:
            root.handlers[:] = before
