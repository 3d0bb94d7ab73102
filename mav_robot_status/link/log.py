"""Recorded logs (.tlog): 8 bytes of microseconds since 1970, big-endian, and a frame as it came; again and again.

Real logs also hold what a radio garbled (MAVProxy writes it as records of its own), end in the middle of a record, and
were stamped by computers whose clock was set during the flight.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any

from mav_robot_status.clock import Instant
from mav_robot_status.errors import UsageError

SMALL_STEP_US = 5_000_000
"""How far the log's clock may be behind itself before that is a jump: a running clock is corrected by
milliseconds to a second, a clock that is set was wrong by minutes to decades. Also the longest that time is held."""
DAY_US = 86_400_000_000
"""A longer step forward is a clock that was set; a shorter one is silence, and is lived through as it was live."""

_LATEST = 1 << 51  # microseconds, in 2041
BLOCK = 1 << 13
"""Bytes handed on at once: so few that Python never looks through what is made of them in search of garbage."""

new = tuple.__new__  # a NamedTuple of as many values as it has fields, in a third of the time that its own name takes


@dataclass
class Counts:
    """What had to be put right in a log's time stamps."""

    corrected: int = 0
    """Stamps that both neighbours contradict."""
    held: int = 0
    """Stamps at which time stood still because the clock was stepped back a little."""
    jumps: int = 0
    """Jumps of the clock that lasted; each started a new segment."""


Stamped = tuple[Instant, Any, bool]
"""When something in a log was heard, what, and whether it begins a new segment.

`mono` never decreases, `unix_us` is the log's stamp, corrected. A new segment begins where the log's clock has jumped
for good: what was known before is of another time.
"""


Record = tuple[Any, Any, Any, Any, Any, int]
"""A frame in a log (`framing.Values`), of which nothing but its stamp matters here: the last one."""
END = -1
"""In place of the stamp behind the end of a log."""
_NEVER = -(1 << 63)


def timed(records: Iterable[Record], last: Callable[[], int], counts: Counts) -> Iterator[Stamped]:
    """Say when each record was heard, and then, with None, when the log ended; nothing of a log without records.

    `last` gives the stamp at the end of the log once all records were read.
    """
    clock = _Clock(counts)
    latest = limit = segment = _NEVER
    mono = 0.0
    stamp = 0
    record: Record | None = None
    for following in records:
        next_stamp = following[5]
        # Nearly every record is neither before the last one nor after the next one.
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
    """The rules for a log's clock."""

    __slots__ = ("_counts", "latest", "mono", "segment")

    def __init__(self, counts: Counts) -> None:
        self._counts = counts
        self.latest = self.segment = _NEVER
        """The stamp that time has reached; the one at which the segment started."""
        self.mono = 0.0
        """Where the segment started."""

    def stamped(self, what: Any, stamp: int, following: int) -> Stamped:
        """When something was heard, by its stamp and the one `following` it."""
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
    """Whether two stamps, in microseconds, can be neighbours on a clock that was not set in between."""
    return 0 <= later < _LATEST and -SMALL_STEP_US <= later - earlier <= DAY_US


def _is_jump(latest: int, stamp: int, following: int) -> bool:
    """Whether the clock was set to `stamp`: the next stamp goes on from it, and does not go on from `latest`."""
    return not follows(latest, stamp) and follows(stamp, following) and not follows(latest, following)


def _is_outlier(latest: int, stamp: int, following: int) -> bool:
    """Whether a stamp that is no jump stands alone: it does not go on from `latest`, or the next one does instead."""
    return not follows(latest, stamp) or (not follows(stamp, following) and follows(latest, following))


class LogReader:
    """The bytes of a recorded log, block by block."""

    def __init__(self, path: str) -> None:
        """Read the file. Raises UsageError if there is none, it cannot be read, or it is empty."""
        self.path = path
        self._log = _read(path)
        self.size = len(self._log)
        self.given = 0
        """Bytes of the log that were handed on."""

    def blocks(self) -> Iterator[bytes]:
        """The whole log in order."""
        for start in range(0, self.size, BLOCK):
            self.given = min(start + BLOCK, self.size)
            yield self._log[start : start + BLOCK]


def _read(path: str) -> bytes:
    """The whole file at once: quicker than a map of it, and safe if the file is cut off meanwhile."""
    try:
        with open(path, "rb") as file:
            log = file.read()
    except (OSError, ValueError) as problem:
        reason = (problem.strerror if isinstance(problem, OSError) else None) or "not a file name"
        raise UsageError(f"cannot read the log {path!r}: {reason}") from None
    if not log:
        raise UsageError(f"the log {path!r} is empty")
    return log
