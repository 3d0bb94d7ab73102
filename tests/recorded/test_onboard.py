"""Onboard logs of simulated autopilots agree with what was true, and the readers with those of ArduPilot and PX4."""

from __future__ import annotations

import bisect
import json
import lzma
from pathlib import Path
from typing import Any

import pytest
from pymavlink import DFReader

from mav_robot_status.config import Config
from mav_robot_status.gateway.logs.onboard_recording import OnboardRecording
from mav_robot_status.gateway.replay import open_recording
from mav_robot_status.hardware.onboard_log.dataflash import DataFlashReader
from mav_robot_status.hardware.onboard_log.ulog import ULogReader

from .replays import lines_of

HERE = Path(__file__).parent / "onboard"
LOGS = sorted(path for path in HERE.glob("*.xz") if not path.name.startswith("rover-"))
SLACK = 1.5  # s
HIDDEN = {("quadplane-4.5.6", "inhibits")}
"""The truth of the wire: a motor test of a QuadPlane does not show there. The log shows it."""
VAGUE = {("px4-quad-1.15dev", 79.545, "in_motion")}
"""Its estimate drifts while it stands armed on the ground: UNKNOWN."""


def name_of(path: Path) -> str:
    return path.name.split(".bin")[0].split(".ulg")[0]


@pytest.fixture(scope="module", params=LOGS, ids=name_of)
def log(request: pytest.FixtureRequest) -> tuple[str, list[dict[str, Any]], dict[str, Any]]:
    path: Path = request.param
    truth = json.loads((HERE / f"{name_of(path)}.truth.json").read_text())
    return name_of(path), [json.loads(line) for line in lines_of(path)], truth


def holds(line: dict[str, Any], field: str, want: list[Any]) -> bool:
    if field == "inhibits":
        names = {one["name"] for one in line["inhibits"]}
        return all((name[1:] not in names) if name[0] == "!" else name in names for name in want)
    return (line["link"]["state"] if field == "link" else line[field]) in want


def test_nothing_contradicts_the_truth(log: tuple[str, list[dict[str, Any]], dict[str, Any]]) -> None:
    name, lines, truth = log
    times = [line["boot_s"] for line in lines]
    checked = 0
    for one in truth["truth"]:
        if (name, one["field"]) in HIDDEN:
            continue
        vague = [None] if (name, one["b0"], one["field"]) in VAGUE else []
        late = 2.0 if one["field"] == "in_motion" else SLACK
        for line in lines[bisect.bisect(times, one["b0"] + late) : bisect.bisect(times, one["b1"] - 0.2)]:
            assert holds(line, one["field"], one["want"] + vague), (one, line)
            checked += 1
    assert checked > 5000


def test_the_emergency_stop_is_known_for_99_percent_of_the_run(
    log: tuple[str, list[dict[str, Any]], dict[str, Any]],
) -> None:
    _, lines, truth = log
    known = [line["e_stopped"] is not None for line in lines]
    assert sum(known) >= 0.99 * len(known)
    changes = [[0.0, False], *truth["log_truth"]["stop"]]
    starts = [at for at, _ in changes]
    for line in lines:
        near = {changes[bisect.bisect(starts, line["boot_s"] + off) - 1][1] for off in (-SLACK, 0, SLACK)}
        assert line["e_stopped"] is None or line["e_stopped"] in near, line


def test_no_motor_is_driven_while_the_drives_are_said_to_have_no_power(
    log: tuple[str, list[dict[str, Any]], dict[str, Any]],
) -> None:
    _, lines, truth = log
    changes = truth["log_truth"]["driven"]
    starts = [at for at, _ in changes]
    seen = 0
    for line in lines:
        near = {changes[max(0, bisect.bisect(starts, line["boot_s"] + off) - 1)][1] for off in (-SLACK, 0, SLACK)}
        if near == {True}:
            assert line["drives_powered"] is not False, line
            seen += 1
    assert seen > 50


def test_a_robot_is_not_said_to_move_on_command_without_power(
    log: tuple[str, list[dict[str, Any]], dict[str, Any]],
) -> None:
    for line in log[1]:
        assert line["drives_powered"] is not False or line["motion_possible"] is False, line
        assert (line["motion_possible"] is True) == (line["inhibits"] == []), line
        assert (line["error_code"] != 0) == (line["in_error"] is True), line


def test_the_reader_of_dataflash_reads_what_that_of_pymavlink_reads(tmp_path: Path) -> None:
    data = lzma.decompress((HERE / "ardurover-4.5.6.bin.xz").read_bytes())
    (tmp_path / "a.bin").write_bytes(data)
    wanted = dict.fromkeys(("ARM", "EV", "MODE", "ERR", "MSG", "PARM", "GPS", "RCOU", "ATT", "MAVC"), 0.0)
    reader = DataFlashReader(wanted)
    ours = [(r.name, dict(r.values)) for r in (*reader.feed(data), *reader.finish()) if r.name]
    theirs = []
    other = DFReader.DFReader_binary(str(tmp_path / "a.bin"))
    while (message := other.recv_match(type=list(wanted))) is not None:
        found = message.to_dict()
        theirs.append((found.pop("mavpackettype"), found))
    other.close()
    assert len(ours) == len(theirs) > 5000
    for (name, mine), (other_name, his) in zip(ours, theirs, strict=True):
        assert name == other_name
        assert {key: value for key, value in mine.items() if key not in ("Lat", "Lng")} == pytest.approx(
            {key: value for key, value in his.items() if key not in ("Lat", "Lng")}, nan_ok=True
        )


def test_the_reader_of_ulog_reads_what_pyulog_reads(tmp_path: Path) -> None:
    pyulog = pytest.importorskip("pyulog")
    data = lzma.decompress((HERE / "px4-quad-1.15dev.ulg.xz").read_bytes())
    (tmp_path / "a.ulg").write_bytes(data)
    theirs = pyulog.ULog(str(tmp_path / "a.ulg"))
    names = {dataset.name for dataset in theirs.data_list}
    reader = ULogReader(dict.fromkeys((*names, "message"), 0.0))
    ours = [*reader.feed(data), *reader.finish()]
    for dataset in theirs.data_list:
        mine = [dict(record.values) for record in ours if record.name == dataset.name]
        assert len(mine) == len(dataset.data["timestamp"])
        for index in (0, len(mine) // 2, len(mine) - 1):
            for key, value in mine[index].items():
                if key in dataset.data and not isinstance(value, tuple):
                    assert value == pytest.approx(dataset.data[key][index].item(), nan_ok=True), key
    texts = [record.values["text"] for record in ours if record.name == "message"]
    assert texts == [one.message for one in theirs.logged_messages]


def test_a_recording_counts_and_dates_its_records() -> None:
    recording = open_recording(str(HERE / "rover-stop.bin.xz"))
    assert isinstance(recording, OnboardRecording)
    recording.hardware(Config())
    times = [now for now, record, _ in recording if record is not None]
    assert times[0].mono == 0.0
    assert [now.mono for now in times] == sorted(now.mono for now in times)
    assert recording.seconds == pytest.approx(157.6, abs=0.1)
    assert recording.summary().endswith("1740 records")
    assert recording.preview.clock == "by its GPS"
