"""The requests that clients of simple_message send, and their replies. No I/O."""

from __future__ import annotations

import re
import struct

from ...simple_message import (
    EMPTY_JOINT,
    HEADER,
    LONGEST_LENGTH,
    ORDERS,
    PING,
    SERVICE_REPLY,
    SERVICE_REQUEST,
    SHORTEST,
    SUCCESS,
)


class RequestReader:
    """Finds the pings in the bytes of one client, and makes their replies.

    It holds less than a header. Every other message is skipped. After a length that no message has it searches for the
    next ping.
    """

    def __init__(self, byte_order: str) -> None:
        """`byte_order` is a key of ORDERS."""
        self._header = struct.Struct(f"{ORDERS[byte_order]}4i")
        self._ping = _pattern(byte_order)
        self._held = b""
        self._skip = 0
        """Bytes of the present message that are still to come."""
        self._searching = False

    @property
    def pending(self) -> int:
        """Bytes that are held."""
        return len(self._held)

    def feed(self, data: bytes) -> bytes:
        """The replies to the pings that end in `data`."""
        data, replies, at = self._held + data, [], 0
        while True:
            skipped = min(self._skip, len(data) - at)
            at, self._skip = at + skipped, self._skip - skipped
            if self._searching:
                at = self._search(data, at)
            if len(data) - at < SHORTEST:
                break
            length, kind, communication, _ = self._header.unpack_from(data, at)
            if not HEADER <= length <= LONGEST_LENGTH:
                at, self._searching = at + 1, True
                continue
            at, self._skip = at + SHORTEST, length - HEADER
            if length == HEADER and communication == SERVICE_REQUEST and kind in (PING, EMPTY_JOINT):
                replies.append(self._header.pack(HEADER, kind, SERVICE_REPLY, SUCCESS))
        self._held = data[at:]
        return b"".join(replies)

    def _search(self, data: bytes, at: int) -> int:
        """Where the next ping begins, or where it may begin once more bytes arrive."""
        found = self._ping.search(data, at)
        self._searching = found is None
        return max(at, len(data) - HEADER + 1) if found is None else found.start()


def _pattern(byte_order: str) -> re.Pattern[bytes]:
    """The bytes of a ping without its REPLY_CODE, which has no meaning in a request."""
    order = ORDERS[byte_order]
    starts = (struct.pack(f"{order}3i", HEADER, kind, SERVICE_REQUEST) for kind in (PING, EMPTY_JOINT))
    return re.compile(b"|".join(map(re.escape, starts)))
