"""The frames of a recorded log, each with its time. `links.log` reads the bytes, `mavlink.framing` parses them."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from ..errors import UsageError
from ..hardware.mavlink.message_table import WANTED_IDS
from ..links.log import Counts, LogReader, timed
from ..mavlink.framing import Parser

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..links.log import Stamped
    from ..mavlink.framing import Values


class Recording:
    """One log. Iterate once: each wanted frame with the instant of its arrival; the last frame is None."""

    def __init__(self, path: str) -> None:
        """Read the file. Raises UsageError if it cannot be read."""
        self._reader = LogReader(path)
        self._parser = Parser(WANTED_IDS, stamped=True)
        self.counts = Counts()

    def __iter__(self) -> Iterator[Stamped]:
        """Raises UsageError at the end if the log held no MAVLink."""
        return timed(chain.from_iterable(self._frames()), lambda: self._parser.last_stamp, self.counts)

    def _frames(self) -> Iterator[list[Values]]:
        for block in self._reader.blocks():
            yield self._parser.walk(block)
        counters = self._parser.counters
        if not counters.frames and not counters.unknown:
            raise UsageError(
                f"{self._reader.path} is not a recorded log: "
                "no MAVLink frame with a time stamp in it; a .tlog is needed"
            )

    @property
    def share(self) -> float:
        """The fraction of the log that was read, from 0 to 1."""
        return self._reader.given / self._reader.size

    def summary(self) -> str:
        """One line for the user: the number of frames, and the faults that occurred."""
        counters = self._parser.counters
        found = (
            (counters.lost, "lost before they were recorded"),
            (sum(counters.bad_crc.values()), "with a bad CRC"),
            (sum(counters.unknown.values()), "with an unknown id"),
            (counters.incompatible, "with incompatible flags"),
            (counters.garbage_bytes, "bytes of garbage"),
            (self._parser.pending, "bytes of an incomplete record at the end"),
            (self.counts.corrected, "wrong time stamps corrected"),
            (self.counts.held, "time stamps held after a backward clock step"),
            (self.counts.jumps, "clock jumps, each starts a new segment"),
        )
        total = f"{self._reader.path}: {counters.frames} frames"
        return ", ".join([total, *(f"{number} {what}" for number, what in found if number)])
