"""A client of simple_message, as ROS-Industrial's node `robot_state` is one. It knows the protocol and nothing else:

int32 each: length of the rest, message type, communication type, reply code, then the body
STATUS is type 13: drives_powered, e_stopped, error_code, in_error, in_motion, mode, motion_possible
PING is type 1; a request has the communication type 2, its reply 3 and the reply code 1
"""

from __future__ import annotations

import socket
import struct
from typing import Any, NamedTuple

from ..deadline import SOON, Deadline, allow

TOPIC, REQUEST, REPLY = 1, 2, 3
PING, STATUS = 1, 13
LONGEST = 1000
LAST = 44
"""Bytes of a STATUS."""


class Status(NamedTuple):
    """The body of STATUS."""

    drives_powered: int
    e_stopped: int
    error_code: int
    in_error: int
    in_motion: int
    mode: int
    motion_possible: int


UNKNOWN = Status(-1, -1, 0, -1, -1, -1, -1)


class RobotState:
    """One connection."""

    def __init__(self, address: tuple[Any, ...], order: str = "<", receive_buffer: int | None = None) -> None:
        """`order` is that of `struct`; `receive_buffer` in bytes."""
        self.socket = socket.socket(socket.AF_INET6 if ":" in address[0] else socket.AF_INET)
        if receive_buffer is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(allow(SOON))
        self.socket.connect(address)
        self._order = order
        self.replies = 0
        """Pings that were answered."""
        self.read_at_once = 1 << 16
        """The most bytes of one read."""

    def status(self) -> Status:
        """The next status. Fails for a frame that is neither a status nor the reply to a ping."""
        while True:
            kind, communication, reply, *body = self._frame()
            if kind == STATUS:
                assert (communication, reply) == (TOPIC, 0)
                return Status(*body)
            assert (kind, communication, reply, body) == (PING, REPLY, 1, [])
            self.replies += 1

    def wait_for(self, **fields: int) -> Status:
        """The first status with these values."""
        while True:
            found = self.status()
            if fields.items() <= found._asdict().items():
                return found

    def send(self, data: bytes) -> None:
        """Send any bytes."""
        self.socket.sendall(data)

    def frame(self, kind: int, communication: int, *body: int) -> bytes:
        """Make a frame."""
        return struct.pack(f"{self._order}{4 + len(body)}i", 12 + 4 * len(body), kind, communication, 0, *body)

    def wait_for_end(self) -> bytes:
        """Read until the other end closes the connection. Returns the last frame."""
        data, deadline = b"", Deadline(SOON)
        while more := self.socket.recv(1 << 16):
            assert deadline.left, "the other end keeps the connection"
            data = (data + more)[-LAST:]
        return data

    def close(self) -> None:
        """Close the connection."""
        self.socket.close()

    def _frame(self) -> tuple[int, ...]:
        (length,) = struct.unpack(f"{self._order}i", self._exactly(4))
        assert 12 <= length <= LONGEST
        return struct.unpack(f"{self._order}{length // 4}i", self._exactly(length))

    def _exactly(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            more = self.socket.recv(min(self.read_at_once, count - len(data)))
            assert more, "the other end has closed the connection"
            data += more
        return data
