"""CDR, the encoding of ROS 2 messages: XCDR1, little-endian.

Source: OMG DDS-XTYPES 1.3, 7.4.1 and 7.6.3.1.2. Each number is aligned to its own size, counted from the end of the
header. A string has its length with the final NUL, then its bytes and the NUL. A sequence has its count, then items.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable

HEADER: Final = b"\x00\x01\x00\x00"
"""CDR_LE (0x0001), then two bytes of options."""


class Encoder:
    """Appends values in the order of the message's fields. struct.error for a number that does not fit."""

    def __init__(self) -> None:
        self._data = bytearray()

    def payload(self) -> bytes:
        """The header and all values."""
        return HEADER + bytes(self._data)

    def octet(self, value: int) -> None:
        """A byte, 0 to 255."""
        self._data += struct.pack("<B", value)

    def int8(self, value: int) -> None:
        """One byte with a sign."""
        self._data += struct.pack("<b", value)

    def int32(self, value: int) -> None:
        """Four bytes with a sign."""
        self._align(4)
        self._data += struct.pack("<i", value)

    def uint32(self, value: int) -> None:
        """Four bytes without a sign."""
        self._align(4)
        self._data += struct.pack("<I", value)

    def string(self, value: str) -> None:
        """UTF-8. A NUL would end the text for a reader in C, so it becomes a question mark, as do lone surrogates."""
        data = value.encode("utf-8", "replace").replace(b"\0", b"?") + b"\0"
        self.uint32(len(data))
        self._data += data

    def int32_sequence(self, values: Iterable[int]) -> None:
        """A count, and numbers with a sign."""
        items = tuple(values)
        self.uint32(len(items))
        self._data += struct.pack(f"<{len(items)}i", *items)

    def octet_sequence(self, values: Iterable[int]) -> None:
        """A count, and bytes."""
        items = bytes(values)
        self.uint32(len(items))
        self._data += items

    def _align(self, size: int) -> None:
        self._data += bytes(-len(self._data) % size)
