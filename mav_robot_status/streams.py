"""The standard streams. The command never blocks on them, and ends cleanly when a reader closes its end.

All text for a person passes `visible` here. Texts of vehicles, names of files and arguments may contain what a terminal
obeys: sequences that write the clipboard or move the cursor, and characters that reverse what follows.
"""

from __future__ import annotations

import contextlib
import io
import logging
import os
import select
import sys
from typing import TYPE_CHECKING, Final

from .errors import LinkError

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import TracebackType
    from typing import Any, TextIO

    Handler = logging.StreamHandler[TextIO]
else:
    Handler = logging.StreamHandler

NO_OUTPUT: Final = io.StringIO()
"""The standard output for a pipeline without a publisher that writes to it."""


def visible(text: object) -> str:
    """The text as one line: a character that does not print is shown by its code, as in JSON (`\\u001b`).

    Among them are the control characters of ASCII and C1, line separators, the signs that change the direction of
    writing, and characters of no width. Letters of all languages stay.
    """
    known = str(text)
    if known.isprintable():
        return known
    return "".join(c if c.isprintable() else _code(ord(c)) for c in known)


def _code(number: int) -> str:
    return f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"


def say(*lines: str) -> None:
    """Print lines on standard output. Raises LinkError if that fails, BrokenPipeError if its reader is gone."""
    encoding = sys.stdout.encoding or "utf-8"
    text = "".join(f"{visible(line)}\n" for line in lines)
    with writing():
        sys.stdout.write(text.encode(encoding, "backslashreplace").decode(encoding))
        sys.stdout.flush()


@contextlib.contextmanager
def writing() -> Iterator[None]:
    """Raise LinkError, one line, for a failed write to standard output."""
    try:
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        detach(sys.stdout)
        raise LinkError(f"cannot write to standard output: {error.strerror}") from None


class VisibleFormatter(logging.Formatter):
    """Makes each record visible text. Only a traceback has several lines."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802
        """The line of the record."""
        return visible(super().formatMessage(record))

    def formatException(  # noqa: N802
        self, ei: tuple[type[BaseException], BaseException, TracebackType | None] | tuple[None, None, None] | Any
    ) -> str:
        """The lines of the traceback."""
        return "\n".join(map(visible, super().formatException(ei).split("\n")))


class StderrHandler(Handler):
    """The log on standard error. A full pipe loses lines; it does not block the gateway."""

    def __init__(self, stream: TextIO, form: str = "%(message)s") -> None:
        """`form` is a format of `logging`."""
        super().__init__(stream)
        self.setFormatter(VisibleFormatter(form))

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
        print(visible(line), file=sys.stderr, flush=True)  # noqa: T201
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
