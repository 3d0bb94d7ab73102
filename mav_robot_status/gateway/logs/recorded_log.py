"""The frames of a recorded log, each with its time. `links.log` reads the bytes, `mavlink.framing` parses them."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, Final

from ...errors import UsageError
from ...hardware.mavlink.subjects import WANTED_IDS
from ...links.log import Counts, LogReader, timed
from ...mavlink.framing import Parser
from .raw_log import AutopilotClock, is_raw

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...links.log import Stamped
    from ...mavlink.framing import Frame


SEARCHED: Final = 16 << 20
"""Bytes without any MAVLink after which a file is not a log."""


class Recording:
    """One log. Iterate once: each wanted frame with the instant of its arrival; the last frame is None."""

    def __init__(self, log: LogReader | str, raw: bool = False) -> None:
        """Open the file, unless it is open. Raises UsageError if it cannot be read.

        `raw`: no time stamps precede the frames; the clock of the autopilot gives the times, see `raw_log`.
        """
        self._reader = LogReader(log) if isinstance(log, str) else log
        path = self._reader.path
        self._raw = raw
        if not raw and is_raw(self._reader.head):
            raise UsageError(
                f"{path} is a raw capture: MAVLink without the time stamps of a .tlog; replay it with --raw"
            )
        self._parser = Parser(WANTED_IDS, stamped=not raw)
        self._clock = AutopilotClock(self._reader.head) if raw else None
        self.counts = Counts()

    def __iter__(self) -> Iterator[Stamped]:
        """Raises UsageError at the end if the log held no MAVLink."""
        return timed(chain.from_iterable(self._frames()), self._last, self.counts)

    def _frames(self) -> Iterator[list[Frame]]:
        clock = self._clock
        for block in self._reader.blocks():
            found = self._parser.feed(block)
            yield found if clock is None else [clock.stamped(frame) for frame in found]
            if self._reader.given > SEARCHED and not self._is_mavlink():
                break
        if not self._is_mavlink():
            with_stamps = "" if self._raw else " with a time stamp"
            raise UsageError(
                f"{self._reader.path} is not a recorded log: no MAVLink frame{with_stamps} in it, and no onboard log "
                "either; a .tlog, .bin or .ulg is needed"
            )

    def _is_mavlink(self) -> bool:
        return bool(self._parser.counters.frames or self._parser.counters.unknown)

    def _last(self) -> int:
        """The stamp at the end."""
        return self._parser.last_stamp if self._clock is None else self._clock.stamp

    @property
    def share(self) -> float:
        """The fraction of the log that was read, from 0 to 1."""
        return self._reader.share

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
        told = [total, *(f"{number} {what}" for number, what in found if number)]
        return ", ".join(told + ([self._reader.trouble] if self._reader.trouble else []))
