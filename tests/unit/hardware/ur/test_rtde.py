"""The client of RTDE as a protocol machine, against frames that are written here from the guide."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.errors import ProtocolError
from mav_robot_status.hardware.ur.rtde import Session, Step

NAMES = ("robot_mode", "actual_qd")


def frame(kind: bytes, payload: bytes = b"") -> bytes:
    return struct.pack(">H", 3 + len(payload)) + kind + payload


VERSION_OK = frame(b"V", b"\1")
RECIPE = frame(b"O", b"\1INT32,VECTOR6D")
STARTED = frame(b"S", b"\1")
CONTROLLER = frame(b"v", struct.pack(">IIII", 5, 11, 1, 108318))
GREETING = VERSION_OK + CONTROLLER
DATA = frame(b"U", b"\1" + struct.pack(">i6d", 7, *range(6)))
VALUES = {"robot_mode": 7, "actual_qd": (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)}


def sent(session: Session) -> bytes:
    """What it sends next."""
    out, session.sent = session.sent, b""
    return out


def test_it_asks_for_the_version_then_for_values_then_starts() -> None:
    session = Session(NAMES, 10.0)
    assert sent(session) == frame(b"V", b"\0\2")
    assert session.feed(VERSION_OK) == []
    assert sent(session) == frame(b"v")
    session.feed(CONTROLLER)
    assert session.firmware == "5.11.1"
    assert sent(session) == frame(b"O", struct.pack(">d", 10.0) + b"robot_mode,actual_qd")
    session.feed(RECIPE)
    assert sent(session) == frame(b"S")
    session.feed(STARTED)
    assert session.step is Step.DATA
    assert session.feed(DATA + DATA) == [VALUES, VALUES]


def test_without_the_version_of_the_controller_it_goes_on_when_told() -> None:
    session = Session(NAMES, 10.0)
    session.go_on()
    assert session.step is Step.VERSION
    session.feed(VERSION_OK)
    session.go_on()
    assert sent(session).endswith(b"robot_mode,actual_qd")
    session.feed(CONTROLLER + RECIPE)
    assert (session.step, session.firmware) == (Step.START, "5.11.1")


def test_a_probe_does_not_ask_for_the_version_of_the_controller() -> None:
    session = Session(NAMES, 10.0, with_firmware=False)
    sent(session)
    session.feed(VERSION_OK)
    assert sent(session) == frame(b"O", struct.pack(">d", 10.0) + b"robot_mode,actual_qd")


@given(st.lists(st.integers(1, 20), min_size=1))
def test_frames_may_be_cut_anywhere(sizes: list[int]) -> None:
    session = Session(NAMES, 10.0)
    stream = GREETING + RECIPE + STARTED + DATA + frame(b"M", b"hello") + DATA
    found, at = [], 0
    while at < len(stream):
        for size in sizes:
            found += session.feed(stream[at : at + size])
            at += size
    assert found == [VALUES, VALUES]


def test_it_reads_the_version_of_the_controller() -> None:
    session = Session(NAMES, 10.0)
    session.feed(CONTROLLER)
    assert session.firmware == "5.11.1"
    assert session.step is Step.VERSION
    session.feed(frame(b"v", b"short"))
    assert session.firmware == "5.11.1"


def test_names_that_the_controller_does_not_know_are_left_out() -> None:
    session = Session(NAMES, 10.0)
    session.feed(GREETING)
    sent(session)
    session.feed(frame(b"O", b"\0INT32,NOT_FOUND"))
    assert session.missing == ("actual_qd",)
    assert sent(session) == frame(b"O", struct.pack(">d", 10.0) + b"robot_mode")
    session.feed(frame(b"O", b"\1INT32") + STARTED)
    assert session.feed(frame(b"U", b"\1" + struct.pack(">i", 7))) == [{"robot_mode": 7}]


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (frame(b"V", b"\0"), "the controller does not speak RTDE version 2: it is too old"),
        (frame(b"V"), "the controller does not speak RTDE version 2: it is too old"),
        (b"\0\2V", "this is not RTDE; it begins with 00 02 56"),
        (b"\x10\1U", "this is not RTDE; it begins with 10 01 55"),
        (b"Connected: Universal Robots Dashboard Server", "this is not RTDE; it begins with 43 6f 6e"),
        (GREETING + frame(b"O", b"\1INT32"), "1 types for 2 values"),
        (GREETING + frame(b"O"), "1 types for 2 values"),
        (GREETING + frame(b"O", b"\0NOT_FOUND,NOT_FOUND"), "the controller knows none of the values"),
        (GREETING + frame(b"O", b"\0IN_USE,IN_USE"), "or another client has them"),
        (GREETING + RECIPE + frame(b"S", b"\0"), "the controller refuses to start"),
        (GREETING + RECIPE + STARTED + frame(b"U", b"\x01123"), "4 bytes of values instead of 53"),
    ],
)
def test_a_peer_that_speaks_otherwise_gets_one_reason(data: bytes, why: str) -> None:
    with pytest.raises(ProtocolError, match=why):
        Session(NAMES, 10.0).feed(data)


def test_frames_out_of_turn_mean_nothing() -> None:
    session = Session(NAMES, 10.0)
    assert session.feed(DATA + STARTED + RECIPE + frame(b"?", b"x") + frame(b"U")) == []
    assert session.step is Step.VERSION


@given(st.lists(st.binary(max_size=300), max_size=20))
def test_no_bytes_raise_anything_else_or_make_it_grow(pieces: list[bytes]) -> None:
    session = Session(NAMES, 10.0)
    try:
        for piece in pieces:
            session.feed(piece)
    except ProtocolError:
        pass
    assert len(session._rest) < 1 << 16
