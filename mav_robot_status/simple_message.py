"""The frames of ROS-Industrial's simple_message, for both ends. No I/O.

A frame is a prefix, a header of three numbers and a body: LENGTH (of header and body), MSG_TYPE, COMM_TYPE, REPLY_CODE.
All numbers are int32. Which byte order they have is not in the frame: both ends must agree.

Sources: the package `simple_message` of ROS-Industrial's industrial_core, and REP-I0004, which assigns the types.
"""

from __future__ import annotations

import struct
from operator import attrgetter
from typing import TYPE_CHECKING, Final, NamedTuple

from .errors import ProtocolError

if TYPE_CHECKING:
    from .interface import RobotStatus

ORDERS: Final = {"little": "<", "big": ">"}
PREFIX: Final = 4
HEADER: Final = 12
SHORTEST: Final = PREFIX + HEADER
LONGEST_LENGTH: Final = 4096
"""A longer frame is taken for garbage. The longest message of the standard, a trajectory point, has under 1 kB."""
STATE_PORT: Final = 11002
"""StandardSocketPorts::STATE of ROS-Industrial: where its node `robot_state` connects."""

PING: Final = 1
STATUS: Final = 13
EMPTY_JOINT: Final = 10
"""JOINT_POSITION, deprecated. Without positions it commands nothing and only asks whether somebody answers: a ping."""
TOPIC, SERVICE_REQUEST, SERVICE_REPLY = 1, 2, 3
INVALID, SUCCESS = 0, 1

FIELDS: Final = (
    "drives_powered",
    "e_stopped",
    "error_code",
    "in_error",
    "in_motion",
    "mode",
    "motion_possible",
)
"""The body of STATUS, in the order of `RobotStatus::load` in robot_status.cpp. The numbers are those of our fields."""
_BODY: Final = attrgetter(*FIELDS)
_NUMBERS: Final = 4 + len(FIELDS)
STATUS_LENGTH: Final = 4 * _NUMBERS - PREFIX


class StatusFrame(NamedTuple):
    """The body of a STATUS as received: any int32."""

    drives_powered: int
    e_stopped: int
    error_code: int
    in_error: int
    in_motion: int
    mode: int
    motion_possible: int


assert StatusFrame._fields == FIELDS


class StatusEncoder:
    """Makes a STATUS frame of a status."""

    def __init__(self, byte_order: str) -> None:
        """`byte_order` is a key of ORDERS."""
        self._layout = struct.Struct(f"{ORDERS[byte_order]}{_NUMBERS}i")

    def encode(self, status: RobotStatus) -> bytes:
        """The 44 bytes."""
        return self._layout.pack(STATUS_LENGTH, STATUS, TOPIC, INVALID, *_BODY(status))


class StatusReader:
    """Finds the STATUS frames in the bytes of one connection. Other messages are skipped."""

    def __init__(self, byte_order: str) -> None:
        """`byte_order` is a key of ORDERS."""
        self._header = struct.Struct(f"{ORDERS[byte_order]}3i")
        self._body = struct.Struct(f"{ORDERS[byte_order]}{len(FIELDS)}i")
        self._other = next(order for order in ORDERS if order != byte_order)
        self._rest = b""

    def feed(self, data: bytes) -> list[StatusFrame]:
        """The statuses that end in `data`. Raises ProtocolError."""
        buffer, at, found = self._rest + data, 0, []
        while len(buffer) - at >= self._header.size:
            length, kind, communication = self._header.unpack_from(buffer, at)
            if not HEADER <= length <= LONGEST_LENGTH:
                raise ProtocolError(self._garbage(buffer[at : at + HEADER]))
            if len(buffer) - at < PREFIX + length:
                break
            if kind == STATUS and communication == TOPIC:
                if length != STATUS_LENGTH:
                    raise ProtocolError(f"a STATUS has the length {length} instead of {STATUS_LENGTH}")
                found.append(StatusFrame(*self._body.unpack_from(buffer, at + SHORTEST)))
            at += PREFIX + length
        self._rest = buffer[at:]  # less than one frame
        return found

    def _garbage(self, head: bytes) -> str:
        length = struct.unpack_from(f"{ORDERS[self._other]}i", head)[0]
        if HEADER <= length <= LONGEST_LENGTH:
            return f"the byte order is {self._other}, not as configured"
        return f"this is not simple_message; it begins with {head.hex(' ')}"
