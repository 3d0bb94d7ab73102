"""The standard streams. The command never blocks on them, and ends cleanly when a reader closes its end."""

from __future__ import annotations

import contextlib
import io
import logging
import os
import select
import sys
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from typing import TextIO

    Handler = logging.StreamHandler[TextIO]
else:
    Handler = logging.StreamHandler

NO_OUTPUT: Final = io.StringIO()
"""The standard output for a pipeline without a publisher that writes to it."""


class StderrHandler(Handler):
    """The log on standard error. A full pipe loses lines; it does not block the gateway."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write the line if the pipe has room."""
        with contextlib.suppress(OSError, ValueError):  # a stream without a descriptor is written directly
            descriptor = self.stream.fileno()
            poll = select.poll()
            poll.register(descriptor, select.POLLOUT)
            if poll.poll(0) != [(descriptor, select.POLLOUT)]:
                return
        super().emit(record)


def complain(line: str) -> None:
    """Print one line on standard error, unless its reader is gone."""
    try:
        print(line, file=sys.stderr, flush=True)  # noqa: T201
    except OSError:
        detach(sys.stderr)


def detach(stream: TextIO) -> None:
    """Redirect a stream without a reader to /dev/null. Otherwise the interpreter reports an error at exit."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def open_missing() -> None:
    """Open standard streams that were closed at the start (`>&-`), before a socket gets their descriptor."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, os.fdopen(nowhere, "r" if name == "stdin" else "w"))
