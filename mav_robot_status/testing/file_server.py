"""The file server of the fake PX4: MAVLink FTP, read-only. It has no socket and no clock.

It behaves as `MavlinkFTP` of PX4: one session, which ends after 10 s; a repeated request gets the last short answer
again; ReadFile and BurstReadFile ignore the requested size.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

from ..mavlink.ftp.payload import (
    ACK,
    BURST_READ_FILE,
    END_OF_FILE,
    FILE_NOT_FOUND,
    INVALID_DATA_SIZE,
    INVALID_SESSION,
    MOST_DATA,
    NAK,
    NO_SESSIONS,
    OPEN_FILE_RO,
    READ_FILE,
    RESET_SESSIONS,
    TERMINATE_SESSION,
    UNKNOWN_COMMAND,
    Payload,
    unpack,
)

SESSION_ENDS = 10.0  # s without a request
BURST = 35_000
"""Bytes of one burst."""
SHORT = 4
"""An answer with at most so many bytes is kept, to be repeated."""


class FileServer:
    """Serves the files of one vehicle, by their path. Without `bursts` it knows no BurstReadFile."""

    def __init__(self, files: Mapping[str, bytes], *, bursts: bool = True) -> None:
        self._files = files
        self._file: bytes | None = None
        """The file of the open session, whose number is 0."""
        self._used_at = 0.0
        self._last: Payload | None = None
        """The last answer, if it was short."""
        self._answers: dict[int, Callable[[Payload], list[Payload]]] = {
            OPEN_FILE_RO: self._open,
            READ_FILE: self._read,
            TERMINATE_SESSION: self._terminate,
            RESET_SESSIONS: self._reset,
        }
        if bursts:
            self._answers[BURST_READ_FILE] = self._burst

    def answer(self, field: bytes, now: float) -> list[bytes]:
        """The answers to one request, which is the payload of the message."""
        request = unpack(field)
        if request is None:
            return [_nak(Payload(*struct.unpack_from("<HBB", field)), INVALID_DATA_SIZE).pack()]
        if self._last is not None and self._last.sequence == request.sequence + 1:
            return [self._last.pack()]
        if now - self._used_at > SESSION_ENDS:
            self._file = None
        self._used_at = now
        known = self._answers.get(request.opcode)
        answers = [_nak(request, UNKNOWN_COMMAND)] if known is None else known(request)
        self._last = answers[-1] if answers[-1].size <= SHORT else None
        return [answer.pack() for answer in answers]

    def _open(self, asked: Payload) -> list[Payload]:
        data = self._files.get(asked.data.split(b"\0")[0].decode("ascii", "replace"))
        if self._file is not None:
            return [_nak(asked, NO_SESSIONS)]
        if data is None:
            return [_nak(asked, FILE_NOT_FOUND)]
        self._file = data
        return [_ack(asked, struct.pack("<I", len(data)))]

    def _read(self, asked: Payload) -> list[Payload]:
        if self._file is None or asked.session != 0:
            return [_nak(asked, INVALID_SESSION)]
        if asked.offset >= len(self._file):
            return [_nak(asked, END_OF_FILE)]
        return [_ack(asked, self._file[asked.offset : asked.offset + MOST_DATA])]

    def _burst(self, asked: Payload) -> list[Payload]:
        if self._file is None or asked.session != 0:
            return [_nak(asked, INVALID_SESSION)]
        end = min(len(self._file), asked.offset + BURST)
        answers = []
        for number, offset in enumerate(range(asked.offset, end, MOST_DATA)):
            part = asked._replace(sequence=asked.sequence + number & 0xFFFF, offset=offset)
            answers.append(_ack(part, self._file[offset : min(offset + MOST_DATA, end)]))
        if end == len(self._file):
            answers.append(_nak(asked._replace(sequence=asked.sequence + len(answers) & 0xFFFF), END_OF_FILE))
        answers[-1] = answers[-1]._replace(burst_complete=1)
        return answers

    def _terminate(self, asked: Payload) -> list[Payload]:
        if self._file is None or asked.session != 0:
            return [_nak(asked, INVALID_SESSION)]
        self._file = None
        return [_ack(asked)]

    def _reset(self, asked: Payload) -> list[Payload]:
        self._file = None
        return [_ack(asked)]


def _ack(asked: Payload, data: bytes = b"") -> Payload:
    number = asked.sequence + 1 & 0xFFFF
    return Payload(number, asked.session, ACK, data, asked.offset, len(data), req_opcode=asked.opcode)


def _nak(asked: Payload, error: int) -> Payload:
    number = asked.sequence + 1 & 0xFFFF
    return Payload(number, asked.session, NAK, bytes((error,)), asked.offset, 1, req_opcode=asked.opcode)
