"""The frames of simple_message, as the server writes and the client reads them."""

from __future__ import annotations

import contextlib
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.errors import ProtocolError
from mav_robot_status.interface import RobotMode, RobotStatus, TriState
from mav_robot_status.simple_message import FIELDS, LONGEST_LENGTH, ORDERS, StatusEncoder, StatusReader

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
EXAMPLE = RobotStatus(RobotMode.AUTO, FALSE, TRUE, TRUE, UNKNOWN, TRUE, 2001)
FRAME = "280000000d00000001000000000000000100000000000000d107000001000000ffffffff0200000001000000"
"""EXAMPLE, as the C++ library of ROS-Industrial writes and reads it."""


def frame(kind: int, communication: int, *body: int, order: str = "<") -> bytes:
    return struct.pack(f"{order}{4 + len(body)}i", 12 + 4 * len(body), kind, communication, 0, *body)


def test_the_example_frame_bit_by_bit() -> None:
    assert StatusEncoder("little").encode(EXAMPLE).hex() == FRAME


def test_a_status_in_the_other_byte_order() -> None:
    swapped = struct.pack(">11i", *struct.unpack("<11i", bytes.fromhex(FRAME)))
    assert StatusEncoder("big").encode(EXAMPLE) == swapped


def test_a_frame_has_every_field_of_a_status() -> None:
    assert sorted(FIELDS) == sorted(RobotStatus._fields)


def test_an_unknown_status_is_unknown_in_every_field() -> None:
    assert struct.unpack("<11i", StatusEncoder("little").encode(RobotStatus()))[4:] == (-1, -1, 0, -1, -1, -1, -1)


@pytest.mark.parametrize("code", [-(2**31), 2**31 - 1])
def test_an_error_code_has_32_bits(code: int) -> None:
    sent = StatusEncoder("little").encode(EXAMPLE._replace(error_code=code))
    assert struct.unpack("<11i", sent)[6] == code


@pytest.mark.parametrize("name", ORDERS)
def test_a_reader_reads_what_the_encoder_writes_in_pieces_of_any_size(name: str) -> None:
    sent = StatusEncoder(name).encode(EXAMPLE) * 3
    for size in (1, 7, 43, 44, 45, len(sent)):
        reader = StatusReader(name)
        found = [one for at in range(0, len(sent), size) for one in reader.feed(sent[at : at + size])]
        assert [one._asdict() for one in found] == [{name: getattr(EXAMPLE, name) for name in FIELDS}] * 3


@pytest.mark.parametrize("other", [frame(1, 2), frame(10, 1, *range(11)), frame(13, 2, 5), frame(15, 1, *range(900))])
def test_other_messages_are_skipped(other: bytes) -> None:
    assert len(StatusReader("little").feed(other + StatusEncoder("little").encode(EXAMPLE))) == 1


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (StatusEncoder("big").encode(EXAMPLE), "the byte order is big, not as configured"),
        (b"HTTP/1.1 400 Bad Request", "this is not simple_message; it begins with 48 54 54 50"),
        (struct.pack("<3i", LONGEST_LENGTH + 1, 13, 1), "this is not simple_message"),
        (struct.pack("<3i", 11, 13, 1), "this is not simple_message"),
        (struct.pack("<3i", -1, 13, 1), "this is not simple_message"),
        (frame(13, 1, *range(6)), "a STATUS has the length 36 instead of 40"),
    ],
)
def test_a_peer_that_speaks_otherwise_gets_one_reason(data: bytes, why: str) -> None:
    with pytest.raises(ProtocolError, match=why):
        StatusReader("little").feed(data)


@given(st.lists(st.binary(max_size=100)), st.sampled_from(list(ORDERS)))
def test_no_bytes_raise_anything_else(pieces: list[bytes], order: str) -> None:
    reader = StatusReader(order)
    with contextlib.suppress(ProtocolError):
        for piece in pieces:
            reader.feed(piece)
