"""Bytes in, frames out: a parser for MAVLink 1 and 2 without I/O.

`Parser` goes from frame to frame by the length in each header, and checks the CRC of every frame whose id is in
`definitions.CRC_EXTRA`. Only wanted messages are decoded. The parser has two states. *In sync* it trusts a header far
enough to skip a frame that it cannot check. *Out of sync* it accepts only a whole frame with a valid CRC. So a wrong
length byte cannot hide the valid frames behind it, and no damaged frame is counted twice.

The work for each byte is bounded for any input. A place at which a frame may start costs far more than a byte, and
bytes such as 0xFE can be one at every place. So each check is paid for with bytes that were read, see `CHECK`. What a
search has found is kept until more bytes arrive, so a stream in small pieces is not searched again with each piece.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Collection, Sequence
from typing import Any, Final, NamedTuple

from .counters import Counters, count
from .decode import Reader
from .definitions import CRC_EXTRA
from .wire import FORMATS, MAGIC, REVERSED, SIGNED, UNDO, UNKNOWN, V1, V2, known_ids

MAX_SOURCES: Final = 1024
"""The most (system, component) pairs that are checked for lost frames. Further ones are not."""
STAMP = struct.Struct(">Q").unpack_from  # precedes each frame of a recorded log: microseconds since 1970
STAMP_SIZE: Final = 8
LATE = 240  # a gap this long means a frame up to 16 places late, or a duplicate; not 240 lost frames
CHECK: Final = 24
"""Bytes that must have been read for each check of a place at which a frame may start. Random bytes have one such place
in 350 bytes. Where there are many more, a search looks at some of them only."""
SKIP: Final = 12
"""Bytes that must have been read for each skipped frame without a valid CRC. The shortest frame of MAVLink 2 is as
long, so frames of an unknown dialect are always skipped whole."""
MOST_CREDIT, FIRST_CREDIT = 6144, 768
"""The most unspent bytes kept for later checks, and how many a new parser has. A damaged frame may consist of places
at which a frame may start; all of them are checked. A new parser has fewer, because each new address gets a parser."""
TRAILER, SIGNED_TRAILER = 2, 15  # bytes after the payload: the CRC, and a signature
VALID, WRONG = 0, -1
new = tuple.__new__  # makes a NamedTuple from a tuple in a third of the time of its constructor


class Frame(NamedTuple):
    """One frame with a valid CRC."""

    message_id: int
    ids: tuple[int, int]
    """System id and component id of the sender."""
    sequence: int
    message: Any
    """A message of `definitions`; None if it is not wanted, or its id is not one of them."""
    raw: bytes
    """The whole frame as received. A signature is not verified. An id outside CRC_EXTRA: the CRC is not checked."""
    stamp: int = 0
    """Microseconds since 1970 if frames have stamps (a recorded log); else 0."""

    @property
    def payload(self) -> bytes:
        """The payload as received. MAVLink 2 removes trailing zeros."""
        raw = self.raw
        header = FORMATS[raw[0]].header
        return raw[header : header + raw[1]]


Values = tuple[int, tuple[int, int], int, Any, bytes, int]
"""What a Frame consists of. A Frame is such a tuple."""


class Parser:
    """Finds the frames in the bytes of one link or log. A feed may end anywhere within a frame.

    It returns every frame with its number and bytes, also those of unknown ids, which it cannot check. `wanted` are the
    ids of the messages that are decoded; None: all that are known.
    `stamped`: a time stamp precedes each frame, as in a recorded log.
    """

    __slots__ = (
        "_credit",
        "_expected",
        "_in_sync",
        "_known",
        "_open",
        "_searched",
        "_stamp_size",
        "_tail",
        "counters",
        "last_stamp",
    )

    def __init__(self, wanted: Collection[int] | None, stamped: bool = False) -> None:
        self.counters = Counters()
        self._stamp_size = STAMP_SIZE if stamped else 0
        self.last_stamp = 0
        """The stamp of the last valid frame, wanted or not, if frames are stamped."""
        self._tail = b""
        self._in_sync = True
        self._credit = FIRST_CREDIT  # unspent bytes at the start of `_tail`
        self._open: list[tuple[int, int]] = []  # out of sync: the places in `_tail` that are not decided, see `_search`
        self._searched = 0  # out of sync: the bytes of `_tail` that were searched
        self._expected: dict[int, int] = {}  # by source (system | component << 8): its next sequence number
        self._known = known_ids(frozenset(CRC_EXTRA if wanted is None else wanted))

    def want(self, ids: frozenset[int]) -> None:
        """Decode the messages of these ids from now on."""
        self._known = known_ids(ids)

    @property
    def pending(self) -> int:
        """Bytes kept of an incomplete frame."""
        return len(self._tail)

    def reset(self) -> None:
        """Drop an incomplete frame: the next bytes do not continue it (a new segment of a log)."""
        self.counters.garbage_bytes += len(self._tail)
        self._tail = b""
        self._in_sync = True
        self._open, self._searched = [], 0

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that these bytes complete, in order. Never raises; keeps at most MAX_FRAME bytes."""
        if self._tail:
            data = self._tail + data
        reversed_data = data.translate(REVERSED)
        frames: list[Frame] = []
        size, stamped = len(data), self._stamp_size
        i = self._resume(data, reversed_data)
        while self._in_sync and i < size:
            if data[i] not in FORMATS:
                i = self._resync(data, reversed_data, i)
                continue
            version, unpack, header, seed = FORMATS[data[i]]
            start = i + header
            if start > size:
                break
            length, flags, sequence, source, wire_id = unpack(data, i)
            end = start + length
            stop = end + (SIGNED_TRAILER if flags and flags & SIGNED else TRAILER)
            if stop > size:
                break
            effect, message_id, reader = self._known[version].get(wire_id, UNKNOWN)
            if crc_hqx(reversed_data[i:end], seed) ^ effect != UNDO[reversed_data[end + 1]] ^ reversed_data[end]:
                unverified = i
                i = self._skip_unverified(data, reversed_data, i, stop + stamped, sequence, source, wire_id)
                if i == unverified:
                    break
                if effect < 0 and i == stop + stamped and self._in_sync:
                    frames.append(_unchecked(data[unverified:stop], self._stamp(data, unverified)))
                continue
            self.last_stamp = stamp = self._stamp(data, i) if stamped else 0
            if self._count(version, flags, sequence, source):
                message = None if reader is None else _decoded(reader, data, start, end)
                ids = source & 255, source >> 8
                frames.append(new(Frame, (message_id, ids, sequence, message, data[i:stop], stamp)))
            i = stop + stamped
        rest = max(0, i - stamped)
        self._tail = data[rest:]
        self._credit += rest
        return frames

    def _resume(self, data: bytes, reversed_data: bytes) -> int:
        """The position at which the first frame is expected. Out of sync, that of the first valid one."""
        if self._in_sync:
            return self._stamp_size
        searched = max(self._searched, min(self._stamp_size, len(data)))
        return self._resync(data, reversed_data, searched, self._open)

    def _stamp(self, data: bytes, i: int) -> int:
        """The stamp of the frame at `i`; 0 without stamps."""
        stamp: int = STAMP(data, i - STAMP_SIZE)[0] if self._stamp_size else 0
        return stamp

    def _count(self, version: int, flags: int | bytes, sequence: int, source: int) -> bool:
        """Count a valid frame, and those lost before it. False for a frame with an unknown flag."""
        counters = self.counters
        expected = self._expected.get(source)
        if sequence == expected:
            self._expected[source] = sequence + 1 & 255
        elif expected is not None or len(self._expected) < MAX_SOURCES:
            gap = 0 if expected is None else (sequence - expected) & 255  # the first frame only starts the count
            if gap < LATE:
                counters.lost += gap
                self._expected[source] = sequence + 1 & 255
        if flags:
            if flags != SIGNED:
                counters.incompatible += 1
                return False
            counters.signed += 1
        counters.frames += 1
        counters.frames_v1 += version == V1
        return True

    def _skip_unverified(
        self, data: bytes, reversed_data: bytes, i: int, following: int, sequence: int, source: int, wire_id: Any
    ) -> int:
        """The position after a whole frame whose CRC is wrong or cannot be checked; `i`: wait for more data.

        `following` is the start of the next frame if the length in the header is right. The length in a damaged frame
        may be wrong, so a valid frame inside it takes precedence. Otherwise the frame is skipped if another frame can
        start behind it. If the data ends with the frame, and a part of it may still become a frame, the parser waits
        for more data. Otherwise the parser is out of sync.
        """
        credit = self._credit
        if credit + following > MOST_CREDIT:
            credit = MOST_CREDIT - following
        if credit + following < SKIP:
            return self._resync(data, reversed_data, i)
        self._credit = credit - SKIP
        message_id = wire_id if isinstance(wire_id, int) else int.from_bytes(wire_id, "little")
        bad = message_id in CRC_EXTRA
        at_end = following >= len(data)
        inside, open_ = self._search(data, reversed_data, i + 1, following) if bad or at_end else (-1, [])
        if bad and inside >= 0:
            count(self.counters.bad_crc, message_id)
            self.counters.garbage_bytes += inside - i
            return inside
        if at_end and (inside >= 0 or open_):
            self._credit += SKIP
            return i
        if at_end or data[following] in FORMATS:
            count(self.counters.bad_crc if bad else self.counters.unknown, message_id)
            # its header may be damaged: the sequence number counts only if it is the expected one
            if self._expected.get(source) == sequence:
                self._expected[source] = sequence + 1 & 255
            return following
        if bad:
            count(self.counters.bad_crc, message_id)
        return self._resync(data, reversed_data, i)

    def _resync(self, data: bytes, reversed_data: bytes, i: int, known: Sequence[tuple[int, int]] = ()) -> int:
        """The start of the next valid frame, in sync again; else the first position at which a frame may start.

        `known` are the places before `i` that were not decided when the data was shorter.
        """
        size = len(data)
        start = known[0][0] if known else i
        found, open_ = self._search(data, reversed_data, i, size, known)
        self._in_sync = found >= 0
        stop = found if found >= 0 else open_[0][0] if open_ else size
        tail = max(0, stop - self._stamp_size)
        self._open, self._searched = [(at - tail, needed - tail) for at, needed in open_], size - tail
        self.counters.garbage_bytes += stop - start
        return stop

    def _search(
        self, data: bytes, reversed_data: bytes, start: int, stop: int, known: Sequence[tuple[int, int]] = ()
    ) -> tuple[int, list[tuple[int, int]]]:
        """The first start of a valid frame in a range, or -1; and the places before it that are not decided yet.

        Those are pairs: the start of a frame, and how long the data must be to decide. `known` are such places before
        the range; they are paid for. If a check cannot be paid for, the search continues where one can be.
        """
        size = len(data)
        open_: list[tuple[int, int]] = []
        for place in known:
            at, needed = place
            if needed <= size:
                needed = self._check(data, reversed_data, at)
                if needed == VALID:
                    return at, open_
                if needed == WRONG:
                    continue
                place = at, needed
            open_.append(place)
        credit = self._credit
        found = -1
        while match := MAGIC.search(data, max(start, CHECK - credit), stop):
            at = match.start()
            credit = min(credit, MOST_CREDIT - at) - CHECK
            needed = self._check(data, reversed_data, at)
            if needed == VALID:
                found = at
                break
            if needed != WRONG:
                open_.append((at, needed))
            start = at + 1
        self._credit = credit
        return found, open_

    def _check(self, data: bytes, reversed_data: bytes, i: int) -> int:
        """VALID: a whole frame of a known id with a valid CRC. WRONG: not. Else the length of the data to decide."""
        size = len(data)
        version, unpack, header, seed = FORMATS[data[i]]
        if i + header > size:
            return i + header
        length, flags, _, _, wire_id = unpack(data, i)
        effect, _, _ = self._known[version].get(wire_id, UNKNOWN)
        if effect < 0:
            return WRONG
        end = i + header + length
        needed: int = end + (SIGNED_TRAILER if flags and flags & SIGNED else TRAILER)
        if needed > size:
            return needed
        crc = crc_hqx(reversed_data[i:end], seed) ^ effect
        return VALID if crc == UNDO[reversed_data[end + 1]] ^ reversed_data[end] else WRONG


def _decoded(reader: Reader, data: bytes, start: int, end: int) -> Any:
    """The message in the payload from `start` to `end`. MAVLink 2 cuts trailing zeros."""
    kind, whole, fields = reader
    if end - start >= whole:
        return new(kind, fields(data, start))
    return new(kind, fields(data[start:end].ljust(whole, b"\0")))


def _unchecked(raw: bytes, stamp: int) -> Frame:
    """A frame of an unknown id, with the values of its header."""
    if raw[0] == V2:
        return Frame(int.from_bytes(raw[7:10], "little"), (raw[5], raw[6]), raw[4], None, raw, stamp)
    return Frame(raw[5], (raw[3], raw[4]), raw[2], None, raw, stamp)
