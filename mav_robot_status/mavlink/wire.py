"""MAVLink on the wire: the headers of both versions, the CRC, and the ids for which the CRC can be checked.

The format: https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

import re
from binascii import crc_hqx
from collections.abc import Callable
from functools import lru_cache
from struct import Struct
from typing import Any, Final, NamedTuple

from .decode import READERS, Reader
from .definitions import CRC_EXTRA

MAX_FRAME: Final = 280
"""Bytes of the longest frame: header 10, payload 255, CRC 2, signature 13."""
V1, V2 = 0xFE, 0xFD
SIGNED = 0x01  # MAVLINK_IFLAG_SIGNED, the only incompatibility flag that MAVLink defines
_IDS_V1 = b"".join(re.escape(bytes((message_id,))) for message_id in CRC_EXTRA if message_id < 256)
_HIGH_V2 = b"".join(re.escape(bytes((high,))) for high in {message_id >> 16 for message_id in CRC_EXTRA})
MAGIC = re.compile(b"\xfe(?=.{4}[%b]|.{0,4}\\Z)|\xfd(?=.{8}[%b]|.{0,8}\\Z)" % (_IDS_V1, _HIGH_V2), re.DOTALL)
"""Matches where a frame of a known id may start."""

# MAVLink's CRC-16/MCRF4XX is crc_hqx of the standard library on bytes with reversed bits.
REVERSED: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_STEPS: Final = {step & 255: high << 8 | step >> 8 for high in range(256) for step in (crc_hqx(bytes((high,)), 0),)}
UNDO: Final = tuple(_STEPS[low] for low in range(256))
"""Undoes the last byte of a CRC. That byte is CRC_EXTRA, which is not in the frame; two lookups are faster than adding
it. `before(extra) == UNDO[crc & 255] ^ crc >> 8 ^ extra << 8`."""


class Format(NamedTuple):
    """The frame format of one version of MAVLink."""

    magic: int
    unpack: Callable[[bytes, int], tuple[Any, ...]]
    """The header: length, incompatibility flags (version 1 has none: b""), sequence, system and component, id."""
    header: int
    """Bytes of the header."""
    seed: int
    """The start value of the CRC that gives 0xFFFF after the magic byte: the CRC does not cover that byte."""


def _format(magic: int, header: str) -> Format:
    layout = Struct(header)
    return Format(magic, layout.unpack_from, layout.size, UNDO[0xFF] ^ 0xFF ^ REVERSED[magic] << 8)


FORMATS: Final = {V2: _format(V2, "<xBBxBH3s"), V1: _format(V1, "<xB0sBHB")}

Known = tuple[int, int, "Reader | None"]
"""The effect of CRC_EXTRA on a CRC, the message id, and the reader of a wanted message."""
UNKNOWN: Final[Known] = -1, -1, None
"""An id that cannot be checked: the effect is negative, so no CRC is valid."""


@lru_cache(maxsize=8)
def known_ids(wanted: frozenset[int]) -> dict[int, dict[Any, Known]]:
    """All ids with a known CRC_EXTRA, by the magic byte and then by the bytes of the id in the frame."""
    known_v1: dict[Any, Known] = {}
    known_v2: dict[Any, Known] = {}
    for message_id, crc_extra in CRC_EXTRA.items():
        entry = REVERSED[crc_extra] << 8, message_id, READERS.get(message_id) if message_id in wanted else None
        known_v2[message_id.to_bytes(3, "little")] = entry
        if message_id < 256:
            known_v1[message_id] = entry
    return {V1: known_v1, V2: known_v2}
