"""A recorded log: every frame with its time, even from a damaged file."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mav_robot_status.errors import UsageError
from mav_robot_status.gateway.logs.recorded_log import Recording
from mav_robot_status.links.log import DAY_US, Counts, Stamped
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame

START = 1_700_000_000_000_000
SECOND = 1_000_000

Write = Callable[..., Recording]


def frame(number: int, version: int = 2) -> bytes:
    message = mav.Heartbeat(number, 10, 3, 81, 4, 3)
    return encode(message, system=1, component=1, sequence=number % 256, version=version)


def record(stamp: int, data: bytes) -> bytes:
    return stamp.to_bytes(8, "big") + data


def ordinary(count: int = 10, start: int = START, first: int = 0) -> list[bytes]:
    return [record(start + n * SECOND, frame(first + n, 1 + n % 2)) for n in range(count)]


@pytest.fixture(name="recording")
def fixture_recording(tmp_path: Path) -> Write:
    def write(*parts: bytes) -> Recording:
        path = tmp_path / "flight.tlog"
        path.write_bytes(b"".join(parts))
        return Recording(str(path))

    return write


def seconds(found: list[Stamped]) -> list[int]:
    return [(now.unix_us - START) // SECOND for now, frame, _ in found if frame is not None]


def numbers(found: list[Stamped]) -> list[int]:
    return [Frame(*frame).message.custom_mode for _, frame, _ in found if frame is not None]


def test_each_frame_has_its_time_and_the_log_ends_at_the_last_frame(recording: Write) -> None:
    log = recording(*ordinary())
    found = list(log)
    assert seconds(found) == list(range(10))
    assert numbers(found) == list(range(10))
    assert found[-1] == (found[-2][0], None, False)
    assert log.summary().endswith("flight.tlog: 10 frames")


def test_the_log_ends_at_the_last_frame_even_if_that_is_ignored(recording: Write) -> None:
    unwanted = encode(mav.NamedValueInt(0, 0, b"x"), system=1, component=1, sequence=0)
    found = list(recording(*ordinary(), record(START + 60 * SECOND, unwanted)))
    assert (found[-1][0].unix_us - START) // SECOND == 60


@pytest.mark.parametrize("size", [1, 7, 8, 12])
def test_a_truncated_last_frame_is_counted(recording: Write, size: int) -> None:
    log = recording(*ordinary(), record(START + 10 * SECOND, frame(10))[:size])
    assert len(numbers(list(log))) == 10
    assert log.summary().endswith(f"{size} bytes of an incomplete record at the end")


def test_garbage_loses_no_frame(recording: Write) -> None:
    parts = ordinary()
    log = recording(b"boot banner\r\n", *parts[:4], b"\xfd\xfegarbage", *parts[4:])
    found = list(log)
    assert numbers(found) == list(range(10))
    assert seconds(found) == list(range(10))
    assert "bytes of garbage" in log.summary()


@pytest.mark.parametrize("length", [0, 3, 40, 255])
def test_a_wrong_length_loses_no_other_frame(recording: Write, length: int) -> None:
    parts = ordinary(40)
    parts[4] = parts[4][:9] + bytes([length]) + parts[4][10:]
    found = list(recording(*parts))
    assert numbers(found) == [n for n in range(40) if n != 4]
    assert seconds(found) == [n for n in range(40) if n != 4]


def test_missing_bytes_lose_one_frame(recording: Write) -> None:
    parts = ordinary(30)
    parts[4] = parts[4][:12] + parts[4][17:]
    assert numbers(list(recording(*parts))) == [n for n in range(30) if n != 4]


def test_a_clock_jump_after_garbage_is_found(recording: Write) -> None:
    log = recording(*ordinary(), b"garbage", *ordinary(start=START + 400 * DAY_US))
    found = list(log)
    assert [n for n, (_, _, new_segment) in enumerate(found) if new_segment] == [10]
    assert log.counts == Counts(jumps=1)
    assert log.summary().endswith("1 clock jumps, each starts a new segment")


@pytest.mark.parametrize(
    "stamp", [0, START - 3600 * SECOND, START + 3600 * SECOND, START + 900 * DAY_US, 1 << 52, (1 << 64) - 1]
)
def test_a_single_wrong_timestamp_counts_as_the_previous_one(recording: Write, stamp: int) -> None:
    parts = ordinary()
    log = recording(*parts[:4], record(stamp, frame(4)), *parts[5:])
    found = list(log)
    assert seconds(found) == [0, 1, 2, 3, 3, 5, 6, 7, 8, 9]
    assert [now.mono for now, frame, _ in found if frame] == pytest.approx([0, 1, 2, 3, 3, 5, 6, 7, 8, 9])
    assert numbers(found) == list(range(10))
    assert log.counts == Counts(corrected=1)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.one_of(st.binary(max_size=60), st.integers(0, 50).map(lambda n: record(START + n, frame(n))))))
def test_any_bytes_are_read_to_the_end_in_time_order(recording: Write, parts: list[bytes]) -> None:
    content = b"".join(parts) or b"\0"
    try:
        found = list(recording(content))
    except UsageError:
        return
    monos = [now.mono for now, _, _ in found]
    assert monos == sorted(monos)


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (None, "cannot read the log '{}': No such file or directory"),
        (b"", "the log '{}' is empty"),
        (b"\xa3\x96" * 1000, "{} is not a recorded log: no MAVLink frame with a time stamp in it, and no onboard log"),
        (b"\x1f\x8b\x08", "cannot read the log '{}': its compressed data is cut off or damaged"),
        (b"\xfd7zXZ\0 no xz", "cannot read the log '{}': its compressed data is cut off or damaged"),
        (frame(0) + frame(1), "{} is a raw capture: MAVLink without the time stamps of a .tlog; replay it with --raw"),
    ],
)
def test_a_file_that_is_not_a_log_is_a_one_line_error(tmp_path: Path, content: bytes | None, part: str) -> None:
    path = tmp_path / "flight.tlog"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UsageError, match=re.escape(part.format(path))):
        list(Recording(str(path)))
