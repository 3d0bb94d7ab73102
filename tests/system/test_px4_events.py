"""The installed command with a table of PX4's events: a replay, `explain`, `check-config`, and errors in one line."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from mav_robot_status.mavlink.definitions import Heartbeat, SysStatus
from mav_robot_status.mavlink.encode import encode
from tests.unit.hardware.mavlink.px4_reports import LOITER, document, report

START_US = 1_800_000_000_000_000
COMMAND = (sys.executable, "-m", "mav_robot_status")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, timeout=60, check=False)


@pytest.fixture
def table(tmp_path: Path) -> Path:
    file = tmp_path / "all_events.json"
    file.write_text(json.dumps(document()))
    return file


@pytest.fixture
def flight(tmp_path: Path) -> Path:
    """A PX4 that is not ready, and reports why."""
    file, sequence = tmp_path / "flight.tlog", 0
    with open(file, "wb") as log:
        for second in range(4):
            messages = [Heartbeat(LOITER, 2, 12, 81, 3, 3), SysStatus(1, 1, 1, 0, 0, 0, 0, 0)]
            for message in [*messages, *(report(1) if second == 2 else ())]:
                log.write((START_US + second * 1_000_000).to_bytes(8, "big"))
                log.write(encode(message, system=1, component=1, sequence=sequence & 255))
                sequence += 1
    return file


def test_a_replay_gives_the_reasons_of_the_table(flight: Path, table: Path) -> None:
    ran = run("-q", "--changes-only", "--px4-events", str(table), str(flight))
    last = json.loads(ran.stdout.splitlines()[-1])
    assert [i["text"] for i in last["inhibits"] if i["name"] == "PREARM_FAILING"] == ["GPS 2 has no fix"]
    assert last["vehicle"]["can_arm"] is False
    assert last["vehicle"]["modes_blocked"] == ["AUTO.LOITER", "AUTO.MISSION"]


def test_explain_shows_each_check_with_its_component_its_modes_and_its_description(flight: Path, table: Path) -> None:
    shown = run("explain", "-q", "--px4-events", str(table), str(flight)).stdout
    line = next(line for line in shown.splitlines() if line.startswith("check "))
    assert "GPS 2 has no fix" in line
    assert "component: GPS, modes: Mission, loiter. Wait. See EKF2_GPS_CHECK" in line
    (check,) = json.loads(run("explain", "-q", "--as-json", str(flight)).stdout)["arming_checks"]
    assert (check["text"], check["component"], check["modes"]) == ("gps (2 modes)", "gps", None)


def test_a_table_that_cannot_be_used_ends_the_command_with_one_line(flight: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text("[]")
    site = tmp_path / "site.yaml"
    site.write_text(f"hardware: {{px4_events: {bad}}}\n")
    for arguments in (("-q", "--px4-events", str(bad), str(flight)), ("check-config", str(site))):
        ran = run(*arguments)
        assert ran.returncode == 2
        assert ran.stderr.count("\n") == 1
        assert str(bad) in ran.stderr


def test_check_config_says_which_table_is_used(table: Path, tmp_path: Path) -> None:
    site = tmp_path / "site.yaml"
    site.write_text(f"hardware: {{px4_events: {table}}}\n")
    assert f"hardware: px4_events = {table} (default none)" in run("check-config", str(site)).stdout
