"""Bytes in, frames out: MAVLink 1 and 2 without any input or output of its own.

`Parser` walks from frame to frame by the length in each header and checks the CRC of every frame whose id is in
`definitions.CRC_EXTRA`; only wanted frames become values. It is either *in step*, where a header is believed
far enough to skip a frame that cannot be checked, or *hunting*, where nothing but a whole frame with a good CRC counts.
So a wrong length byte cannot swallow the good frames behind it, and no damaged frame is counted twice.
"""

from __future__ import annotations

import struct
from binascii import crc_hqx
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from .counters import Counters, count
from .definitions import CRC_EXTRA
from .wire import BACK, FORMATS, MAGIC, MIRROR, SIGNED, UNKNOWN, V1, V2, known_ids

if TYPE_CHECKING:
    from collections.abc import Collection

MAX_SOURCES: Final = 1024
"""So many (system, component) pairs are watched for lost frames; a further one only until another speaks."""
STAMP = struct.Struct(">Q").unpack_from  # before each frame of a recorded log: microseconds since 1970
STAMP_SIZE: Final = 8
LATE = 240  # a gap this long is a frame that came up to 16 places late, or twice, rather than 240 lost ones
NEXT: Final[tuple[int, ...]] = (*range(1, 256), 0)  # by sequence number; looking it up is quicker than counting
VALID, OPEN, WRONG = range(3)
new = tuple.__new__  # a NamedTuple of as many values as it has fields, in a third of the time that its own name takes


class Frame(NamedTuple):
    """One frame with a good CRC."""

    message_id: int
    ids: tuple[int, int]
    """System and component of its sender."""
    sequence: int
    message: Any
    """A message of `definitions`; None if the id is not among those."""
    raw: bytes
    """The whole frame as received, if it is signed (not verified) or the parser keeps everything; else b""."""
    stamp: int = 0
    """Microseconds since 1970, where frames are stamped (a recorded log)."""

    @property
    def payload(self) -> bytes:
        """As received, where `raw` is kept: MAVLink 2 cuts trailing zeros off."""
        raw = self.raw
        if not raw:
            return raw
        header = FORMATS[raw[0]].header
        return raw[header : header + raw[1]]


Values = tuple[int, tuple[int, int], int, Any, bytes, int]
"""Those of a Frame, in a plain tuple: it is made and taken apart in a third of the time."""


class Parser:
    """Finds the frames in the bytes of one link or log; they may be cut anywhere from feed to feed.

    `wanted` are the message ids that `feed` returns; frames of other ids are checked and counted, no more. None: every
    frame is returned with its `raw` bytes, also those of unknown ids, which cannot be checked (to pass them on).
    If it is `stamped`, each frame has its time before it, as in a recorded log.
    """

    __slots__ = (
        "_expected",
        "_format",
        "_in_step",
        "_keep_all",
        "_known",
        "_speaker",
        "_stamp_size",
        "_tail",
        "_upcoming",
        "counters",
        "last_stamp",
    )

    def __init__(self, wanted: Collection[int] | None, stamped: bool = False) -> None:
        self.counters = Counters()
        self._stamp_size = STAMP_SIZE if stamped else 0
        self.last_stamp = 0
        """The stamp of the last good frame, wanted or not, where frames are stamped."""
        self._tail = b""
        self._in_step = True
        self._format = FORMATS[V2]  # of the last frame: most streams have only one version, and often one speaker
        self._speaker = 0  # system and component << 8; nobody is 0.0
        self._upcoming: int | None = None  # the speaker's next sequence number
        self._expected: dict[int, int | None] = {}  # that of all who are watched, of others than the speaker
        self._keep_all = wanted is None
        self._known = known_ids(frozenset(CRC_EXTRA if wanted is None else wanted))

    @property
    def pending(self) -> int:
        """Bytes kept of a cut frame."""
        return len(self._tail)

    def reset(self) -> None:
        """Drop what is left of a cut frame: what comes next does not continue it (a new segment of a log)."""
        self.counters.garbage_bytes += len(self._tail)
        self._tail = b""
        self._in_step = True

    def feed(self, data: bytes) -> list[Frame]:
        """The wanted frames that these bytes complete, in order. Never raises, keeps at most MAX_FRAME bytes."""
        found: list[Any] = self.walk(data)
        return [new(Frame, values) for values in found] if found else found

    def walk(self, data: bytes) -> list[Values]:
        """What `feed` gives, as plain tuples.

        One loop with local names and without a call or an object for a frame that nobody wants: a few hundred
        nanoseconds a frame is what the whole gateway's speed rests on.
        """
        if self._tail:
            data = self._tail + data
        size = len(data)
        mirrored = data.translate(MIRROR)
        version, unpack, header, seed = self._format
        known = self._known[version]
        speaker, upcoming, expected = self._speaker, self._upcoming, self._expected
        ids = speaker & 255, speaker >> 8
        frames: list[Values] = []
        message: Any
        good = since = old = 0
        stamped = i = self._stamp_size
        trailer, limit = 2 + stamped, size + stamped  # the CRC and the next stamp; where they may end
        before = -1
        if not self._in_step:
            i = self._hunt(data, mirrored, min(stamped, size))
            if not self._in_step:
                self._tail = data[max(0, i - stamped) :]
                return frames
        try:
            while i < size:
                if data[i] != version:
                    if data[i] not in FORMATS:
                        i = self._hunt(data, mirrored, i)
                        if self._in_step:
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
                if crc_hqx(mirrored[i:end], seed) ^ effect != BACK[mirrored[end + 1]] ^ mirrored[end]:
                    if speaker in expected:
                        expected[speaker] = upcoming
                    doubtful = i
                    i = self._doubt(data, mirrored, i, following)
                    upcoming = expected.get(speaker)
                    if self._in_step and i > doubtful:
                        if self._keep_all and effect < 0 and i == following:
                            frames.append(_unchecked(data, doubtful, following - stamped))
                        continue
                    break
                before = i
                i = following
                if source != speaker:
                    if speaker in expected:
                        expected[speaker] = upcoming
                    upcoming = expected.get(source)
                    if upcoming is None and len(expected) < MAX_SOURCES:
                        expected[source] = None
                    speaker, ids = source, (source & 255, source >> 8)
                upcoming = NEXT[sequence] if sequence == upcoming else self._gap(upcoming, sequence)
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
        self._speaker, self._upcoming = speaker, upcoming
        self._tail = data[i - stamped :]
        if stamped and before >= 0:
            (self.last_stamp,) = STAMP(data, before - stamped)
        self.counters.frames += good
        self.counters.frames_v1 += old + good - since if version == V1 else old
        return frames

    def _gap(self, expected: int | None, sequence: int) -> int:
        """Count the frames missing before this one; the first frame of a source only starts its count.

        Gives the sequence number of the next one.
        """
        if expected is not None:
            gap = (sequence - expected) & 255
            if gap >= LATE:
                return expected
            self.counters.lost += gap
        return NEXT[sequence]

    def _doubt(self, data: bytes, mirrored: bytes, i: int, following: int) -> int:
        """Where to go on from a whole frame whose CRC is bad or cannot be checked; `i` itself: wait for more data.

        `following` is where the next frame starts if its length is right.
        The length in a bad frame may be wrong, so a good frame inside it wins. Else both kinds are skipped whole if
        a frame can start behind them; if they end the data while something inside may yet become a frame, more is
        awaited. Else the step is lost.
        """
        _, _, sequence, source, wire_id = FORMATS[data[i]].unpack(data, i)
        message_id = wire_id if isinstance(wire_id, int) else int.from_bytes(wire_id, "little")
        bad = message_id in CRC_EXTRA
        at_end = following >= len(data)
        inside, open_inside = self._find(data, mirrored, i + 1, following) if bad or at_end else (-1, -1)
        if bad and inside >= 0:
            count(self.counters.bad_crc, message_id)
            self.counters.garbage_bytes += inside - i
            return inside
        if at_end and (inside >= 0 or open_inside >= 0):
            return i
        if at_end or data[following] in (V1, V2):
            count(self.counters.bad_crc if bad else self.counters.unknown, message_id)
            # its header may be wrong: believed only if it fits, for it must not add to the lost frames
            if self._expected.get(source) == sequence:
                self._expected[source] = NEXT[sequence]
            return following
        if bad:
            count(self.counters.bad_crc, message_id)
        return self._hunt(data, mirrored, i)

    def _hunt(self, data: bytes, mirrored: bytes, i: int) -> int:
        """Where the next good frame starts, in step again; else from where on the data may become one, out of step."""
        found, open_ = self._find(data, mirrored, i, len(data))
        self._in_step = found >= 0
        stop = found if found >= 0 else open_ if open_ >= 0 else len(data)
        self.counters.garbage_bytes += stop - i
        return stop

    def _find(self, data: bytes, mirrored: bytes, start: int, stop: int) -> tuple[int, int]:
        """The first start of a good frame in a range, and before it the first that more data may make one; -1: none."""
        open_ = -1
        while match := MAGIC.search(data, start, stop):
            at = match.start()
            verdict = self._judge(data, mirrored, at)
            if verdict == VALID:
                return at, open_
            if verdict == OPEN and open_ < 0:
                open_ = at
            start = at + 1
        return -1, open_

    def _judge(self, data: bytes, mirrored: bytes, i: int) -> int:
        """VALID: a whole frame of a known id with a good CRC. OPEN: the data ends before that is certain."""
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
        crc = crc_hqx(mirrored[i:end], seed) ^ effect
        return VALID if crc == BACK[mirrored[end + 1]] ^ mirrored[end] else WRONG


def _unchecked(data: bytes, i: int, following: int) -> Frame:
    """A frame of an unknown id, as its header says it is."""
    raw = data[i:following]
    if raw[0] == V2:
        return Frame(int.from_bytes(raw[7:10], "little"), (raw[5], raw[6]), raw[4], None, raw)
    return Frame(raw[5], (raw[3], raw[4]), raw[2], None, raw)
