"""The progress of a long read: one line on a terminal, removed at the end."""

from __future__ import annotations

from typing import Final, TextIO

from ..streams import visible

WIDTH: Final = 30
"""Characters of the bar."""
ERASE: Final = "\033[K"


class ProgressLine:
    """A progress bar, redrawn at each per cent. It prints nothing without a terminal."""

    def __init__(self, stream: TextIO, what: str) -> None:
        self._stream = stream
        self._what = visible(what)
        self._shown = -1
        self._on = stream.isatty()

    def __call__(self, share: float) -> None:
        """Show a share from 0 to 1. The cursor stays at the start, so that a log line overwrites the bar."""
        percent = int(share * 100)
        if self._on and percent != self._shown:
            self._shown = percent
            bar = "#" * (WIDTH * percent // 100)
            self._stream.write(f"{self._what}  [{bar:<{WIDTH}}] {percent:3} %{ERASE}\r")
            self._stream.flush()

    def close(self) -> None:
        """Remove the line."""
        if self._shown >= 0:
            self._stream.write(ERASE)
            self._stream.flush()
