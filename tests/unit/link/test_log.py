import itertools
import os
import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mav_robot_status.errors import UsageError
from mav_robot_status.link.log import DAY_US, END, SMALL_STEP_US, Counts, LogReader, follows, timed

START = 1_700_000_000_000_000
SECOND = 1_000_000


def v1(number: int = 0) -> bytes:
    return bytes([0xFE, 9, number, 1, 1, 0]) + bytes(9) + b"\x12\x34"


def v2(number: int = 0, signed: bool = False) -> bytes:
    return bytes([0xFD, 9, int(signed), 0, number, 1, 1, 0, 0, 0]) + bytes(9) + b"\x12\x34" + bytes(13 * signed)


def record(stamp: int, data: bytes) -> bytes:
    return stamp.to_bytes(8, "big") + data


def ordinary(count: int = 10, start: int = START) -> list[bytes]:
    frames = [v1, v2, lambda number: v2(number, signed=True)]
    return [record(start + number * SECOND, frames[number % 3](number)) for number in range(count)]


Write = Callable[..., LogReader]


@pytest.fixture(name="reader")
def fixture_reader(tmp_path: Path) -> Write:
    def write(*parts: bytes) -> LogReader:
        path = tmp_path / "flight.tlog"
        path.write_bytes(b"".join(parts))
        return LogReader(str(path))

    return write


def times(stamps: list[float]) -> tuple[list[tuple[float, float, bool]], Counts]:
    """(mono, unix_us since START, new_segment) of each stamp; stamps are seconds since START."""
    counts = Counts()
    micros = [START + round(stamp * SECOND) for stamp in stamps]
    pieces = zip(micros, [*micros[1:], END], [b""] * len(stamps), strict=True)
    return [
        (round(now.mono, 6), (now.unix_us - START) / SECOND, new_segment)
        for now, _, new_segment in timed(pieces, counts)
    ], counts


def test_a_log_in_order_gives_each_frame_at_its_time(reader: Write) -> None:
    log = reader(*ordinary())
    records = list(log)
    assert [r.data for r in records] == [part[8:] for part in ordinary()]
    assert [r.now.unix_us for r in records] == [START + n * SECOND for n in range(10)]
    assert [r.now.mono for r in records] == pytest.approx(range(10))
    assert not any(r.new_segment for r in records)
    assert log.counts == Counts(records=10)
    assert log.summary() == f"{log.path}: 10 records"


def test_reading_again_gives_the_same(reader: Write) -> None:
    log = reader(*ordinary(), b"torn")
    assert list(log) == list(log)
    assert log.counts.torn_bytes == 4


@pytest.mark.parametrize("size", [1, 7, 8, 9, 18, 19, 24])
def test_a_torn_tail_is_counted(reader: Write, size: int) -> None:
    tail = record(START + 60 * SECOND, v1())[:size]
    log = reader(*ordinary(), tail)
    assert [r.data for r in log] == [part[8:] for part in ordinary()]
    assert log.counts == Counts(records=10, torn_bytes=size)
    assert log.summary().endswith(f": 10 records, {size} bytes of a torn record at the end")


def test_garbage_that_was_recorded_as_a_record_is_handed_on_at_its_time(reader: Write) -> None:
    parts = ordinary()
    text = [record(START + 4 * SECOND + n, bytes([letter])) for n, letter in enumerate(b"Init ArduPilot\n")]
    log = reader(*parts[:5], *text, *parts[5:])
    assert [r.data for r in log] == [part[8:] for part in (*parts[:5], *text, *parts[5:])]
    assert log.counts == Counts(records=25, garbage_bytes=15)


def test_garbage_behind_a_frame_stays_with_it(reader: Write) -> None:
    parts = ordinary()
    log = reader(*parts[:5], b"garbage \xfd\xfe" * 3, *parts[5:])
    data = [r.data for r in log]
    assert data[4] == parts[4][8:] + b"garbage \xfd\xfe" * 3
    assert [data[:4], data[5:]] == [[part[8:] for part in parts[:4]], [part[8:] for part in parts[5:]]]
    assert log.counts == Counts(records=10, garbage_bytes=30)


@pytest.mark.parametrize("length", [0, 3, 12, 60, 255])
def test_a_wrong_length_costs_no_other_frame(reader: Write, length: int) -> None:
    parts = ordinary()
    damaged = bytearray(parts[4])
    damaged[9] = length
    log = reader(*parts[:4], bytes(damaged), *parts[5:])
    data = [r.data for r in log]
    assert data == [part[8:] for part in (*parts[:4], bytes(damaged), *parts[5:])]


def test_bytes_that_are_missing_cost_one_frame(reader: Write) -> None:
    parts = ordinary()
    log = reader(*parts[:4], parts[4][:20], *parts[5:])
    data = [r.data for r in log]
    assert [data[:4], data[-5:]] == [[part[8:] for part in parts[:4]], [part[8:] for part in parts[5:]]]


def test_what_comes_before_the_first_record_is_skipped(reader: Write) -> None:
    log = reader(b"\x00\x06 some header \xfe\xfd", *ordinary())
    assert [r.data for r in log] == [part[8:] for part in ordinary()]
    assert log.counts == Counts(records=10, skipped_bytes=17)


def test_a_jump_of_the_clock_behind_garbage_is_found(reader: Write) -> None:
    log = reader(*ordinary(), b"garbage", *ordinary(start=START + 400 * DAY_US))
    records = list(log)
    assert len(records) == 20
    assert [n for n, r in enumerate(records) if r.new_segment] == [10]
    assert log.counts == Counts(records=20, garbage_bytes=7, jumps=1)
    assert log.summary().endswith("7 bytes of garbage, 1 jumps of the clock, each a new segment")


@pytest.mark.parametrize(
    "stamp", [0, START - 3600 * SECOND, START + 3600 * SECOND, START + 900 * DAY_US, 1 << 52, (1 << 64) - 1]
)
def test_a_single_wrong_stamp_counts_as_the_one_before(reader: Write, stamp: int) -> None:
    parts = ordinary()
    log = reader(*parts[:4], record(stamp, v1(4)), *parts[5:])
    records = list(log)
    assert [(r.now.unix_us - START) // SECOND for r in records] == [0, 1, 2, 3, 3, 5, 6, 7, 8, 9]
    assert [r.now.mono for r in records] == pytest.approx([0, 1, 2, 3, 3, 5, 6, 7, 8, 9])
    assert records[4].data == v1(4)
    assert log.counts == Counts(records=10, corrected=1)


def test_a_small_step_back_is_held_until_the_log_catches_up() -> None:
    found, counts = times([0, 1, 2, 0.5, 1.5, 2.5, 3])
    assert [mono for mono, _, _ in found] == [0, 1, 2, 2, 2, 2.5, 3]
    assert [unix for _, unix, _ in found] == [0, 1, 2, 2, 2, 2.5, 3]
    assert counts == Counts(held=2)


def test_many_small_steps_back_do_not_hold_time_longer_than_one_may() -> None:
    found, counts = times([10, 6, 2, 2.1])
    assert found == [(0, 10, False), (0, 10, False), (0, 2, True), (0.1, 2.1, False)]
    assert counts == Counts(held=1, jumps=1)


@pytest.mark.parametrize("jump", [-3600, -12, 86402, 900 * 86400])
def test_a_lasting_jump_starts_a_new_segment_and_adds_no_time(jump: float) -> None:
    found, counts = times([0, 1, 1 + jump, 2 + jump, 3 + jump])
    assert found == [(0, 0, False), (1, 1, False), (1, 1 + jump, True), (2, 2 + jump, False), (3, 3 + jump, False)]
    assert counts == Counts(jumps=1)


def test_a_silence_of_less_than_a_day_is_lived_through() -> None:
    found, counts = times([0, 1, 80000, 80001])
    assert [mono for mono, _, _ in found] == [0, 1, 80000, 80001]
    assert counts == Counts()


def test_a_jump_after_a_silence_is_not_taken_for_a_wrong_stamp() -> None:
    found, _ = times([0, 100, 3, 4])
    assert [(mono, new) for mono, _, new in found] == [(0, False), (0, False), (3, False), (4, False)]
    found, _ = times([50, 100, 3, 4])
    assert [(mono, new) for mono, _, new in found] == [(0, False), (50, False), (50, True), (51, False)]


def test_a_far_stamp_at_the_very_end_is_not_believed() -> None:
    for last in (-3600, 90000):
        found, counts = times([0, 1, last])
        assert found[-1] == (1, 1, False)
        assert counts == Counts(corrected=1)


def test_a_first_stamp_that_is_wrong_is_left_behind_at_the_second() -> None:
    found, counts = times([-START / SECOND, 0, 1])
    assert [(mono, new) for mono, _, new in found] == [(0, False), (0, True), (1, False)]
    assert counts == Counts(jumps=1)


@given(
    st.lists(st.one_of(st.integers(0, (1 << 64) - 1), st.integers(0, 20).map(lambda s: START + s * SECOND)), min_size=1)
)
def test_time_never_runs_backward_whatever_the_stamps(stamps: list[int]) -> None:
    counts = Counts()
    records = list(timed(zip(stamps, [*stamps[1:], END], [b""] * len(stamps), strict=True), counts))
    assert len(records) == len(stamps)
    monos = [r.now.mono for r in records]
    assert monos == sorted(monos)
    assert sum(r.new_segment for r in records) == counts.jumps
    for before, after in itertools.pairwise(records):
        assert after.new_segment or after.now.unix_us >= before.now.unix_us


def test_neighbours_are_five_seconds_back_to_a_day_forward() -> None:
    assert follows(START, START - SMALL_STEP_US)
    assert follows(START, START + DAY_US)
    assert not follows(START, START - SMALL_STEP_US - 1)
    assert not follows(START, START + DAY_US + 1)
    assert not follows(START, END)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.lists(
        st.one_of(
            st.binary(max_size=40),
            st.integers(0, 9).map(lambda n: ordinary()[n]),
            st.integers(0, (1 << 64) - 1).map(lambda stamp: record(stamp, v2())),
            st.just(bytes(30)),
        )
    )
)
def test_every_byte_of_any_log_is_in_order_and_accounted_for(reader: Write, parts: list[bytes]) -> None:
    log = reader(*ordinary(3), *parts)
    records = list(log)
    stamps = 8 * len(records)
    assert log.counts.records == len(records)
    assert sum(len(r.data) for r in records) + stamps + log.counts.torn_bytes == os.path.getsize(log.path)


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (None, "cannot read the log '{}': No such file or directory"),
        (b"", "the log '{}' is empty"),
        (b"\xa3\x95" * 1000, "{} is not a recorded log: no MAVLink frame with a time stamp in it; a .tlog is needed"),
    ],
)
def test_a_file_that_is_no_log_is_said_in_one_line(tmp_path: Path, content: bytes | None, part: str) -> None:
    path = tmp_path / "flight.tlog"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UsageError, match=re.escape(part.format(path))):
        LogReader(str(path))


def test_a_directory_is_no_log(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="Is a directory"):
        LogReader(str(tmp_path))
