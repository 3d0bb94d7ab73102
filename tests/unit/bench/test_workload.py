"""The traffic has the properties that the results state."""

from __future__ import annotations

import itertools
import pathlib

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench import workload
from mav_robot_status.gateway.links.routing import MOST_FRAMES
from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS
from mav_robot_status.mavlink.framing import Parser

HEARTBEAT, ATTITUDE, GLOBAL_POSITION_INT, VFR_HUD = 0, 30, 33, 74


@pytest.fixture(scope="module")
def frames() -> list[bytes]:
    return workload.frames()


@pytest.mark.parametrize(
    ("traffic", "size", "needed"), [(workload.QUARTER, 36, 0.275), (workload.HALF, 37.8, 0.5)]
)  # fmt: skip
def test_each_workload_has_80_frames_a_second_of_26_types_and_a_status_needs_a_known_part(
    traffic: workload.Workload, size: float, needed: float
) -> None:
    made = workload.frames(2 * workload.PATTERN, workload=traffic)
    ids = ids_of(made)
    assert (len(traffic.sent), sum(traffic.sent.values())) == (26, 10 * workload.RATE)
    assert len(set(ids)) == 26
    assert sum(map(len, made)) / len(made) == pytest.approx(size, abs=0.5)
    assert sum(i in WANTED_IDS for i in ids) / len(ids) == pytest.approx(needed)


def test_attitude_position_and_speed_come_at_4_to_10_hertz_if_half_of_the_frames_are_needed() -> None:
    ids = ids_of(workload.frames(workload.PATTERN, workload=workload.HALF))
    assert [ids.count(i) / 10 for i in (ATTITUDE, GLOBAL_POSITION_INT, VFR_HUD)] == [10, 8, 8]


def ids_of(frames: list[bytes]) -> list[int]:
    """The message id of each frame."""
    return [int.from_bytes(frame[7:10], "little") for frame in frames]


def test_it_is_the_same_every_time(frames: list[bytes]) -> None:
    assert workload.frames() == frames


def test_a_loop_has_no_gap_in_the_sequence(frames: list[bytes]) -> None:
    parser = Parser(WANTED_IDS)
    for piece in workload.chunks(frames * 2):
        parser.feed(piece)
    assert (parser.counters.frames, parser.counters.lost) == (2 * workload.LOOP, 0)


@pytest.mark.parametrize("in_step", [False, True])
def test_each_vehicle_of_a_fleet_has_its_own_sequence(in_step: bool) -> None:
    made = workload.fleet(3, in_step=in_step)
    mav = dialect.MAVLink(None)
    received = [mav.parse_buffer(frame)[0] for frame in made[:30]]
    assert [message.get_srcSystem() for message in received] == [1, 2, 3] * 10
    sequences = [message.get_seq() for message in received[::3]]
    assert sequences == [(sequences[0] + i) % 256 for i in range(10)]
    parser = Parser(WANTED_IDS)
    parser.feed(b"".join(made * 2))
    assert (parser.counters.frames, parser.counters.lost) == (2 * len(made), 0)


@pytest.mark.parametrize(("in_step", "most"), [(False, 4), (True, 20)])
def test_the_vehicles_of_a_fleet_send_their_heartbeats_at_different_times(in_step: bool, most: int) -> None:
    made = ids_of(workload.fleet(20, in_step=in_step))
    moments = [made[i : i + 20] for i in range(0, len(made), 20)]
    assert max(moment.count(HEARTBEAT) for moment in moments) <= most
    assert max(moment.count(HEARTBEAT) for moment in moments) > 0


def test_a_frame_with_another_number_is_valid() -> None:
    message = dialect.MAVLink(None).parse_buffer(workload.numbered(workload.frames(1)[0], 77))[0]
    assert message.get_seq() == 77


def test_a_long_log_has_no_gap_and_its_time_goes_on(tmp_path: pathlib.Path) -> None:
    path = tmp_path / "long.tlog"
    workload.write_long_log(path, 600_000)
    parser = Parser(None, stamped=True)
    stamps = [frame.stamp for frame in parser.feed(path.read_bytes())]
    assert path.stat().st_size >= 600_000
    assert len(stamps) == 3 * workload.LOOP
    assert {later - earlier for earlier, later in itertools.pairwise(stamps)} == {1_000_000 // workload.RATE}
    assert parser.counters.lost == 0


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


def test_no_distinct_frame_comes_again_while_it_is_remembered() -> None:
    made = workload.distinct()
    assert len(set(made)) == len(made) > 2 * MOST_FRAMES
    assert HEARTBEAT in ids_of(made)


def test_saved_frames_can_be_loaded(tmp_path: pathlib.Path, frames: list[bytes]) -> None:
    workload.save(tmp_path / "frames", frames[:50])
    assert list(workload.load(tmp_path / "frames")) == frames[:50]
