"""`Download`: reads one file of a vehicle over MAVLink FTP. A state machine of values and times, without a socket.

It opens the file, asks for what is missing until nothing is, and closes the session. An answer counts for the bytes it
brings, whatever request it answers: lost, late, repeated and reordered answers need no case of their own. Each request
without a new byte is a try; after TRIES of them it gives up.

A burst (BurstReadFile) cannot be slowed down by the receiver. So it is used only on a link that can carry a whole file
at once; there the next request waits until the bytes received fit the rate.

Source for a server's behaviour: `MavlinkFTP` of PX4. It has one session, repeats its last short answer for a repeated
sequence number, ignores the size of ReadFile, and forgets a session after 10 s.
"""

from __future__ import annotations

import math
import struct
from enum import Enum
from typing import Final, NamedTuple

from .payload import (
    ACK,
    BURST_READ_FILE,
    END_OF_FILE,
    INVALID_SESSION,
    MOST_DATA,
    NAK,
    NO_SESSIONS,
    OPCODES,
    OPEN_FILE_RO,
    READ_FILE,
    TERMINATE_SESSION,
    UNKNOWN_COMMAND,
    Payload,
)

PATIENCE: Final = 1.0  # s for an answer
TRIES: Final = 8
"""Requests without a new byte until it gives up."""
BUSY: Final = 12.0
"""Seconds until another try while another program uses the only session: each request keeps that alive for 10 s."""
BUSY_TRIES: Final = 4
CLOSING_TRIES: Final = 3
REOPENINGS: Final = 3
BURST_TRIES: Final = 2
"""Bursts without a new byte until ReadFile is used instead."""
BURST_RATE: Final = 10_000.0
"""Bursts are used on a link with at least this many bytes a second."""
APART: Final = 0.06
"""Seconds between two requests: together they stay below 500 bytes a second."""
OVERHEAD: Final = 27  # bytes of a frame besides its data: header and CRC, targets, header of the payload
MOST_DEBT: Final = 5.0
"""The most seconds by which the rate delays the next request: a flood must not delay it for ever."""
SLACK: Final = 60.0  # s that a download may take besides three times its share of the rate
MOST_GAPS: Final = 128
HALF: Final = 0x8000
"""Half of the sequence numbers: an answer is later than a request if its number is less than this ahead."""


class Failure(NamedTuple):
    """Why there is no file, in words."""

    reason: str


class _Phase(Enum):
    OPENING = 0
    READING = 1
    CLOSING = 2
    ENDED = 3


class Download:
    """One file. Call `due` for the next request and `heard` for each answer, until `ended`.

    `rate` is the most bytes a second, both ways together. `most` bounds the size of the file.
    """

    def __init__(self, path: str, *, rate: float, now: float, most: int, sequence: int = 0) -> None:
        self._path = path.encode()[:MOST_DATA]
        self._rate = rate
        self._most = most
        self.sequence = sequence
        """The last sequence number, sent or received."""
        self.outcome: bytes | Failure | None = None
        """The file, or why there is none. None: not known yet."""
        self._phase = _Phase.OPENING
        self._session = 0
        self._opened_with = sequence
        """The sequence number of the latest OpenFileRO: earlier answers belong to another file."""
        self._data = bytearray()
        self._missing: list[tuple[int, int]] = []
        """What is missing: the first byte, and the one after the last."""
        self._asked: Payload | None = None
        """The latest request. None: before the first one of a phase."""
        self._waits = False
        """Whether its answer is outstanding."""
        self._tries = 0
        self._left = math.inf
        """Bytes that were missing when the latest request was sent."""
        self._reopenings = 0
        self._bursts = rate >= BURST_RATE
        self._answer_by = self._free_at = self._busy_until = self._asked_at = now
        self._end = now + SLACK

    @property
    def ended(self) -> bool:
        """Whether the session is closed too, or given up."""
        return self._phase is _Phase.ENDED

    @property
    def progress(self) -> tuple[int, int]:
        """The bytes received so far, and the size of the file; 0 if it is not known yet."""
        return len(self._data) - self._lacking, len(self._data)

    @property
    def _lacking(self) -> int:
        return sum(stop - start for start, stop in self._missing)

    def next_due(self) -> float:
        """When `due` has something to do."""
        if self.ended:
            return math.inf
        due = max(self._answer_by, self._free_at) if self._waits else max(self._busy_until, self._free_at)
        return due if self._phase is _Phase.CLOSING else min(due, self._end)

    def due(self, now: float) -> Payload | None:
        """The request to send at `now`, if any."""
        if now < self.next_due():
            return None
        if now >= self._end and self._phase is not _Phase.CLOSING:
            self._fail(f"it takes longer than {SLACK:.0f} s and three times its share of the rate")
        self._count_try()
        if self.ended:
            return None
        request = self._request()
        if request is None:
            return None
        self._asked, self._waits, self._asked_at = request, True, now
        self._answer_by = now + PATIENCE
        self._spend(len(request.data), now)
        self._free_at = max(self._free_at, now + APART)
        return request

    def _count_try(self) -> None:
        """Before each request: give up after too many without a new byte."""
        lacking = self._lacking
        gained = self._phase is _Phase.READING and lacking < self._left
        self._tries = 1 if gained or self._asked is None else self._tries + 1
        self._left = lacking
        if self._phase is _Phase.CLOSING and self._tries > CLOSING_TRIES:
            self._phase = _Phase.ENDED
        elif self._tries > TRIES and self._phase is not _Phase.CLOSING:
            assert self._asked is not None
            self._fail(f"no answer to {OPCODES[self._asked.opcode]} after {TRIES} tries")
            self._tries = 1
        if self._asked is not None and self._asked.opcode == BURST_READ_FILE and self._tries > BURST_TRIES:
            self._bursts = False

    def _request(self) -> Payload | None:
        """The next request. OpenFileRO and TerminateSession keep their sequence number when they are repeated: the
        server then repeats its answer. A read is simply done again."""
        if self._phase is _Phase.OPENING:
            opcode, data, offset, size = OPEN_FILE_RO, self._path, 0, len(self._path)
        elif self._phase is _Phase.CLOSING:
            opcode, data, offset, size = TERMINATE_SESSION, b"", 0, 0
        elif self._missing:
            offset, stop = self._missing[0]
            burst = self._bursts and stop - offset > 2 * MOST_DATA
            opcode, data, size = BURST_READ_FILE if burst else READ_FILE, b"", min(stop - offset, MOST_DATA)
        else:
            return None
        if self._asked is not None and self._waits and self._phase is not _Phase.READING:
            return self._asked
        self.sequence = (self.sequence + 1) & 0xFFFF
        if opcode == OPEN_FILE_RO:
            self._opened_with = self.sequence
        return Payload(self.sequence, self._session, opcode, data, offset, size)

    # answers

    def heard(self, answer: Payload, now: float) -> None:
        """Process one answer of the server. An answer that does not belong to this file has no effect."""
        asked = self._asked
        ahead = (answer.sequence - self._opened_with) & 0xFFFF
        if self.ended or asked is None:
            return
        self._spend(answer.size, now)
        if answer.opcode not in (ACK, NAK) or not 0 < ahead < HALF:
            return
        if self._phase is not _Phase.OPENING and answer.session != self._session and answer.opcode == ACK:
            return
        if answer.opcode == ACK and self._phase is _Phase.READING and answer.req_opcode in (READ_FILE, BURST_READ_FILE):
            self._note_sequence(answer.sequence)
            self._take(answer, asked, now)
        elif answer.req_opcode == asked.opcode and self._answers(answer, asked):
            self._note_sequence(answer.sequence)
            if answer.opcode == NAK:
                self._refused(answer, asked, now)
            elif self._phase is _Phase.OPENING:
                self._opened(answer, now)
            elif self._phase is _Phase.CLOSING:
                self._phase = _Phase.ENDED

    def _answers(self, answer: Payload, asked: Payload) -> bool:
        """Whether an answer belongs to the latest request. A burst has many answers, with consecutive numbers."""
        ahead = (answer.sequence - asked.sequence) & 0xFFFF
        return ahead == 1 or (asked.opcode == BURST_READ_FILE and 0 < ahead < HALF)

    def _note_sequence(self, number: int) -> None:
        if (number - self.sequence) & 0xFFFF < HALF:
            self.sequence = number

    def _opened(self, answer: Payload, now: float) -> None:
        self._session = answer.session
        self._begin(_Phase.READING)
        (size,) = struct.unpack("<I", answer.data[:4].ljust(4, b"\0"))
        if not 0 < size <= self._most:
            self._fail(f"its size is {size} bytes, and the limits are 1 to {self._most}")
        elif size != len(self._data):  # otherwise the session was lost: what has arrived stays
            self._data = bytearray(size)
            self._missing = [(0, size)]
            self._end = now + SLACK + 3 * size / self._rate

    def _take(self, answer: Payload, asked: Payload, now: float) -> None:
        """Store the data of an answer. A byte that is there already stays."""
        start, stop = answer.offset, answer.offset + len(answer.data)
        missing = _without(self._missing, start, stop)
        if start < stop <= len(self._data) and missing != self._missing and len(missing) <= MOST_GAPS:
            for first, last in self._missing:
                low, high = max(first, start), min(last, stop)
                if low < high:
                    self._data[low:high] = answer.data[low - start : high - start]
            self._missing = missing
            self._answer_by = max(self._answer_by, now + PATIENCE)
        if not self._missing:
            self.outcome = bytes(self._data)
            self._begin(_Phase.CLOSING)
        elif asked.opcode == READ_FILE:
            self._waits = self._waits and self._missing[0][0] == asked.offset
        elif answer.burst_complete and self._answers(answer, asked):
            self._waits = False

    def _refused(self, answer: Payload, asked: Payload, now: float) -> None:
        """Process a NAK."""
        if self._phase is _Phase.CLOSING:
            self._phase = _Phase.ENDED
        elif answer.code == NO_SESSIONS and self._phase is _Phase.OPENING and self._tries < BUSY_TRIES:
            self._waits, self._busy_until = False, now + BUSY
        elif answer.code == INVALID_SESSION and self._phase is _Phase.READING and self._reopenings < REOPENINGS:
            self._reopenings += 1
            self._begin(_Phase.OPENING)
        elif asked.opcode == BURST_READ_FILE and answer.code in (END_OF_FILE, UNKNOWN_COMMAND):
            self._bursts = self._bursts and answer.code == END_OF_FILE
            self._waits = False
        elif answer.code == END_OF_FILE and self._phase is _Phase.READING:
            self._fail(f"it ends at byte {asked.offset} of {len(self._data)}")
        else:
            self._fail(f"{OPCODES[asked.opcode]} was refused: {answer.error}")

    def _begin(self, phase: _Phase) -> None:
        self._phase, self._asked, self._waits = phase, None, False

    def _fail(self, reason: str) -> None:
        """Give up. An open session is closed."""
        self.outcome = Failure(reason)
        self._begin(_Phase.ENDED if self._phase is _Phase.OPENING else _Phase.CLOSING)

    def _spend(self, data: int, now: float) -> None:
        """Data went over the link: the next request waits until it fits the rate."""
        after = max(self._free_at, now) + (OVERHEAD + data) / self._rate
        self._free_at = min(after, self._asked_at + MOST_DEBT)


def _without(gaps: list[tuple[int, int]], start: int, stop: int) -> list[tuple[int, int]]:
    """What is left of the gaps without the bytes from `start` up to `stop` (excluded)."""
    left = []
    for first, last in gaps:
        if first < min(start, last):
            left.append((first, min(start, last)))
        if max(stop, first) < last:
            left.append((max(stop, first), last))
    return left
