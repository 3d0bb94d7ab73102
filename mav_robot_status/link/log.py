"""Recorded logs (.tlog): 8 bytes of microseconds since 1970, big-endian, and a frame as it came; again and again.

Real logs also hold what a radio garbled (MAVProxy writes it as records of its own), end in the middle of a record, and
were stamped by computers whose clock was set during the flight.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from struct import Struct, error
from typing import NamedTuple

from mav_robot_status.clock import Instant
from mav_robot_status.errors import UsageError

SMALL_STEP_US = 5_000_000
"""How far the log's clock may be behind itself before that is a jump: a running clock is corrected by
milliseconds to a second, a clock that is set was wrong by minutes to decades. Also the longest that time is held."""
DAY_US = 86_400_000_000
"""A longer step forward is a clock that was set; a shorter one is silence, and is lived through as it was live."""

_LATEST = 1 << 51  # microseconds, in 2041: of a plausible stamp the top byte is 0 and the second below 8
_HEADER = Struct(">QBBB").unpack_from  # stamp; of the frame: magic, payload length, incompatibility flags
_V1, _V2 = 0xFE, 0xFD
_V1_EXTRA, _V2_EXTRA, _SIGNATURE = 8 + 6 + 2, 8 + 10 + 2, 13  # bytes of a record beside the payload
_STAMP = 8


class Record(NamedTuple):
    """One record of a log."""

    now: Instant
    """When it was heard: `mono` never decreases, `unix_us` is the log's stamp, corrected."""
    data: bytes
    """A frame, with what garbage followed it; or garbage alone."""
    new_segment: bool
    """True where the log's clock has jumped for good: what was known before is of another time."""


@dataclass
class Counts:
    """What was found in a log, and what had to be put right."""

    records: int = 0
    garbage_bytes: int = 0
    """Handed on in a record without being a frame."""
    skipped_bytes: int = 0
    """Before the first record."""
    torn_bytes: int = 0
    """After the last whole record."""
    corrected: int = 0
    """Records whose time stamp both neighbours contradict."""
    held: int = 0
    """Records during which time stood still because the clock was stepped back a little."""
    jumps: int = 0
    """Jumps of the clock that lasted; each started a new segment."""


Piece = tuple[int, int, bytes]
"""One record as it stands in the file: its stamp, the next record's (END if there is none), and its bytes.

Stamps are microseconds since 1970. A plain tuple, because one is made for every record of a log.
"""
END = -1
_NEVER = -(1 << 63)


def timed(pieces: Iterable[Piece], counts: Counts) -> Iterator[Record]:
    """Say when each piece was heard, by the rules for a log's clock; looks ahead one record. Pure but for `counts`."""
    latest = segment = _NEVER  # the stamp that time has reached; the one at which the segment started
    mono = 0.0  # where the segment started
    jumped = False
    new = tuple.__new__  # this runs for every record of a log, and a NamedTuple's own constructor takes twice as long
    for stamp, following, data in pieces:
        # Nearly every record is neither before the last one nor after the next one.
        if not (0 <= stamp - latest <= DAY_US and stamp <= following):
            if latest == _NEVER:
                latest = segment = stamp
            elif _is_jump(latest, stamp, following):
                counts.jumps += 1
                jumped = True
                mono += (latest - segment) * 1e-6
                latest = segment = stamp
            elif _is_outlier(latest, stamp, following):
                counts.corrected += 1
                stamp = latest
            elif stamp < latest:
                counts.held += 1
                stamp = latest
        latest = stamp
        yield new(Record, (new(Instant, (mono + (stamp - segment) * 1e-6, stamp)), data, jumped))
        jumped = False


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
    """The records of a log, in order. Iterating again starts again, with new counts."""

    def __init__(self, path: str) -> None:
        """Read the file. Raises UsageError if there is none, it cannot be read, or it holds no record."""
        self.path = path
        self._log = _read(path)
        first = _seek(self._log, 0, None)
        if first is None:
            raise UsageError(
                f"{path} is not a recorded log: no MAVLink frame with a time stamp in it; a .tlog is needed"
            )
        self._first = first
        self.counts = Counts()

    def __iter__(self) -> Iterator[Record]:
        """Read the log through; `counts` and `summary` are complete when it is over."""
        self.counts = Counts()
        return timed(_cut(self._log, self._first, self.counts), self.counts)

    def summary(self) -> str:
        """One line for the person: what was read, and of what was wrong only what occurred."""
        found = (
            (self.counts.garbage_bytes, "bytes of garbage"),
            (self.counts.skipped_bytes, "bytes skipped before the first record"),
            (self.counts.torn_bytes, "bytes of a torn record at the end"),
            (self.counts.corrected, "wrong time stamps corrected"),
            (self.counts.held, "records held while the clock was stepped back"),
            (self.counts.jumps, "jumps of the clock, each a new segment"),
        )
        return ", ".join([f"{self.path}: {self.counts.records} records", *(f"{n} {what}" for n, what in found if n)])


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


def _cut(log: bytes, start: int, counts: Counts) -> Iterator[Piece]:
    """The records from `start` on."""
    counts.skipped_bytes = start
    header = _HEADER
    while True:
        try:
            stamp, magic, length, flags = header(log, start)
            # The loop for a log in order: each frame is followed by a plausible stamp and another frame.
            while True:
                if magic == _V2:
                    end = start + length + (_V2_EXTRA + _SIGNATURE if flags & 1 else _V2_EXTRA)
                elif magic == _V1:
                    end = start + length + _V1_EXTRA
                else:
                    break
                following, magic, length, flags = header(log, end)
                if following >= _LATEST or (magic != _V2 and magic != _V1):
                    break
                counts.records += 1
                yield stamp, following, log[start + _STAMP : end]
                start, stamp = end, following
        except error:  # the file's end is near
            pass
        data_end, next_start = _mend(log, start, counts)
        if data_end > start:
            counts.records += 1
            following = END if next_start is None else _stamp(log, next_start)
            yield _stamp(log, start), following, log[start + _STAMP : data_end]
        if next_start is None:
            return
        start = next_start


def _mend(log: bytes, start: int, counts: Counts) -> tuple[int, int | None]:
    """Where the record at `start` ends and where the next one starts, if any, when it does not lead there.

    What is between them is garbage that belongs to the record. A torn record ends where it starts.
    """
    size = len(log)
    end = _end(log, start)
    if end == size:
        return size, None
    if end is not None and end < size and _starts(log, end, _stamp(log, start)):
        return end, end
    next_start = _seek(log, start + _STAMP, _stamp(log, start))
    if next_start is not None:
        counts.garbage_bytes += next_start - (end if end is not None and end < next_start else start + _STAMP)
        return next_start, next_start
    whole = end if end is not None and end < size else start
    counts.torn_bytes += size - whole
    return whole, None


def _seek(log: bytes, at: int, near: int | None) -> int | None:
    """Where the next record starts, from `at` on: at a stamp near `near`, or a plausible one whose frame leads on."""
    candidates = rb"\x00[\x00-\x07].{6}[\xfd\xfe]"
    if near is not None:
        candidates += b"|" + re.escape(near.to_bytes(8, "big")[:3])  # three bytes of a stamp last for twelve days
    for found in re.compile(b"(?=" + candidates + b")", re.DOTALL).finditer(log, at):
        if _starts(log, found.start(), near):
            return found.start()
    return None


def _starts(log: bytes, at: int, near: int | None) -> bool:
    """Whether a record starts at `at`: its stamp is near `near`, or its frame leads to a near stamp or to the end."""
    if len(log) - at < _STAMP:
        return False
    stamp = _stamp(log, at)
    if _alike(stamp, near):
        return True
    end = _end(log, at)
    if end is None or end > len(log):
        return False
    if len(log) - end < _STAMP:
        return True
    following = _stamp(log, end)
    return _alike(following, stamp) or _alike(following, near)


def _alike(stamp: int, near: int | None) -> bool:
    """Whether a stamp is plausible and within a day of another one: eight bytes that are no stamp hardly ever are."""
    return stamp < _LATEST and near is not None and abs(stamp - near) <= DAY_US


def _stamp(log: bytes, at: int) -> int:
    return int.from_bytes(log[at : at + _STAMP], "big")


def _end(log: bytes, start: int) -> int | None:
    """Where the record ends, by its frame's header; None if there is no frame."""
    if len(log) - start < 11:
        return None
    _, magic, length, flags = _HEADER(log, start)
    if magic == _V2:
        return int(start + length + _V2_EXTRA + (_SIGNATURE if flags & 1 else 0))
    return int(start + length + _V1_EXTRA) if magic == _V1 else None
