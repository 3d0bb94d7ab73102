from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TextIO

import pytest

from mav_robot_status.config import Config, LinkConfig, VehicleConfig
from mav_robot_status.errors import UsageError
from mav_robot_status.gateway.logs.recorded_log import Recording
from mav_robot_status.gateway.replay import ReplayPipeline, replay, run_through
from mav_robot_status.hardware.mavlink import update
from mav_robot_status.hardware.mavlink.derive import derive
from mav_robot_status.hardware.mavlink.interface import SETTLES
from mav_robot_status.hardware.mavlink.subjects import WANTED_IDS, facts_of
from mav_robot_status.links.log import Stamped
from mav_robot_status.mavlink.definitions import Attitude, GlobalPositionInt, Heartbeat, NamedValueInt, VfrHud
from mav_robot_status.mavlink.encode import encode

START_US = 1_800_000_000_000_000


@pytest.fixture
def stdout(tmp_path: Path) -> Iterator[TextIO]:
    with open(tmp_path / "stdout", "w+", encoding="utf-8") as file:
        yield file


def log_of(path: Path, *seconds: float) -> str:
    """A log with a heartbeat at each of these times."""
    with open(path, "wb") as log:
        for sequence, at in enumerate(seconds):
            log.write(round(START_US + at * 1e6).to_bytes(8, "big"))
            log.write(encode(Heartbeat(0, 10, 3, 65, 4, 3), system=1, component=1, sequence=sequence))
    return str(path)


def pipeline_of(stdout: TextIO) -> ReplayPipeline:
    return ReplayPipeline(Config(), stdout)


def replayed(path: str, stdout: TextIO) -> list[dict[str, Any]]:
    replay(Config(), path, stdout)
    stdout.seek(0)
    return [json.loads(line) for line in stdout]


def test_lines_continue_through_a_gap_as_in_a_live_run(tmp_path: Path, stdout: TextIO) -> None:
    lines = replayed(log_of(tmp_path / "a.tlog", 0, 1, 2, 12, 13), stdout)
    states = [line["link"]["state"] for line in lines]
    assert len(lines) == pytest.approx(130, abs=6)
    assert states[0] == states[-1] == "CONNECTED"
    assert states.count("LOST") == pytest.approx(65, abs=2)  # from 3.5 s after the heartbeat at 2 until that at 12
    first_lost = next(line for line in lines if line["link"]["state"] == "LOST")
    assert first_lost["stamp"].startswith("2027-01-15T08:00:05.5")


def test_a_clock_jump_starts_a_new_segment_without_lines_in_between(tmp_path: Path, stdout: TextIO) -> None:
    lines = replayed(log_of(tmp_path / "a.tlog", 0, 1, 90_000, 90_001), stdout)
    assert 15 < len(lines) < 30
    assert {line["link"]["state"] for line in lines} == {"CONNECTED"}
    assert [line["seq"] for line in lines] == list(range(len(lines)))


def test_a_new_segment_keeps_no_state_of_the_previous_one(tmp_path: Path, stdout: TextIO) -> None:
    pipeline = pipeline_of(stdout)
    since = []

    def watched() -> Iterator[Stamped]:
        for stamped in Recording(log_of(tmp_path / "a.tlog", 0, 1, 90_000, 90_001)):
            yield stamped
            (tracked,) = pipeline.vehicles.vehicles
            if stamped[1] is not None:
                since.append({(inhibit.since_us - START_US) / 1e6 for inhibit in tracked.handle.detail.inhibits})

    run_through(pipeline, watched())
    assert since == [{0.0}, {0.0}, {90_000.0}, {90_000.0}]


def test_lines_continue_to_the_last_frame_even_if_it_is_ignored(tmp_path: Path, stdout: TextIO) -> None:
    unwanted = encode(NamedValueInt(0, 0, b""), system=1, component=1, sequence=2)
    assert 252 not in WANTED_IDS
    path = Path(log_of(tmp_path / "a.tlog", 0, 1))
    path.write_bytes(path.read_bytes() + (START_US + 6_000_000).to_bytes(8, "big") + unwanted)
    lines = replayed(str(path), stdout)
    assert "2027-01-15T08:00:05.9" < lines[-1]["stamp"] <= "2027-01-15T08:00:06.000000Z"
    assert lines[-1]["link"]["state"] == "LOST"
    assert len(lines) == pytest.approx(61, abs=3)


def test_each_instant_is_processed_before_the_next_is_read(tmp_path: Path, stdout: TextIO) -> None:
    pipeline = pipeline_of(stdout)
    told = []

    def watched() -> Iterator[Stamped]:
        for stamped in Recording(log_of(tmp_path / "a.tlog", 0, 10)):
            yield stamped
            (tracked,) = pipeline.vehicles.vehicles
            link = tracked.handle.detail.link.value
            told.append((stamped[0].mono, stamped[1] is None, link, tracked.handle.heard_at))

    last = run_through(pipeline, watched())
    assert told == [(0.0, False, "CONNECTED", 0.0), (10.0, False, "CONNECTED", 10.0), (10.0, True, "CONNECTED", 10.0)]
    assert last.mono == 10.0
    pipeline.close(last)
    stdout.seek(0)
    assert any(json.loads(line)["link"]["state"] == "LOST" for line in stdout)


def test_an_expected_vehicle_has_lines_from_the_start_even_if_it_never_appears(tmp_path: Path, stdout: TextIO) -> None:
    config = Config(vehicles=(VehicleConfig(7, None, "seven"),))
    replay(config, log_of(tmp_path / "a.tlog", 0, 1, 2), stdout)
    stdout.seek(0)
    lines = [json.loads(line) for line in stdout]
    assert {(line["handle"], line["link"]["state"]) for line in lines} == {("seven", "NEVER_SEEN")}
    assert len(lines) == pytest.approx(20, abs=2)


def test_the_vehicles_of_a_log_have_the_time_out_of_the_first_link(tmp_path: Path, stdout: TextIO) -> None:
    config = Config(links=(LinkConfig("udp:127.0.0.1:14550", heartbeat_timeout=20.0),))
    replay(config, log_of(tmp_path / "a.tlog", 0, 1, 15, 16), stdout)
    stdout.seek(0)
    assert {json.loads(line)["link"]["state"] for line in stdout} == {"CONNECTED"}


def test_a_missing_log_is_a_user_error(tmp_path: Path, stdout: TextIO) -> None:
    with pytest.raises(UsageError, match="cannot read the log"):
        replay(Config(), str(tmp_path / "missing.tlog"), stdout)


def test_a_steady_stream_is_settled_twenty_times_a_second_and_derives_nothing(
    tmp_path: Path, stdout: TextIO, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, sequence = tmp_path / "steady.tlog", 0
    with path.open("wb") as log:
        for number in range(200):
            boot_ms = 60_000 + number * 50
            position = GlobalPositionInt(boot_ms, 1, 1, 300, 0, 0)
            messages: list[Any] = [Attitude(boot_ms, 0.0, 0.0, 0.5), position, VfrHud(3.0, 0.0, 40)]
            if number % 20 == 0:
                messages.append(Heartbeat(0, 10, 3, 193, 4, 3))
            for message in messages:
                log.write((START_US + number * 50_000).to_bytes(8, "big"))
                log.write(encode(message, system=1, component=1, sequence=sequence & 255))
                sequence += 1
    settled, derived = [], []

    def settling(state: Any, moment: Any, options: Any) -> Any:
        settled.append(moment.now)
        return facts_of(state, moment, options)

    def deriving(*values: Any) -> Any:
        derived.append(values[3].mono)
        return derive(*values)

    monkeypatch.setattr(update, "facts_of", settling)
    monkeypatch.setattr(update, "derive", deriving)
    run_through(pipeline_of(stdout), Recording(str(path)))
    assert derived
    assert [at for at in derived if at > 2.0] == []
    assert len([at for at in settled if at > 2.0]) <= 8.0 / SETTLES + 8, "and after each of the heartbeats"
