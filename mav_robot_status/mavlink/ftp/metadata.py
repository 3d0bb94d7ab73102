"""PX4's component metadata: where the table of its events is.

COMPONENT_METADATA names the general file. Its entry of type COMP_METADATA_TYPE_EVENTS names the table. Source: the
component metadata protocol, https://mavlink.io/en/services/component_information.html; `generate_component_general.py`
of PX4. The input comes from a vehicle: everything is bounded, and an error is a `Failure`.
"""

from __future__ import annotations

import json
import re
import zlib
from typing import Final, NamedTuple

from .download import Failure

EVENTS: Final = 4  # COMP_METADATA_TYPE_EVENTS
MOST_GENERAL: Final = 16 * 1024
"""The most bytes of a general file. PX4's has about 500."""
MOST_GENERAL_TEXT: Final = 64 * 1024
"""The same unpacked."""
MOST_TABLE: Final = 1024 * 1024
"""The most bytes of a table. PX4's has about 17,000."""
MOST_MEMORY: Final = 80 * 1024 * 1024
"""Bytes of memory for unpacking xz. PX4 packs with preset 9, which names a dictionary of 64 MB."""
XZ: Final = b"\xfd7zXZ\0"
_MFTP: Final = re.compile(r"mftp://(?:\[;comp=(\d{1,3})\])?([\x21-\x7e]{1,200})")
_HTTP: Final = re.compile(r"https?://[\x21-\x7e]{1,300}")


class Place(NamedTuple):
    """A file on a vehicle."""

    path: str
    component: int | None = None
    """The component that has it. None: the one that named it."""
    crc: int | None = None
    """MAVLink's CRC-32 of the file. None: not known."""


def crc32(data: bytes) -> int:
    """MAVLink's CRC-32: the polynomial of zlib, but it starts with 0 and is not inverted at the end."""
    return zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF


def place(uri: str, crc: int | None = None) -> Place | Failure:
    """The file that a URI names. An address of the internet is not followed."""
    found = _MFTP.fullmatch(uri)
    if found is not None:
        return Place(found[2], None if found[1] is None else int(found[1]), crc)
    if _HTTP.fullmatch(uri):
        return Failure(f"it is not on the vehicle but at {uri}, which is not followed")
    return Failure(f"its address {uri[:100]!r} is not one of MAVLink FTP")


def table_place(general: bytes) -> Place | Failure:
    """The file of the table of events that a general file names."""
    try:
        text = unpacked(general, MOST_GENERAL_TEXT)
        entries = json.loads(text)["metadataTypes"]
        entry = next((one for one in entries if one["type"] == EVENTS), None)
        if entry is None:
            return Failure("the vehicle offers no table of its events")
        addresses = [str(entry[name]) for name in ("uri", "uriFallback") if entry.get(name)]
        crc = _number(entry.get("fileCrc"))
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError):
        return Failure("the general file of its metadata cannot be read")
    places = [place(address, crc) for address in addresses]
    on_vehicle = (one for one in places if isinstance(one, Place))
    return next(on_vehicle, places[0] if places else Failure("the table of its events has no address"))


def _number(value: object) -> int | None:
    return value if isinstance(value, int) and 0 < value <= 0xFFFFFFFF else None


def unpacked(data: bytes, most: int) -> bytes:
    """The data of a file that may be xz. Raises ValueError if it is damaged or longer than `most`."""
    if not data.startswith(XZ):
        return data
    import lzma  # most vehicles have no table

    unpacker = lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=MOST_MEMORY)
    try:
        text = unpacker.decompress(data, most)
    except (lzma.LZMAError, MemoryError) as error:
        raise ValueError(f"xz: {error}") from None
    if not unpacker.eof:
        raise ValueError(f"xz: incomplete, or longer than {most} bytes")
    return text


def has_crc(data: bytes, crc: int | None, most: int) -> bool:
    """Whether a file has this CRC, as it is or unpacked: PX4's builds have used both."""
    if crc is None or crc32(data) == crc:
        return True
    try:
        return crc32(unpacked(data, most)) == crc
    except ValueError:
        return False
