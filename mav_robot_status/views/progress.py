"""How far a long read has come: one line on a terminal, gone when it is done."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from typing import TextIO

WIDTH: Final = 30
"""Characters of the bar."""
ERASE: Final = "\033[K"


class ProgressLine:
    """A bar, drawn anew for each per cent. Says nothing where there is no terminal."""

    def __init__(self, stream: TextIO, what: str) -> None:
        self._stream = stream
        self._what = "".join(character if character.isprintable() else "?" for character in what)
        self._shown = -1
        self._on = stream.isatty()

    def __call__(self, share: float) -> None:
        """Show a share from 0 to 1. The cursor stays in front, so that a line of the log overwrites the bar."""
        percent = int(share * 100)
        if self._on and percent != self._shown:
            self._shown = percent
            bar = "#" * (WIDTH * percent // 100)
            self._stream.write(f"{self._what}  [{bar:<{WIDTH}}] {percent:3} %{ERASE}\r")
            self._stream.flush()

    def close(self) -> None:
        """Take the line away."""
        if self._shown >= 0:
            self._stream.write(ERASE)
            self._stream.flush()
