"""Raw captures are recognised, and their frames have the time of the autopilot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.gateway.logs.raw_log import AutopilotClock, is_raw
from mav_robot_status.gateway.logs.recorded_log import Recording
from mav_robot_status.mavlink.definitions import Attitude, Heartbeat, SystemTime
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame

START = 1_800_000_000_000_000
HEARTBEAT = Heartbeat(0, 10, 3, 65, 4, 3)
RECORDINGS = sorted((Path(__file__).parents[2] / "recorded" / "logs").glob("*.tlog"))


def sent(message: Any, component: int = 1) -> bytes:
    return encode(message, system=1, component=component, sequence=0)


def attitude(boot_ms: int) -> Attitude:
    return Attitude(boot_ms, 0.0, 0.0, 0.0)


def stamps(path: Path, *frames: bytes) -> list[int]:
    path.write_bytes(b"".join(frames))
    return [now.unix_us for now, frame, _ in Recording(str(path), raw=True) if frame is not None]


@pytest.mark.parametrize("path", RECORDINGS, ids=lambda path: path.stem)
def test_no_recording_is_taken_for_a_raw_capture(path: Path) -> None:
    assert not is_raw(path.read_bytes()[: 1 << 16])


@pytest.mark.parametrize("cut", [0, 1, 15])
def test_frames_without_stamps_are_a_raw_capture_also_from_within_a_frame(cut: int) -> None:
    assert is_raw((sent(HEARTBEAT) * 20)[cut:])


def test_bytes_without_frames_are_no_raw_capture() -> None:
    assert not is_raw(bytes(1000))


def test_frames_have_the_time_of_the_autopilot_in_utc(tmp_path: Path) -> None:
    told = SystemTime(START + 10_000_000, 10_000)
    frames = (sent(HEARTBEAT), sent(attitude(10_000)), sent(told), sent(HEARTBEAT), sent(attitude(12_500)))
    assert [(stamp - START) // 1000 for stamp in stamps(tmp_path / "a", *frames)] == [
        10_000,
        10_000,
        10_000,
        10_000,
        12_500,
    ]


def test_without_utc_the_time_is_that_since_the_start(tmp_path: Path) -> None:
    found = stamps(tmp_path / "a", sent(HEARTBEAT), sent(attitude(4_000)), sent(attitude(5_000)))
    assert found == [4_000_000, 4_000_000, 5_000_000]


def test_the_clock_of_another_component_does_not_count(tmp_path: Path) -> None:
    frames = (sent(SystemTime(START, 90_000), 190), sent(HEARTBEAT), sent(attitude(5_000)), sent(attitude(99_000), 190))
    assert set(stamps(tmp_path / "a", *frames)) == {5_000_000}


def test_time_goes_on_after_a_restart_of_the_autopilot() -> None:
    clock = AutopilotClock(sent(HEARTBEAT) + sent(attitude(60_000)))
    values = [Frame(30, (1, 1), 0, attitude(boot_ms), b"") for boot_ms in (60_000, 61_000, 1_000, 3_000)]
    assert [clock.stamped(frame).stamp // 1000 for frame in values] == [60_000, 61_000, 61_000, 63_000]
