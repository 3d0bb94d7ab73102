"""Recorded logs (.tlog): a sequence of records, each 8 bytes of microseconds since 1970 (big-endian) and one frame.

Real logs also contain bytes that a radio has damaged (MAVProxy writes them as separate records), end within a record,
and have stamps of a clock that was set during the flight.
"""

from __future__ import annotations

import io
import os
import select
import stat
import weakref
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Any, Final

from mav_robot_status.clock import Instant
from mav_robot_status.errors import UsageError

SMALL_STEP_US = 5_000_000
"""A step back by more microseconds than this is a jump. A running clock is corrected by milliseconds to a second; a
clock that is set was wrong by minutes to decades. Time never stands still for longer."""
DAY_US = 86_400_000_000
"""A longer step forward means that the clock was set. A shorter one is silence, and is replayed as silence."""

LATEST: Final = 1 << 51
"""The latest plausible stamp, microseconds since 1970: in 2041."""
BLOCK = 1 << 13
"""Bytes of one block: few enough that the objects made of it do not trigger a run of the garbage collector."""

CHUNK: Final = 1 << 18
"""Bytes of one read."""
PATIENCE: Final = 5.0
"""Seconds to wait until something is written to a pipe."""
COMPRESSED: Final = {b"\x1f\x8b": "gzip", b"\xfd7zXZ\0": "xz"}
"""Files that are unpacked while they are read, by their first bytes."""

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
    return 0 <= later < LATEST and -SMALL_STEP_US <= later - earlier <= DAY_US


def _is_jump(latest: int, stamp: int, following: int) -> bool:
    """Whether the clock was set to `stamp`: the following stamp continues it, and does not continue `latest`."""
    return not follows(latest, stamp) and follows(stamp, following) and not follows(latest, following)


def _is_outlier(latest: int, stamp: int, following: int) -> bool:
    """Whether a stamp that is not a jump is wrong: only the following stamp continues `latest`."""
    return not follows(latest, stamp) or (not follows(stamp, following) and follows(latest, following))


class LogReader:
    """The bytes of a recorded log, in blocks. A log may be larger than the memory, or come from a pipe."""

    def __init__(self, path: str) -> None:
        """Open it and read its head. Raises UsageError if it is missing, empty, not a file, or of another kind."""
        self.path = path
        try:
            self._descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except (OSError, ValueError) as problem:
            raise self._unreadable(problem) from None
        weakref.finalize(self, os.close, self._descriptor)
        status = os.fstat(self._descriptor)
        self.is_pipe = stat.S_ISFIFO(status.st_mode)
        if stat.S_ISDIR(status.st_mode):
            raise UsageError(f"cannot read the log {path!r}: Is a directory")
        if not (self.is_pipe or stat.S_ISREG(status.st_mode)):
            raise UsageError(
                f"cannot read the log {path!r}: it is not a file but a device; write for example flight.tlog"
            )
        self._size = status.st_size
        self.given = 0
        """Bytes that `blocks` has returned."""
        self.trouble: str | None = None
        """Why the log ended early."""
        self._unpacked: io.BufferedIOBase | None = None
        """Of a compressed file."""
        self.head = self._read(PATIENCE)
        """The first bytes of the log."""
        if not self.head:
            raise UsageError(f"the log {path!r} is empty")
        packed = next((kind for magic, kind in COMPRESSED.items() if self.head.startswith(magic)), None)
        if packed is not None:
            self._unpack(packed)

    @property
    def share(self) -> float:
        """The fraction of the log that `blocks` has returned, from 0 to 1; 0 for a pipe, whose size is not known."""
        given = self.given if self._unpacked is None else os.lseek(self._descriptor, 0, os.SEEK_CUR)
        return min(given / self._size, 1.0) if self._size else 0.0

    def blocks(self) -> Iterator[bytes]:
        """The whole log, in order. Iterate once."""
        chunk = self.head
        while chunk:
            for start in range(0, len(chunk), BLOCK):
                block = chunk[start : start + BLOCK]
                self.given += len(block)
                yield block
            chunk = self._read(None)

    def _unpack(self, kind: str) -> None:
        """Read a compressed file from its start. Raises UsageError if it holds nothing."""
        if self.is_pipe:
            raise UsageError(f"{self.path} is a pipe with data of {kind}: unpack them before the pipe")
        os.lseek(self._descriptor, 0, os.SEEK_SET)
        file = io.FileIO(self._descriptor, closefd=False)
        if kind == "xz":
            import lzma

            self._unpacked = lzma.LZMAFile(file)  # noqa: SIM115  # it lives as long as the reader
        else:
            import gzip

            self._unpacked = gzip.GzipFile(fileobj=file)
        self.head = self._read(None)
        if not self.head:
            raise UsageError(f"cannot read the log {self.path!r}: {self.trouble or f'{kind} of nothing'}")

    def _read_unpacked(self, file: io.BufferedIOBase) -> bytes:
        """The next bytes; none at the end, and where the compressed data is damaged."""
        try:
            return file.read(CHUNK)
        except Exception as problem:  # gzip and lzma raise EOFError, OSError, and errors of their own
            self.trouble = f"its compressed data is cut off or damaged ({problem})"
            return b""

    def _read(self, seconds: float | None) -> bytes:
        """The next bytes; none at the end. Waits for the writer of a pipe, at most `seconds`."""
        if self._unpacked is not None:
            return self._read_unpacked(self._unpacked)
        try:
            if self.is_pipe and not select.select([self._descriptor], [], [], seconds)[0]:
                raise UsageError(f"cannot read the log {self.path!r}: it is a pipe, and nothing was written to it")
            return os.read(self._descriptor, CHUNK)
        except OSError as problem:
            raise self._unreadable(problem) from None

    def _unreadable(self, problem: Exception) -> UsageError:
        reason = (problem.strerror if isinstance(problem, OSError) else None) or "not a file name"
        return UsageError(f"cannot read the log {self.path!r}: {reason}")
