"""Recorded logs (.tlog): a sequence of records, each 8 bytes of microseconds since 1970 (big-endian) and one frame.

Real logs also contain bytes that a radio has damaged (MAVProxy writes them as separate records), end within a record,
and have stamps of a clock that was set during the flight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from mav_robot_status.clock import Instant
from mav_robot_status.errors import UsageError

SMALL_STEP_US = 5_000_000
"""A step back by more microseconds than this is a jump. A running clock is corrected by milliseconds to a second; a
clock that is set was wrong by minutes to decades. Time never stands still for longer."""
DAY_US = 86_400_000_000
"""A longer step forward means that the clock was set. A shorter one is silence, and is replayed as silence."""

_LATEST = 1 << 51  # microseconds, in 2041
BLOCK = 1 << 13
"""Bytes of one block: few enough that the objects made of it do not trigger a run of the garbage collector."""

new = tuple.__new__  # makes a NamedTuple of a tuple in a third of the time of its constructor


@dataclass
class Counts:
    """Corrections of the time stamps of a log."""

    corrected: int = 0
    """Stamps that contradict both neighbours."""
    held: int = 0
    """Stamps at which time stands still, because the clock has stepped back a little."""
    jumps: int = 0
    """Lasting jumps of the clock; each starts a new segment."""


Stamped = tuple[Instant, Any, bool]
"""The time of a record, the record, and whether it starts a new segment.

`mono` never decreases; `unix_us` is the corrected stamp of the log. A new segment starts at a lasting jump of the
clock: state from before the jump is no longer valid.
"""


Record = tuple[Any, Any, Any, Any, Any, int]
"""A frame in a log (`framing.Values`). This module reads only its last value, the stamp."""
END = -1
"""The next stamp at the end of a log."""
_NEVER = -(1 << 63)


def timed(records: Iterable[Record], last: Callable[[], int], counts: Counts) -> Iterator[Stamped]:
    """Each record with its time, then None with the time of the end; nothing for a log without records.

    `last` returns the stamp at the end of the log after all records have been read.
    """
    clock = _Clock(counts)
    latest = limit = segment = _NEVER
    mono = 0.0
    stamp = 0
    record: Record | None = None
    for following in records:
        next_stamp = following[5]
        # Nearly every stamp lies between its neighbours.
        if stamp <= next_stamp <= limit:
            yield new(Instant, (mono + (stamp - segment) * 1e-6, stamp)), record, False
            latest = stamp
        elif record is not None:
            clock.latest = latest
            yield clock.stamped(record, stamp, next_stamp)
            latest, segment, mono = clock.latest, clock.segment, clock.mono
            limit = latest + DAY_US if latest <= next_stamp <= latest + DAY_US else _NEVER
        record, stamp = following, next_stamp
    if record is not None:
        clock.latest = latest
        yield clock.stamped(record, stamp, last())
        yield clock.stamped(None, last(), END)


class _Clock:
    """The rules for the clock of a log."""

    __slots__ = ("_counts", "latest", "mono", "segment")

    def __init__(self, counts: Counts) -> None:
        self._counts = counts
        self.latest = self.segment = _NEVER
        """The stamp that time has reached, and the stamp at the start of the segment."""
        self.mono = 0.0
        """`Instant.mono` at the start of the segment, in seconds."""

    def stamped(self, what: Any, stamp: int, following: int) -> Stamped:
        """The time of a record, from its stamp and the `following` stamp."""
        latest = self.latest
        jumped = False
        if latest == _NEVER:
            self.segment = stamp
        elif latest <= stamp <= following and stamp - latest <= DAY_US:
            pass
        elif _is_jump(latest, stamp, following):
            self._counts.jumps += 1
            jumped = True
            self.mono += (latest - self.segment) * 1e-6
            self.segment = stamp
        elif _is_outlier(latest, stamp, following):
            self._counts.corrected += 1
            stamp = latest
        elif stamp < latest:
            self._counts.held += 1
            stamp = latest
        self.latest = stamp
        return Instant(self.mono + (stamp - self.segment) * 1e-6, stamp), what, jumped


def follows(earlier: int, later: int) -> bool:
    """Whether two stamps (microseconds) can be neighbours if the clock was not set between them."""
    return 0 <= later < _LATEST and -SMALL_STEP_US <= later - earlier <= DAY_US


def _is_jump(latest: int, stamp: int, following: int) -> bool:
    """Whether the clock was set to `stamp`: the following stamp continues it, and does not continue `latest`."""
    return not follows(latest, stamp) and follows(stamp, following) and not follows(latest, following)


def _is_outlier(latest: int, stamp: int, following: int) -> bool:
    """Whether a stamp that is not a jump is wrong: only the following stamp continues `latest`."""
    return not follows(latest, stamp) or (not follows(stamp, following) and follows(latest, following))


class LogReader:
    """The bytes of a recorded log, in blocks."""

    def __init__(self, path: str) -> None:
        """Read the file. Raises UsageError if it does not exist, cannot be read, or is empty."""
        self.path = path
        self._log = _read(path)
        self.size = len(self._log)
        self.given = 0
        """Bytes of the log that `blocks` has returned."""

    def blocks(self) -> Iterator[bytes]:
        """The whole log, in order."""
        for start in range(0, self.size, BLOCK):
            self.given = min(start + BLOCK, self.size)
            yield self._log[start : start + BLOCK]


def _read(path: str) -> bytes:
    """The whole file: faster than mmap, and safe if the file is truncated meanwhile."""
    try:
        with open(path, "rb") as file:
            log = file.read()
    except (OSError, ValueError) as problem:
        reason = (problem.strerror if isinstance(problem, OSError) else None) or "not a file name"
        raise UsageError(f"cannot read the log {path!r}: {reason}") from None
    if not log:
        raise UsageError(f"the log {path!r} is empty")
    return log
