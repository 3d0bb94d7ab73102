"""The payload of FILE_TRANSFER_PROTOCOL: requests and answers."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Final, NamedTuple

from ..definitions import FileTransferProtocol

HEADER: Final = struct.Struct("<HBBBBBxI")
PAYLOAD: Final = 251
"""Bytes of the field."""
MOST_DATA: Final = PAYLOAD - HEADER.size
"""The most data of one message."""

TERMINATE_SESSION, OPEN_FILE_RO, READ_FILE, BURST_READ_FILE = 1, 4, 5, 15
RESET_SESSIONS: Final = 2
ACK, NAK = 128, 129
FAIL_ERRNO, INVALID_DATA_SIZE, INVALID_SESSION, NO_SESSIONS, END_OF_FILE, UNKNOWN_COMMAND = 2, 3, 4, 5, 6, 7
FILE_NOT_FOUND: Final = 10
ERRORS: Final[Mapping[int, str]] = {
    0: "None",
    1: "Fail",
    FAIL_ERRNO: "FailErrno",
    INVALID_DATA_SIZE: "InvalidDataSize",
    INVALID_SESSION: "InvalidSession",
    NO_SESSIONS: "NoSessionsAvailable",
    END_OF_FILE: "EOF",
    UNKNOWN_COMMAND: "UnknownCommand",
    8: "FileExists",
    9: "FileProtected",
    FILE_NOT_FOUND: "FileNotFound",
}
"""The error codes of a NAK, with the names of MAV_FTP_ERR."""
OPCODES: Final[Mapping[int, str]] = {
    TERMINATE_SESSION: "TerminateSession",
    OPEN_FILE_RO: "OpenFileRO",
    READ_FILE: "ReadFile",
    BURST_READ_FILE: "BurstReadFile",
}


class Payload(NamedTuple):
    """One request, or one answer."""

    sequence: int
    session: int
    opcode: int
    data: bytes = b""
    offset: int = 0
    size: int = 0
    """Bytes of data, or the number of bytes that a request asks for."""
    req_opcode: int = 0
    """In an answer: the opcode of the request."""
    burst_complete: int = 0

    def pack(self) -> bytes:
        """The bytes of the field. MAVLink 2 removes trailing zeros."""
        header = HEADER.pack(
            self.sequence, self.session, self.opcode, self.size, self.req_opcode, self.burst_complete, self.offset
        )
        return (header + self.data).ljust(PAYLOAD, b"\0")

    @property
    def error(self) -> str:
        """The error of a NAK in words."""
        code = self.data[0] if self.data else 0
        name = ERRORS.get(code, f"error {code}")
        return f"{name} (errno {self.data[1]})" if code == FAIL_ERRNO and len(self.data) > 1 else name

    @property
    def code(self) -> int:
        """The error code of a NAK; 0 if it has none."""
        return self.data[0] if self.data else 0


def unpack(field: bytes) -> Payload | None:
    """The payload in a field of 251 bytes. None if its size is impossible."""
    sequence, session, opcode, size, req_opcode, burst_complete, offset = HEADER.unpack_from(field)
    if size > MOST_DATA:
        return None
    data = field[HEADER.size : HEADER.size + size]
    return Payload(sequence, session, opcode, data, offset, size, req_opcode, burst_complete)


def message(payload: Payload, system: int, component: int) -> FileTransferProtocol:
    """The message that carries a payload to this system and component."""
    return FileTransferProtocol(0, system, component, payload.pack())
