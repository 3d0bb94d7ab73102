"""Encodes and decodes the fake autopilot's messages: through pymavlink where it defines them."""

from __future__ import annotations

from typing import Any, Final

from pymavlink.dialects.v20 import all as dialect

from ..mavlink import encode as own
from ..mavlink.decode import text
from ..mavlink.definitions import MESSAGES
from ..mavlink.framing import Frame, Parser

TEXTS: Final = frozenset({"uri"})
"""The fields of `OtherMessage` that are arrays of characters."""


class OtherMessage(dialect.MAVLink_message):  # type: ignore[misc]  # pymavlink has no types
    """A message that pymavlink does not define, with pymavlink's accessors: EVENT, COMPONENT_METADATA, ROBOT_STATUS."""

    def __init__(self, frame: Frame) -> None:
        """`frame` has its raw bytes and an id of `mavlink.definitions.MESSAGES`."""
        definition = MESSAGES[frame.message_id]
        super().__init__(definition.id, definition.name)
        payload = frame.payload[: definition.layout.size].ljust(definition.layout.size, b"\0")
        self._fieldnames = list(definition.type._fields)
        self._header = dialect.MAVLink_header(
            definition.id,
            mlen=len(frame.payload),
            seq=frame.sequence,
            srcSystem=frame.ids[0],
            srcComponent=frame.ids[1],
        )
        for name, value in zip(self._fieldnames, definition.layout.unpack(payload), strict=True):
            setattr(self, name, text(value) if name in TEXTS else value)


def encode(message: Any, *, system: int, component: int, sequence: int) -> bytes:
    """The unsigned MAVLink 2 frame of a message of pymavlink, or of `mavlink.definitions`.

    Raises struct.error or ValueError for a value that does not fit its field.
    """
    if not isinstance(message, dialect.MAVLink_message):
        return own.encode(message, system=system, component=component, sequence=sequence)
    sender = dialect.MAVLink(None, srcSystem=system, srcComponent=component)
    sender.seq = sequence
    return bytes(message.pack(sender))


def decode(data: bytes) -> list[Any]:
    """The messages of one datagram, with pymavlink's accessors. Unknown ids, wrong CRCs and garbage are skipped."""
    found: list[Any] = []
    for frame in Parser(None).feed(data):
        if frame.message_id in dialect.mavlink_map:
            found.append(dialect.MAVLink(None).decode(bytearray(frame.raw)))
        elif frame.message_id in MESSAGES:
            found.append(OtherMessage(frame))
    return found
