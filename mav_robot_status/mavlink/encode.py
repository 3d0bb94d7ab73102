"""Messages in, frames out: the counterpart of `framing`."""

from __future__ import annotations

import struct
from binascii import crc_hqx
from collections.abc import Callable
from typing import Final, NamedTuple

from .definitions import CRC_EXTRA, MESSAGES
from .wire import REVERSED, V1, V2

HEADER_V1: Final = struct.Struct("<BBBBBB").pack
HEADER_V2: Final = struct.Struct("<BBBBBBBHB").pack
CHECKSUM: Final = struct.Struct(">H").pack

# class of the message -> its id, the size of its payload, the function that packs its fields
LAYOUTS: Final[dict[type, tuple[int, int, Callable[..., bytes]]]] = {
    d.type: (d.id, d.size, d.layout.pack) for d in MESSAGES.values()
}


def encode(message: NamedTuple, *, system: int, component: int, sequence: int, version: int = 2) -> bytes:
    """The unsigned frame of one message of `definitions`; `sequence` is 0 to 255, `version` 1 or 2.

    MAVLink 2 removes trailing zeros of the payload but keeps one byte. MAVLink 1 has the whole payload with its
    extension fields, as pymavlink writes it. Arrays are truncated or filled with zeros.

    Raises ValueError for a class that is not a message, a value that does not fit its field or the header, and an id
    over 255 in MAVLink 1.
    """
    try:
        message_id, size, pack = LAYOUTS[type(message)]
        payload = pack(*message)
        payload = payload.rstrip(b"\0") or b"\0" if version == 2 else payload.ljust(size, b"\0")
        return enclose(message_id, payload, system=system, component=component, sequence=sequence, version=version)
    except KeyError:
        raise ValueError(f"{type(message).__name__} is not a message of mavlink.definitions") from None
    except (struct.error, OverflowError, TypeError) as error:
        where = f"system {system}, component {component}, sequence {sequence}, MAVLink {version}"
        raise ValueError(f"{message} ({where}) does not fit its frame: {error}") from None


def enclose(message_id: int, payload: bytes, *, system: int, component: int, sequence: int, version: int = 2) -> bytes:
    """The unsigned frame of a payload, which is not changed; the id is one of CRC_EXTRA.

    Raises struct.error if a value does not fit.
    """
    if version == 2:
        id_low, id_high = message_id & 0xFFFF, message_id >> 16
        frame = HEADER_V2(V2, len(payload), 0, 0, sequence, system, component, id_low, id_high) + payload
    else:
        frame = HEADER_V1(V1, len(payload), sequence, system, component, message_id) + payload
    return with_crc(frame, REVERSED[CRC_EXTRA[message_id] : CRC_EXTRA[message_id] + 1])


def with_crc(frame: bytes, crc_extra: bytes) -> bytes:
    """Append the CRC to a frame that ends with its payload; `crc_extra` is one byte with reversed bits."""
    crc = crc_hqx(crc_extra, crc_hqx(frame[1:].translate(REVERSED), 0xFFFF))
    return frame + CHECKSUM(crc).translate(REVERSED)


class Encoder:
    """Frames of one source with consecutive sequence numbers. Each channel needs its own encoder."""

    __slots__ = ("component", "sequence", "system")

    def __init__(self, system: int, component: int) -> None:
        self.system = system
        self.component = component
        self.sequence = 0
        """The sequence number of the next frame."""

    def frame(self, message: NamedTuple) -> bytes:
        """The next frame, in MAVLink 2. Raises ValueError as `encode` does; then the sequence number is not used."""
        frame = encode(message, system=self.system, component=self.component, sequence=self.sequence)
        self.sequence = (self.sequence + 1) & 255
        return frame
