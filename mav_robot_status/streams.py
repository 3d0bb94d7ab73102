"""The standard streams: whatever they lead to, or no longer lead to, the command ends in order and never waits."""

from __future__ import annotations

import contextlib
import logging
import os
import select
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from typing import TextIO

    Handler = logging.StreamHandler[TextIO]
else:
    Handler = logging.StreamHandler


class StderrHandler(Handler):
    """The log on standard error: if nobody reads it lines are lost, and the gateway goes on."""

    def emit(self, record: logging.LogRecord) -> None:
        """Write the line if there is room for it."""
        with contextlib.suppress(OSError, ValueError):  # a stream without a descriptor is written to as it is
            descriptor = self.stream.fileno()
            poll = select.poll()
            poll.register(descriptor, select.POLLOUT)
            if poll.poll(0) != [(descriptor, select.POLLOUT)]:
                return
        super().emit(record)


def complain(line: str) -> None:
    """One line for the person, if there is one who reads."""
    try:
        print(line, file=sys.stderr, flush=True)  # noqa: T201
    except OSError:
        detach(sys.stderr)


def detach(stream: TextIO) -> None:
    """Lead a stream whose reader has gone to nowhere, or the interpreter would complain when it ends."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)


def open_missing() -> None:
    """Standard streams that were closed before the start (`>&-`) lead nowhere, before a socket gets their number."""
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)
            setattr(sys, name, os.fdopen(nowhere, "r" if name == "stdin" else "w"))
