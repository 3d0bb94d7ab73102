"""MAVLink on the wire: the headers of both versions, the CRC, and for which ids it can be checked.

The format: https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

import re
from binascii import crc_hqx
from functools import lru_cache
from struct import Struct
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from .decode import READERS
from .definitions import CRC_EXTRA

if TYPE_CHECKING:
    from collections.abc import Callable

    from .decode import Reader

MAX_FRAME: Final = 280
"""Bytes of the longest frame: header 10, payload 255, CRC 2, signature 13."""
V1, V2 = 0xFE, 0xFD
SIGNED = 0x01  # MAVLINK_IFLAG_SIGNED, the only incompatibility flag there is
_IDS_V1 = b"".join(re.escape(bytes((message_id,))) for message_id in CRC_EXTRA if message_id < 256)
_HIGH_V2 = b"".join(re.escape(bytes((high,))) for high in {message_id >> 16 for message_id in CRC_EXTRA})
MAGIC = re.compile(b"\xfe(?=.{4}[%b]|.{0,4}\\Z)|\xfd(?=.{8}[%b]|.{0,8}\\Z)" % (_IDS_V1, _HIGH_V2), re.DOTALL)
"""Where a frame of a known id may start, as far as the bytes behind it tell."""

# MAVLink's CRC-16/MCRF4XX is the standard library's crc_hqx on bytes whose bits are mirrored.
MIRROR: Final = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_STEPS: Final = {step & 255: high << 8 | step >> 8 for high in range(256) for step in (crc_hqx(bytes((high,)), 0),)}
BACK: Final = tuple(_STEPS[low] for low in range(256))
"""Undoes the last byte of a CRC, which is CRC_EXTRA and does not stand in the frame: looking up two bytes is quicker
than adding that one. `before(extra) == BACK[crc & 255] ^ crc >> 8 ^ extra << 8`."""


class Format(NamedTuple):
    """How the frames of one version of MAVLink are read."""

    magic: int
    unpack: Callable[[bytes, int], tuple[Any, ...]]
    """The header: length, incompatibility flags (version 1 has none: b""), sequence, system and component, id."""
    header: int
    """Bytes of it."""
    seed: int
    """Where the CRC starts, so that it is 0xFFFF behind the magic byte, which it does not span."""


def _format(magic: int, header: str) -> Format:
    layout = Struct(header)
    return Format(magic, layout.unpack_from, layout.size, BACK[0xFF] ^ 0xFF ^ MIRROR[magic] << 8)


FORMATS: Final = {V2: _format(V2, "<xBBxBH3s"), V1: _format(V1, "<xB0sBHB")}

Known = tuple[int, "tuple[int, Reader | None] | None"]
"""What CRC_EXTRA does to a CRC, and for a wanted message its id and how it is read."""
UNKNOWN: Final[Known] = -1, None
"""An id that cannot be checked: no CRC is negative, so that none is good."""


@lru_cache(maxsize=8)
def known_ids(wanted: frozenset[int]) -> dict[int, Any]:
    """All ids whose CRC_EXTRA is known; by the magic byte, then by the id as it stands in the frame."""
    known_v1 = [UNKNOWN] * 256
    known_v2 = {}
    for message_id, crc_extra in CRC_EXTRA.items():
        reads = (message_id, READERS.get(message_id)) if message_id in wanted else None
        entry = MIRROR[crc_extra] << 8, reads
        known_v2[message_id.to_bytes(3, "little")] = entry
        if message_id < len(known_v1):
            known_v1[message_id] = entry
    return {V1: known_v1, V2: known_v2}
