"""Bytes in, frames out: a parser for MAVLink 1 and 2 without I/O.

`Parser` goes from frame to frame by the length in each header, and checks the CRC of every frame whose id is in
`definitions.CRC_EXTRA`. Only wanted frames become values. The parser has two states. *In sync* it trusts a header far
enough to skip a frame that it cannot check. *Out of sync* it accepts only a whole frame with a valid CRC. So a wrong
length byte cannot hide the valid frames behind it, and no damaged frame is counted twice.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from .counters import Counters, count
from .definitions import CRC_EXTRA
from .wire import FORMATS, MAGIC, REVERSED, SIGNED, UNDO, UNKNOWN, V1, V2, known_ids

if TYPE_CHECKING:
    from collections.abc import Collection

MAX_SOURCES: Final = 1024
"""The most (system, component) pairs that are checked for lost frames. A further one is checked only until another
sends."""
STAMP = struct.Struct(">Q").unpack_from  # precedes each frame of a recorded log: microseconds since 1970
STAMP_SIZE: Final = 8
LATE = 240  # a gap this long means a frame up to 16 places late, or a duplicate; not 240 lost frames
NEXT: Final[tuple[int, ...]] = (*range(1, 256), 0)  # by sequence number; a lookup is faster than the arithmetic
VALID, OPEN, WRONG = range(3)
new = tuple.__new__  # makes a NamedTuple of a tuple in a third of the time of its constructor


class Frame(NamedTuple):
    """One frame with a valid CRC."""

    message_id: int
    ids: tuple[int, int]
    """System id and component id of the sender."""
    sequence: int
    message: Any
    """A message of `definitions`; None if the id is not one of them."""
    raw: bytes
    """The whole frame as received if it is signed (not verified) or the parser keeps all frames; else b""."""
    stamp: int = 0
    """Microseconds since 1970 if frames have stamps (a recorded log); else 0."""

    @property
    def payload(self) -> bytes:
        """The payload as received; empty if `raw` is. MAVLink 2 removes trailing zeros."""
        raw = self.raw
        if not raw:
            return raw
        header = FORMATS[raw[0]].header
        return raw[header : header + raw[1]]


Values = tuple[int, tuple[int, int], int, Any, bytes, int]
"""The values of a Frame in a plain tuple, which takes a third of the time to build and unpack."""


class Parser:
    """Finds the frames in the bytes of one link or log. A feed may end anywhere within a frame.

    `wanted` are the message ids that `feed` returns; frames of other ids are only checked and counted. None: `feed`
    returns every frame with its `raw` bytes, also those of unknown ids, which it cannot check (for forwarding).
    `stamped`: a time stamp precedes each frame, as in a recorded log.
    """

    __slots__ = (
        "_current",
        "_expected",
        "_format",
        "_in_sync",
        "_keep_all",
        "_known",
        "_next_expected",
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
        self._format = FORMATS[V2]  # of the last frame: most streams have only one version, and often one source
        self._current = 0  # the last source: system | component << 8; 0.0 means none
        self._next_expected: int | None = None  # the next sequence number of the last source
        self._expected: dict[int, int | None] = {}  # by source; the entry of the last source may be out of date
        self._keep_all = wanted is None
        self._known = known_ids(frozenset(CRC_EXTRA if wanted is None else wanted))

    @property
    def pending(self) -> int:
        """Bytes kept of an incomplete frame."""
        return len(self._tail)

    def reset(self) -> None:
        """Drop an incomplete frame: the next bytes do not continue it (a new segment of a log)."""
        self.counters.garbage_bytes += len(self._tail)
        self._tail = b""
        self._in_sync = True

    def feed(self, data: bytes) -> list[Frame]:
        """The wanted frames that these bytes complete, in order. Never raises; keeps at most MAX_FRAME bytes."""
        found: list[Any] = self.walk(data)
        return [new(Frame, values) for values in found] if found else found

    def walk(self, data: bytes) -> list[Values]:
        """The frames of `feed` as plain tuples.

        One loop with local names. It makes no call and no object for an unwanted frame: the speed of the gateway
        depends on these few hundred nanoseconds a frame.
        """
        if self._tail:
            data = self._tail + data
        size = len(data)
        reversed_data = data.translate(REVERSED)
        version, unpack, header, seed = self._format
        known = self._known[version]
        current, next_expected, expected = self._current, self._next_expected, self._expected
        ids = current & 255, current >> 8
        frames: list[Values] = []
        message: Any
        good = since = old = 0
        stamped = i = self._stamp_size
        trailer, limit = 2 + stamped, size + stamped  # the CRC and the next stamp; where they may end
        before = -1
        if not self._in_sync:
            i = self._resync(data, reversed_data, min(stamped, size))
            if not self._in_sync:
                self._tail = data[max(0, i - stamped) :]
                return frames
        try:
            while i < size:
                if data[i] != version:
                    if data[i] not in FORMATS:
                        i = self._resync(data, reversed_data, i)
                        if self._in_sync:
                            continue
                        break
                    if version == V1:
                        old += good - since
                    since = good
                    self._format = version, unpack, header, seed = FORMATS[data[i]]
                    known = self._known[version]
                length, flags, sequence, source, wire_id = unpack(data, i)
                end = i + header + length
                following = end + trailer
                if flags and flags & SIGNED:
                    following += 13
                if following > limit:
                    break
                try:
                    effect, reads = known[wire_id]
                except KeyError:
                    effect, reads = UNKNOWN
                if crc_hqx(reversed_data[i:end], seed) ^ effect != UNDO[reversed_data[end + 1]] ^ reversed_data[end]:
                    if current in expected:
                        expected[current] = next_expected
                    unverified = i
                    i = self._skip_unverified(data, reversed_data, i, following)
                    next_expected = expected.get(current)
                    if self._in_sync and i > unverified:
                        if self._keep_all and effect < 0 and i == following:
                            frames.append(_unchecked(data, unverified, following - stamped))
                        continue
                    break
                before = i
                i = following
                if source != current:
                    if current in expected:
                        expected[current] = next_expected
                    next_expected = expected.get(source)
                    if next_expected is None and len(expected) < MAX_SOURCES:
                        expected[source] = None
                    current, ids = source, (source & 255, source >> 8)
                next_expected = NEXT[sequence] if sequence == next_expected else self._gap(next_expected, sequence)
                if flags:
                    if flags != SIGNED:
                        self.counters.incompatible += 1
                        continue
                    self.counters.signed += 1
                good += 1
                if reads is not None:
                    message_id, reader = reads
                    if reader is None:
                        message = None
                    else:
                        kind, whole, fields = reader
                        if length >= whole:
                            message = new(kind, fields(data, end - length))
                        else:
                            message = new(kind, fields(data[end - length : end].ljust(whole, b"\0")))
                    raw = data[before : i - stamped] if flags or self._keep_all else b""
                    stamp = STAMP(data, before - stamped)[0] if stamped else 0
                    frames.append((message_id, ids, sequence, message, raw, stamp))
        except struct.error:
            pass  # the data ends within a header
        self._current, self._next_expected = current, next_expected
        self._tail = data[i - stamped :]
        if stamped and before >= 0:
            (self.last_stamp,) = STAMP(data, before - stamped)
        self.counters.frames += good
        self.counters.frames_v1 += old + good - since if version == V1 else old
        return frames

    def _gap(self, expected: int | None, sequence: int) -> int:
        """Count the frames lost before this one; the first frame of a source only starts the count.

        Returns the sequence number of the next frame.
        """
        if expected is not None:
            gap = (sequence - expected) & 255
            if gap >= LATE:
                return expected
            self.counters.lost += gap
        return NEXT[sequence]

    def _skip_unverified(self, data: bytes, reversed_data: bytes, i: int, following: int) -> int:
        """The position after a whole frame whose CRC is wrong or cannot be checked; `i`: wait for more data.

        `following` is the start of the next frame if the length in the header is right. The length in a damaged frame
        may be wrong, so a valid frame inside it takes precedence. Otherwise the frame is skipped if another frame can
        start behind it. If the data ends with the frame, and a part of it may still become a frame, the parser waits
        for more data. Otherwise the parser is out of sync.
        """
        _, _, sequence, source, wire_id = FORMATS[data[i]].unpack(data, i)
        message_id = wire_id if isinstance(wire_id, int) else int.from_bytes(wire_id, "little")
        bad = message_id in CRC_EXTRA
        at_end = following >= len(data)
        inside, open_inside = self._find(data, reversed_data, i + 1, following) if bad or at_end else (-1, -1)
        if bad and inside >= 0:
            count(self.counters.bad_crc, message_id)
            self.counters.garbage_bytes += inside - i
            return inside
        if at_end and (inside >= 0 or open_inside >= 0):
            return i
        if at_end or data[following] in (V1, V2):
            count(self.counters.bad_crc if bad else self.counters.unknown, message_id)
            # its header may be damaged: the sequence number counts only if it is the expected one
            if self._expected.get(source) == sequence:
                self._expected[source] = NEXT[sequence]
            return following
        if bad:
            count(self.counters.bad_crc, message_id)
        return self._resync(data, reversed_data, i)

    def _resync(self, data: bytes, reversed_data: bytes, i: int) -> int:
        """The start of the next valid frame, in sync again; else the first position at which a frame may start."""
        found, open_ = self._find(data, reversed_data, i, len(data))
        self._in_sync = found >= 0
        stop = found if found >= 0 else open_ if open_ >= 0 else len(data)
        self.counters.garbage_bytes += stop - i
        return stop

    def _find(self, data: bytes, reversed_data: bytes, start: int, stop: int) -> tuple[int, int]:
        """The first start of a valid frame in a range, and before it the first start of an incomplete one; -1: none."""
        open_ = -1
        while match := MAGIC.search(data, start, stop):
            at = match.start()
            verdict = self._check(data, reversed_data, at)
            if verdict == VALID:
                return at, open_
            if verdict == OPEN and open_ < 0:
                open_ = at
            start = at + 1
        return -1, open_

    def _check(self, data: bytes, reversed_data: bytes, i: int) -> int:
        """VALID: a whole frame of a known id with a valid CRC. OPEN: the data ends too early to decide."""
        size = len(data)
        version, unpack, header, seed = FORMATS[data[i]]
        if i + header > size:
            return OPEN
        length, flags, _, _, wire_id = unpack(data, i)
        known = self._known[version]
        effect, _ = known[wire_id] if version == V1 or wire_id in known else UNKNOWN
        if effect < 0:
            return WRONG
        end = i + header + length
        if end + (15 if flags and flags & SIGNED else 2) > size:
            return OPEN
        crc = crc_hqx(reversed_data[i:end], seed) ^ effect
        return VALID if crc == UNDO[reversed_data[end + 1]] ^ reversed_data[end] else WRONG


def _unchecked(data: bytes, i: int, following: int) -> Frame:
    """A frame of an unknown id, with the values of its header."""
    raw = data[i:following]
    if raw[0] == V2:
        return Frame(int.from_bytes(raw[7:10], "little"), (raw[5], raw[6]), raw[4], None, raw)
    return Frame(raw[5], (raw[3], raw[4]), raw[2], None, raw)
