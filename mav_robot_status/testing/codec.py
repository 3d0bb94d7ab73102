"""Encodes and decodes the fake autopilot's messages, with all fields of each message."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

from ..mavlink.decode import text
from ..mavlink.encode import enclose
from ..mavlink.framing import Frame, Parser
from .definitions import MESSAGES, TEXTS

LAYOUTS: Final = {d.type: (d.id, d.layout) for d in MESSAGES.values()}
"""By the class of a message: its id and the struct of its payload."""


class DecodedMessage:
    """One received message: its fields as attributes, and accessors with the names that pymavlink uses.

    Text fields are str; other arrays are the bytes of the wire.
    """

    def __init__(self, frame: Frame) -> None:
        """`frame` has its raw bytes and an id of MESSAGES."""
        definition = MESSAGES[frame.message_id]
        payload = frame.payload[: definition.layout.size].ljust(definition.layout.size, b"\0")
        values = definition.type(*definition.layout.unpack(payload))._asdict()
        self._name = definition.name
        self._frame = frame
        self._fields: dict[str, Any] = {name: text(value) if name in TEXTS else value for name, value in values.items()}

    def __getattr__(self, name: str) -> Any:
        try:
            return self._fields[name]
        except KeyError:
            raise AttributeError(f"{self._name} has no field {name!r}") from None

    def __repr__(self) -> str:
        fields = ", ".join(f"{name} : {value}" for name, value in self._fields.items())
        return f"{self._name} {{{fields}}}"

    def get_type(self) -> str:
        """The name of the message: `HEARTBEAT`."""
        return self._name

    def get_msgId(self) -> int:  # noqa: N802  # pymavlink's name
        """The message id."""
        return self._frame.message_id

    def get_srcSystem(self) -> int:  # noqa: N802
        """The system id of the sender."""
        return self._frame.ids[0]

    def get_srcComponent(self) -> int:  # noqa: N802
        """The component id of the sender."""
        return self._frame.ids[1]

    def get_seq(self) -> int:
        """The sequence number of the frame."""
        return self._frame.sequence

    def to_dict(self) -> dict[str, Any]:
        """The name of the message under `mavpackettype`, and its fields."""
        return {"mavpackettype": self._name, **self._fields}


def encode(message: NamedTuple, *, system: int, component: int, sequence: int) -> bytes:
    """The unsigned MAVLink 2 frame of a message of `testing.definitions`.

    Raises KeyError for another class, struct.error for a value that does not fit its field.
    """
    message_id, layout = LAYOUTS[type(message)]
    payload = layout.pack(*message).rstrip(b"\0") or b"\0"
    return enclose(message_id, payload, system=system, component=component, sequence=sequence)


def decode(data: bytes) -> list[DecodedMessage]:
    """The messages of one datagram. Other bytes are skipped: unknown ids, wrong CRCs, garbage."""
    return [DecodedMessage(frame) for frame in Parser(None).feed(data) if frame.message_id in MESSAGES]
