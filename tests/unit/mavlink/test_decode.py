"""Messages out of frames, as pymavlink decodes them; arrays stay raw."""

from __future__ import annotations

import math
import random
import struct
from typing import Any

import pytest

from mav_robot_status.mavlink.decode import text
from mav_robot_status.mavlink.definitions import MESSAGES, Definition
from mav_robot_status.mavlink.encode import enclose
from mav_robot_status.mavlink.framing import Parser
from tests import pymavlink_dialect

CODES = {"uint8_t": "B", "uint16_t": "H", "int32_t": "i", "float": "f"}


def raw(message: Any, name: str, size: int) -> bytes:
    """An array of a pymavlink message as bytes on the wire."""
    value = getattr(message, f"_{name}_raw", getattr(message, name))
    if isinstance(value, list):
        kind = message.fieldtypes[message.fieldnames.index(name)]
        return struct.pack(f"<{len(value)}{CODES[kind]}", *value)
    return bytes(value).ljust(size, b"\0")


def decoded(message_id: int, payload: bytes, version: int = 2) -> Any:
    data = enclose(message_id, payload, system=1, component=1, sequence=0, version=version)
    (frame,) = Parser({message_id}).feed(data)
    return frame.message


@pytest.mark.parametrize("definition", MESSAGES.values(), ids=lambda d: d.name)
def test_every_message_decodes_as_pymavlink_decodes_it_trimmed_or_not(definition: Definition) -> None:
    rng = random.Random(definition.id)
    for zeros in [0, 0, 1, 2, 3, definition.size // 2, definition.size]:
        body = bytes(rng.randrange(256) for _ in range(definition.size - zeros)).rstrip(b"\0") or b"\0"
        data = enclose(definition.id, body, system=1, component=1, sequence=0)
        ours = Parser(MESSAGES).feed(data)[0].message
        theirs = pymavlink_dialect.MAVLink(None).parse_char(data)
        assert theirs
        assert type(ours) is definition.type
        assert list(ours._fields) == [name for name in theirs.ordered_fieldnames if name in ours._fields]
        for name, value in ours._asdict().items():
            if isinstance(value, bytes):
                assert value == raw(theirs, name, len(value))
            else:
                other = getattr(theirs, name)
                assert value == other or (math.isnan(value) and math.isnan(other))


def test_bytes_beyond_the_layout_are_ignored() -> None:
    assert decoded(245, b"\x01\x02of a newer definition") == MESSAGES[245].type(vtol_state=1, landed_state=2)


def test_a_short_mavlink_1_payload_without_extensions_is_filled_up() -> None:
    assert decoded(77, b"\x90\x01\x04", version=1) == MESSAGES[77].type(400, 4, 0, 0, 0, 0)


def test_an_unused_message_decodes_to_none() -> None:
    assert decoded(46, bytes(2)) is None


@pytest.mark.parametrize(
    ("chars", "expected"),
    [
        (b"", ""),
        (b"\0\0", ""),
        (b"Armed\0\0\0", "Armed"),
        (b"full, no NUL", "full, no NUL"),
        (b"cut\0 here", "cut"),
        ("22 \u00b0C".encode(), "22 \u00b0C"),
        (b"bad \xff byte", "bad \ufffd byte"),
    ],
)
def test_text_ends_at_the_first_nul(chars: bytes, expected: str) -> None:
    assert text(chars) == expected
