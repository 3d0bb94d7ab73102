from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.publishers.simple_message.requests import RequestReader
from mav_robot_status.simple_message import LONGEST_LENGTH, ORDERS, SHORTEST


def frame(kind: int, communication: int, *body: int, order: str = "<", reply: int = 0) -> bytes:
    return struct.pack(f"{order}{4 + len(body)}i", 12 + 4 * len(body), kind, communication, reply, *body)


def pong(order: str = "<", kind: int = 1) -> bytes:
    return struct.pack(f"{order}4i", 12, kind, 3, 1)


PING = frame(1, 2)
OTHERS = (
    frame(1, 1),
    frame(1, 3, reply=1),
    frame(1, 2, 7),
    frame(10, 2, *range(11)),
    frame(11, 2, *range(20)),
    frame(13, 1, *range(7)),
    frame(2003, 2, 0),
    frame(-1, -1),
)
"""Frames that are no pings: topics, replies, pings and positions with a body, trajectories, a vendor's messages."""


@pytest.mark.parametrize(("name", "order"), ORDERS.items())
def test_a_ping_is_answered(name: str, order: str) -> None:
    assert RequestReader(name).feed(frame(1, 2, order=order)) == pong(order)


def test_a_request_for_a_joint_position_without_positions_is_a_ping() -> None:
    assert RequestReader("little").feed(frame(10, 2)) == pong(kind=10)


@pytest.mark.parametrize("reply", [0, 1, -1, 2**31 - 1])
def test_the_reply_code_of_a_request_has_no_meaning(reply: int) -> None:
    assert RequestReader("little").feed(frame(1, 2, reply=reply)) == pong()


@pytest.mark.parametrize("cut", range(len(PING) + 1))
def test_a_ping_in_two_pieces_is_answered_once(cut: int) -> None:
    reader = RequestReader("little")
    assert reader.feed(PING[:cut]) + reader.feed(PING[cut:]) == pong()
    assert reader.feed(PING) == pong()


@pytest.mark.parametrize("other", OTHERS)
def test_every_other_message_is_skipped(other: bytes) -> None:
    reader = RequestReader("little")
    assert reader.feed(other) == b""
    assert reader.feed(PING) == pong()


@pytest.mark.parametrize("length", [0, 11, -1, -(2**31), 2**31 - 1, LONGEST_LENGTH + 1])
def test_after_an_impossible_length_the_next_ping_is_answered(length: int) -> None:
    garbage = struct.pack("<i", length) + b"GET / HTTP/1.1\r\n\r\n"
    reader = RequestReader("little")
    assert reader.feed(garbage + PING + PING) == pong() * 2
    assert b"".join(reader.feed(bytes([byte])) for byte in garbage + PING + PING) == pong() * 2


def test_the_body_of_another_message_is_not_searched_for_pings() -> None:
    assert RequestReader("little").feed(frame(11, 2, 12, 1, 2, 0)) == b""


def test_a_long_message_is_skipped_without_being_held() -> None:
    reader = RequestReader("little")
    assert reader.feed(struct.pack("<4i", LONGEST_LENGTH, 12, 2, 0)) == b""
    for _ in range(LONGEST_LENGTH - 12):
        assert reader.feed(b"x") == b""
        assert reader.pending == 0
    assert reader.feed(PING) == pong()


@given(
    st.lists(st.sampled_from([PING, *OTHERS, *(one[:10] for one in OTHERS), b"\xff" * 9, b"\0"])), st.integers(1, 40)
)
def test_no_bytes_raise_or_are_held_and_pieces_make_no_difference(parts: list[bytes], size: int) -> None:
    data = b"".join(parts)
    whole = RequestReader("little").feed(data)
    reader = RequestReader("little")
    pieces = b""
    for start in range(0, len(data), size):
        pieces += reader.feed(data[start : start + size])
        assert reader.pending < SHORTEST
    assert pieces == whole


@given(st.binary(max_size=400), st.sampled_from(list(ORDERS)))
def test_no_bytes_make_more_replies_than_pings_fit_into_them(data: bytes, order: str) -> None:
    assert len(RequestReader(order).feed(data)) <= len(data)


@given(st.lists(st.sampled_from([PING, *OTHERS])))
def test_exactly_the_pings_among_valid_frames_are_answered(frames: list[bytes]) -> None:
    assert RequestReader("little").feed(b"".join(frames)) == pong() * frames.count(PING)
