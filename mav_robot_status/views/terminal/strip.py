"""The log during `watch`: a strip at the bottom of the screen shows its last lines."""

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
    """A log handler that holds the last KEPT lines."""

    def __init__(self) -> None:
        super().__init__()
        self._lines: deque[Logged] = deque(maxlen=KEPT)
        self.count = 0
        """The number of lines so far."""

    def emit(self, record: logging.LogRecord) -> None:
        """Add a record, without its traceback."""
        self._lines.append(Logged(round(record.created * 1e6), record.getMessage(), record.levelno >= logging.WARNING))
        self.count += 1

    @property
    def lines(self) -> tuple[Logged, ...]:
        """The last lines, oldest first."""
        return tuple(self._lines)

    @contextlib.contextmanager
    def instead_of_stderr(self) -> Iterator[None]:
        """Receive the log. If standard error is a terminal, nothing is written to it meanwhile."""
        root = logging.getLogger()
        before = root.handlers[:]
        root.handlers[:] = [self] if sys.stderr.isatty() else [*before, self]
        try:
            yield
        finally:
            root.handlers[:] = before
