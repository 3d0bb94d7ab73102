from __future__ import annotations

import struct

import pytest

from mav_robot_status.publishers.ros.cdr import HEADER, Encoder


def test_numbers_are_little_endian_and_aligned_to_their_size() -> None:
    encoder = Encoder()
    encoder.int8(-1)
    encoder.int32(-2)
    encoder.octet(255)
    encoder.uint32(2**32 - 1)
    assert encoder.payload() == HEADER + bytes.fromhex("ff000000 feffffff ff000000 ffffffff")


def test_a_string_has_its_length_with_the_final_nul() -> None:
    encoder = Encoder()
    encoder.string("é")
    encoder.int8(1)
    assert encoder.payload() == HEADER + bytes.fromhex("03000000 c3a900 01")


@pytest.mark.parametrize("hostile", ["a\0b", "a\ud800b"])
def test_a_text_that_a_reader_would_cut_or_refuse_has_a_question_mark(hostile: str) -> None:
    encoder = Encoder()
    encoder.string(hostile)
    assert encoder.payload() == HEADER + b"\x04\0\0\0a?b\0"


def test_a_sequence_has_its_count() -> None:
    encoder = Encoder()
    encoder.int32_sequence([])
    encoder.int32_sequence([1, -1])
    assert encoder.payload() == HEADER + bytes.fromhex("00000000 02000000 01000000 ffffffff")


def test_a_number_that_does_not_fit_is_an_error() -> None:
    with pytest.raises(struct.error):
        Encoder().int8(128)
