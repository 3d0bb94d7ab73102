"""Files that are no recorded logs, or hostile ones, with the installed command: one line, soon, in little memory."""

from __future__ import annotations

import json
import os
import resource
import subprocess
from pathlib import Path

import pytest

from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message, MAVLink_system_time_message

from ..deadline import allow
from .gateway_process import COMMAND, run

START = 1_800_000_000_000_000
HOUR = 3_600_000_000
MEMORY = 400 << 20
"""Bytes of address space of a limited process."""


def heartbeat(mav: MAVLink, armed: bool = False) -> bytes:
    message = MAVLink_heartbeat_message(10, 3, 65 | (128 if armed else 0), 0, 4, 3)
    packed: bytes = message.pack(mav)
    mav.seq = (mav.seq + 1) & 255
    return packed


def limited(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command with little memory."""
    return subprocess.run(
        [*COMMAND, *arguments],
        capture_output=True,
        text=True,
        timeout=allow(30),
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY)),
    )


def is_one_clear_line(done: subprocess.CompletedProcess[str], part: str) -> None:
    assert (done.returncode, done.stdout) == (2, "")
    errors = [line for line in done.stderr.splitlines() if "replaying" not in line]
    assert len(errors) == 1, errors
    assert part in errors[0]


def test_long_silences_in_a_short_log_do_not_become_millions_of_lines(tmp_path: Path) -> None:
    log = tmp_path / "gaps.tlog"
    mav = MAVLink(None, srcSystem=1, srcComponent=1)
    log.write_bytes(b"".join((START + n * 23 * HOUR).to_bytes(8, "big") + heartbeat(mav) for n in range(3)))
    assert log.stat().st_size == 87
    done = run(str(log))
    assert done.returncode == 0
    states = [json.loads(line)["link"]["state"] for line in done.stdout.splitlines()]
    assert states.count("LOST") == 2
    assert states.count("CONNECTED") < 100
    report = run("report", str(log), "--as-json")
    assert report.returncode == 0
    assert len(report.stdout) < 20_000


@pytest.mark.parametrize(("option", "fewest", "most"), [((), 2500, 3000), (("--max-gap", "100"), 1, 1)])
def test_a_shorter_silence_has_the_lines_of_a_live_link(
    tmp_path: Path, option: tuple[str, ...], fewest: int, most: int
) -> None:
    log = tmp_path / "gap.tlog"
    mav = MAVLink(None, srcSystem=1, srcComponent=1)
    times = (0, 50, 100, 150, 200, 250, 300) if not option else (0, 150)
    log.write_bytes(b"".join((START + n * 1_000_000).to_bytes(8, "big") + heartbeat(mav) for n in times))
    done = run(str(log), *option)
    assert fewest <= done.stdout.count('"LOST"') <= most


def test_a_device_is_refused_in_one_line(tmp_path: Path) -> None:
    link = tmp_path / "zero.tlog"
    link.symlink_to("/dev/zero")
    is_one_clear_line(limited(str(link)), "it is not a file but a device")
    is_one_clear_line(limited("report", "/dev/zero"), "it is not a file but a device")


def test_a_pipe_without_a_writer_is_one_line(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.tlog"
    os.mkfifo(pipe)
    is_one_clear_line(run(str(pipe)), "nothing was written to it")


@pytest.mark.slow
def test_a_file_larger_than_the_memory_is_read_in_pieces(tmp_path: Path) -> None:
    log = tmp_path / "large.tlog"
    mav = MAVLink(None, srcSystem=1, srcComponent=1)
    with log.open("wb") as file:
        file.write(START.to_bytes(8, "big") + heartbeat(mav))
        file.truncate(MEMORY)  # zeros, without blocks on the disk
    done = limited(str(log), "--changes-only")
    assert done.returncode == 0
    assert '"CONNECTED"' in done.stdout
    noise = tmp_path / "noise.tlog"
    with noise.open("wb") as file:
        file.truncate(MEMORY * 1000)
    is_one_clear_line(limited(str(noise)), "is not a recorded log")


def test_a_dataflash_log_is_recognised(tmp_path: Path) -> None:
    log = tmp_path / "00000001.bin"
    log.write_bytes(b"\xa3\x95\x80\x80\x59FMT\0BBnNZ".ljust(89, b"\0") * 50)
    is_one_clear_line(run(str(log)), "is no DataFlash log that can be read: no record in it")


def capture() -> bytes:
    """A raw capture of a minute: armed after half of it."""
    mav = MAVLink(None, srcSystem=1, srcComponent=1)
    data = b""
    for second in range(60):
        data += MAVLink_system_time_message(START + second * 1_000_000, 5000 + second * 1000).pack(mav)
        mav.seq = (mav.seq + 1) & 255
        data += heartbeat(mav, armed=second >= 30)
    return data


def test_a_raw_capture_is_recognised_and_refused(tmp_path: Path) -> None:
    log = tmp_path / "flight.tlog.raw"
    log.write_bytes(capture())
    is_one_clear_line(run(str(log)), "replay it with --raw")


def test_a_raw_capture_is_replayed_with_the_time_of_the_autopilot(tmp_path: Path) -> None:
    log = tmp_path / "flight.tlog.raw"
    log.write_bytes(capture())
    done = run(str(log), "--raw")
    assert done.returncode == 0
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert 580 < len(lines) < 620
    assert lines[0]["stamp"].startswith("2027-01-15T08:00:00")
    armed = next(line for line in lines if line["drives_powered"] is True)
    assert armed["stamp"].startswith("2027-01-15T08:00:30")
