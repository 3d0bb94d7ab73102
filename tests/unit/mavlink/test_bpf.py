"""The program for the kernel against the parser: nothing that the parser would return is dropped."""

from __future__ import annotations

import pathlib
import random
from collections.abc import Collection

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.mavlink.message_table import IDS_WITH_FILES, WANTED_IDS
from mav_robot_status.mavlink.bpf import MOST_INSTRUCTIONS, packed, program
from mav_robot_status.mavlink.definitions import CRC_EXTRA
from mav_robot_status.mavlink.encode import with_crc
from mav_robot_status.mavlink.framing import STAMP_SIZE, Parser
from mav_robot_status.mavlink.wire import REVERSED
from tests.bpf_machine import passes

RECORDINGS = sorted((pathlib.Path(__file__).parents[2] / "recorded" / "logs").glob("*.tlog"))
NEEDED = packed(program(WANTED_IDS))
KNOWN = sorted(CRC_EXTRA)
UNKNOWN_ID = 0x7A0001
HEARTBEAT, RAW_IMU, TUNNEL = 0, 27, 385


def frame(message_id: int, payload: bytes = b"payload", version: int = 2, flags: int = 0, sequence: int = 0) -> bytes:
    """A whole frame with a valid CRC; a signature of zeros if the flags say that there is one."""
    extra = CRC_EXTRA.get(message_id, 0)
    if version == 1:
        header = bytes([0xFE, len(payload), sequence, 1, 1, message_id])
    else:
        header = bytes([0xFD, len(payload), flags, 0, sequence, 1, 1]) + message_id.to_bytes(3, "little")
    whole = with_crc(header + payload, REVERSED[extra : extra + 1])
    return whole + bytes(13) if flags & 1 and version == 2 else whole


def returned(datagram: bytes, wanted: Collection[int]) -> int:
    """How many frames a new parser returns."""
    return len(Parser(wanted).feed(datagram))


@st.composite
def frames(draw: st.DrawFn) -> bytes:
    """A frame of any kind."""
    message_id = draw(st.one_of(st.sampled_from(sorted(WANTED_IDS)), st.sampled_from(KNOWN), st.integers(0, 2**24 - 1)))
    version = draw(st.sampled_from((1, 2))) if message_id < 256 else 2
    return frame(message_id, draw(st.binary(max_size=40)), version, draw(st.sampled_from((0, 0, 0, 1, 2, 255))))


@st.composite
def damaged(draw: st.DrawFn) -> bytes:
    """A frame with a changed byte, or cut off, or with bytes before or behind it."""
    made = bytearray(draw(frames()))
    made[draw(st.integers(0, len(made) - 1))] = draw(st.integers(0, 255))
    start, end = draw(st.integers(0, 4)), draw(st.integers(0, 4))
    rest = draw(st.sampled_from((b"", b"x", b"\xfd", b"\xfe")))
    return bytes(rest + made[start : len(made) - end])


DATAGRAMS = st.one_of(
    frames(),
    damaged(),
    st.lists(frames(), min_size=2, max_size=3).map(b"".join),
    st.binary(max_size=60),
    st.binary(max_size=40).map(lambda rest: b"\xfd" + rest),
    st.binary(max_size=40).map(lambda rest: b"\xfe" + rest),
)


@given(DATAGRAMS)
def test_nothing_that_the_parser_returns_is_dropped(datagram: bytes) -> None:
    if returned(datagram, WANTED_IDS):
        assert passes(NEEDED, datagram)


@given(DATAGRAMS, st.sets(st.one_of(st.sampled_from(KNOWN), st.integers(0, 2**24 - 1)), max_size=60))
def test_only_whole_single_frames_of_unwanted_ids_without_flags_are_dropped(datagram: bytes, wanted: set[int]) -> None:
    whole_1 = len(datagram) >= 8 and datagram[0] == 0xFE and len(datagram) == datagram[1] + 8
    whole_2 = len(datagram) >= 12 and datagram[0] == 0xFD and len(datagram) == datagram[1] + 12 and datagram[2] == 0
    unwanted = (whole_1 and datagram[5] not in wanted) or (
        whole_2 and int.from_bytes(datagram[7:10], "little") not in wanted
    )
    assert passes(packed(program(wanted)), datagram) is not unwanted


@pytest.mark.parametrize("count", [0, 1, 4, 5, 500, 1500])
@pytest.mark.parametrize("version", [1, 2])
def test_any_number_of_ids_is_told_from_all_others(count: int, version: int) -> None:
    rng = random.Random(count)
    ids = range(256) if version == 1 else [*KNOWN, *(rng.randrange(2**24) for _ in range(3000))]
    wanted = set(rng.sample(list(ids), min(count, len(ids))))
    made = packed(program(wanted))
    sample = [*rng.sample(sorted(wanted), min(count, 60)), *rng.sample(list(ids), 60)]
    assert {i for i in sample if passes(made, frame(i, version=version))} == wanted.intersection(sample)


def test_too_many_ids_are_an_error_with_the_limit_of_the_kernel() -> None:
    with pytest.raises(ValueError, match=f"3000 ids make .* the kernel takes {MOST_INSTRUCTIONS}"):
        program(range(3000))


def test_the_ids_of_a_status_take_few_instructions() -> None:
    assert len(program(IDS_WITH_FILES)) < 200


@pytest.mark.parametrize("log", RECORDINGS, ids=lambda log: log.stem)
def test_of_a_recorded_flight_the_parser_returns_the_same_frames_behind_the_filter(log: pathlib.Path) -> None:
    """The sequence numbers are those of the wire, too: who may speak is judged by the same evidence."""
    whole = Parser(None, stamped=True).feed(log.read_bytes())[:20_000]
    rng = random.Random(log.stem)
    all_of_them, needed = Parser(WANTED_IDS), Parser(WANTED_IDS)
    at = stopped = 0
    while at < len(whole):
        count = rng.choice((1, 1, 1, 2, 5))
        datagram = b"".join(one.raw for one in whole[at : at + count])
        at += count
        found = all_of_them.feed(datagram)
        if passes(NEEDED, datagram):
            assert repr(needed.feed(datagram)) == repr(found)  # fields may be NaN
        else:
            assert found == []
            stopped += 1
    assert stopped


def test_a_valid_frame_inside_a_damaged_one_is_the_only_one_that_it_loses() -> None:
    """No sender makes this, and the checksum of UDP detects damage on the way."""
    hidden = frame(HEARTBEAT)
    outer = frame(RAW_IMU, hidden)
    assert returned(outer, WANTED_IDS) == 0
    assert returned(outer[:-1] + b"x", WANTED_IDS) == 1
    assert not passes(NEEDED, outer[:-1] + b"x")


def test_a_stamp_of_a_log_is_no_part_of_a_datagram() -> None:
    assert passes(NEEDED, bytes(STAMP_SIZE) + frame(RAW_IMU))


def test_frames_of_another_dialect_are_dropped_and_signed_ones_pass() -> None:
    assert not passes(NEEDED, frame(UNKNOWN_ID))
    assert not passes(NEEDED, frame(TUNNEL))
    assert passes(NEEDED, frame(TUNNEL, flags=1))
