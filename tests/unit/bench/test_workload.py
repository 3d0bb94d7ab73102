"""The traffic has the properties that the results state."""

from __future__ import annotations

import pathlib

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench import workload
from mav_robot_status.hardware.mavlink.message_table import WANTED_IDS
from mav_robot_status.mavlink.framing import Parser


@pytest.fixture(scope="module")
def frames() -> list[bytes]:
    return workload.frames()


def test_it_has_80_frames_a_second_of_26_types_and_36_bytes_and_a_status_needs_every_fourth(
    frames: list[bytes],
) -> None:
    ids = [int.from_bytes(frame[7:10], "little") for frame in frames]
    assert (len(workload.SENT), sum(workload.SENT.values())) == (26, 10 * workload.RATE)
    assert len(set(ids)) == 26
    assert sum(map(len, frames)) / len(frames) == pytest.approx(36, abs=0.5)
    assert sum(i in WANTED_IDS for i in ids) / len(ids) == pytest.approx(0.25)


def test_it_is_the_same_every_time(frames: list[bytes]) -> None:
    assert workload.frames() == frames


def test_a_loop_has_no_gap_in_the_sequence(frames: list[bytes]) -> None:
    parser = Parser(WANTED_IDS)
    for piece in workload.chunks(frames * 2):
        parser.feed(piece)
    assert (parser.counters.frames, parser.counters.lost) == (2 * workload.LOOP, 0)


def test_each_vehicle_of_a_fleet_has_its_own_sequence() -> None:
    made = workload.fleet(3)
    mav = dialect.MAVLink(None)
    received = [mav.parse_buffer(frame)[0] for frame in made[:30]]
    assert [message.get_srcSystem() for message in received] == [1, 2, 3] * 10
    assert [message.get_seq() for message in received[::3]] == list(range(10))
    parser = Parser(WANTED_IDS)
    parser.feed(b"".join(made * 2))
    assert (parser.counters.frames, parser.counters.lost) == (2 * len(made), 0)


def test_a_log_has_the_time_before_each_frame(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "made.tlog"
    workload.write_log(path, 161)
    parser = Parser(None, stamped=True)
    stamps = [frame.stamp for frame in parser.feed(path.read_bytes())]
    assert (len(stamps), stamps[-1] - stamps[0]) == (161, 2_000_000)


def test_a_receiver_with_the_key_accepts_signed_frames() -> None:
    key = bytes(range(32))
    mav = dialect.MAVLink(None)
    mav.signing.secret_key = key
    received = [mav.parse_buffer(frame)[0] for frame in workload.frames(20, key=key)]
    assert all(message.get_signed() for message in received)


def test_saved_frames_can_be_loaded(tmp_path: pathlib.Path, frames: list[bytes]) -> None:
    workload.save(tmp_path / "frames", frames[:50])
    assert list(workload.load(tmp_path / "frames")) == frames[:50]
