"""Replay of a recorded log with the installed command."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from mav_robot_status.testing import DEMO

from ..deadline import SOON, Deadline, allow
from .gateway_process import COMMAND, run


def lines(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


@pytest.fixture(scope="module")
def replayed(demo_log: Path) -> str:
    done = run(str(demo_log))
    assert done.returncode == 0
    assert "Traceback" not in done.stderr
    return done.stdout


def test_a_replay_gives_the_same_lines_every_time(replayed: str, demo_log: Path) -> None:
    assert replayed == run(str(demo_log)).stdout


def test_every_line_matches_the_schema(replayed: str, validate: Callable[[Any], None]) -> None:
    for line in lines(replayed):
        validate(line)


def test_the_lines_have_the_time_of_the_log(replayed: str) -> None:
    statuses = lines(replayed)
    assert statuses[0]["stamp"].startswith("2027-01-15T08:00:00")
    assert [s["seq"] for s in statuses] == list(range(len(statuses)))
    assert len(statuses) == pytest.approx(DEMO.duration * 10, rel=0.15)  # 10 Hz, also through the silence, and changes
    story = {(s["mode"], s["in_error"], s["e_stopped"], s["link"]["state"]) for s in statuses}
    assert ("AUTO", False, False, "CONNECTED") in story
    assert ("UNKNOWN", None, None, "LOST") in story
    assert any(s["in_error"] for s in statuses)
    assert any(s["e_stopped"] for s in statuses)


@pytest.mark.parametrize("arguments", [("--rate", "2"), ("--changes-only",), ("--rate", "0")])
def test_options_reduce_the_lines(replayed: str, demo_log: Path, arguments: tuple[str, ...]) -> None:
    assert 10 < len(lines(run(str(demo_log), *arguments).stdout)) < len(lines(replayed)) / 2


def test_the_ros_formats(demo_log: Path) -> None:
    ros1 = lines(run(str(demo_log), "--format", "ros1", "--changes-only").stdout)
    ros2 = lines(run(str(demo_log), "--format", "ros2", "--changes-only").stdout)
    fields = ("mode", "e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")
    assert list(ros1[0]) == ["header", *fields, "error_code"]
    assert list(ros2[0]) == ["header", *fields, "error_codes"]
    assert ros1[0]["header"]["stamp"]["secs"] == ros2[0]["header"]["stamp"]["sec"] == 1_800_000_000
    assert {line["mode"]["val"] for line in ros1} == {-1, 1, 2}
    for one, two in zip(ros1, ros2, strict=True):
        assert [one[f] for f in fields] == [two[f] for f in fields]
        assert two["error_codes"][:1] == ([one["error_code"]] if one["error_code"] else [])


def test_the_lines_go_to_a_file_or_nowhere(replayed: str, demo_log: Path, tmp_path: Path) -> None:
    target = tmp_path / "lines.jsonl"
    assert run(str(demo_log), "--json", str(target)).stdout == ""
    assert target.read_text("utf-8") == replayed
    assert run(str(demo_log), "--json", "none").stdout == ""


def test_a_closed_reader_ends_the_replay_with_0(demo_log: Path) -> None:
    with subprocess.Popen([*COMMAND, str(demo_log)], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        log = process.stderr.read()
        assert process.wait(allow(SOON)) == 0
    assert b"Traceback" not in log


def test_sigterm_ends_a_replay_that_waits_for_its_reader(demo_log: Path) -> None:
    with subprocess.Popen([*COMMAND, str(demo_log)], stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.read(1)  # it has begun, and soon fills the pipe
        deadline = Deadline()
        idle = 0
        while idle < 3:  # until it waits in a write
            assert deadline.left
            idle = idle + 1 if _sleeps(process.pid) else 0
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        _, log = process.communicate(timeout=allow(SOON))
        assert process.returncode == 0
    assert b"Traceback" not in log


def _sleeps(pid: int) -> bool:
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        return stat.read().rpartition(")")[2].split()[0] == "S"


def test_noise_between_the_records_is_counted_and_the_lines_are_the_same(
    replayed: str, demo_log: Path, tmp_path: Path
) -> None:
    data = demo_log.read_bytes()
    first = 8 + 10 + data[9] + 2
    log = tmp_path / "noisy.tlog"
    log.write_bytes(data[:first] + b"\x55" * 300 + data[first:])
    done = run(str(log))
    assert (done.returncode, done.stdout) == (0, replayed)
    assert "300 bytes of garbage" in done.stderr


def test_a_file_that_is_not_a_log_is_one_line_and_exit_code_2(tmp_path: Path) -> None:
    log = tmp_path / "noise.tlog"
    log.write_bytes(bytes(range(256)) * 40)
    done = run(str(log))
    assert (done.returncode, done.stdout) == (2, "")
    assert "is not a recorded log" in done.stderr.splitlines()[-1]
    assert "Traceback" not in done.stderr


MEASURED = (
    "import sys; from mav_robot_status.cli import main; code = main(sys.argv[1:])\n"
    "print(next(line for line in open('/proc/self/status') if line.startswith('VmHWM')), file=sys.stderr)\n"
    "sys.exit(code)"
)
"""Runs the command, and then prints the most memory that it has ever had."""


@pytest.fixture(scope="module")
def large_log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """80 MB: the demo, and much that no status needs."""
    path = tmp_path_factory.mktemp("logs") / "large.tlog"
    mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    with path.open("wb") as log:
        for at in range(600):
            log.write(
                stamped(at, dialect.MAVLink_heartbeat_message(2, 3, 81 + 128 * (at // 60 % 2), 0, 3, 3).pack(mav))
            )
            image = dialect.MAVLink_encapsulated_data_message(at, [at % 255 + 1] * 253).pack(mav)
            log.write(stamped(at, image) * 500)
    assert path.stat().st_size > 80e6
    return path


def stamped(second: int, frame: bytes) -> bytes:
    return (1_800_000_000_000_000 + second * 1_000_000).to_bytes(8, "big") + frame


@pytest.mark.parametrize("arguments", [("--json", "none"), ("report", "--as-json")], ids=["replay", "report"])
def test_the_memory_does_not_depend_on_the_size_of_the_log(large_log: Path, arguments: tuple[str, ...]) -> None:
    command = [sys.executable, "-c", MEASURED, *arguments, str(large_log)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=allow(60))
    assert done.returncode == 0, done.stderr
    kilobytes = int(done.stderr.split("VmHWM:")[1].split()[0])
    assert kilobytes < 60_000
