"""The autopilot's own log through the installed command: every command, damaged and compressed files."""

from __future__ import annotations

import gzip
import json
import lzma
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status import statuses

from .gateway_process import run

LOGS = Path(__file__).parents[1] / "recorded" / "onboard"
STOP = LOGS / "rover-stop.bin.xz"
PX4 = LOGS / "px4-quad-1.15dev.ulg.xz"


def lines(text: str) -> list[dict[str, Any]]:
    return [json.loads(line) for line in text.splitlines()]


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("onboard") / "flight.bin"
    path.write_bytes(lzma.decompress(STOP.read_bytes()))
    return path


def test_every_line_matches_the_schema_and_counts_from_the_boot(validate: Callable[[Any], None]) -> None:
    found = lines(run(str(STOP), "-q").stdout)
    for line in found:
        validate(line)
    assert found[0]["boot_s"] == 2.382
    assert [line["boot_s"] for line in found] == sorted(line["boot_s"] for line in found)
    assert {line["link"]["state"] for line in found} == {"CONNECTED"}


def test_a_log_gives_the_same_lines_packed_or_not_and_under_any_name(unpacked: Path, tmp_path: Path) -> None:
    plain = run(str(unpacked), "-q").stdout
    packed = tmp_path / "a.bin.gz"
    packed.write_bytes(gzip.compress(unpacked.read_bytes()))
    renamed = tmp_path / "b.tlog"
    renamed.write_bytes(unpacked.read_bytes())
    assert plain
    for path in (STOP, packed, renamed):
        assert run(str(path), "-q").stdout == plain


def test_a_log_of_mavlink_may_be_packed_too(demo_log: Path, tmp_path: Path) -> None:
    packed = tmp_path / "demo.tlog.xz"
    packed.write_bytes(lzma.compress(demo_log.read_bytes()))
    assert run(str(packed), "-q").stdout == run(str(demo_log), "-q").stdout


def test_the_report_begins_with_the_verdict() -> None:
    (stop,) = lines(run("report", "-q", "--as-json", str(STOP)).stdout)
    assert stop["verdict"]["word"] == "EMERGENCY STOP"
    assert stop["verdict"]["sentence"].startswith("EMERGENCY STOP at +130.6 s (18:23:49) while it moved at 5.4 m/s")
    (crash,) = lines(run("report", "-q", "--as-json", str(LOGS / "rover-crash.bin.xz")).stdout)
    assert crash["verdict"]["sentence"].endswith("disarmed by the crash check (ARM.Method 12).")


@pytest.mark.parametrize("at", ["+132", "boot:134.4", "2026-11-23T18:23:51.5Z"])
def test_a_moment_can_be_explained(at: str) -> None:
    (found,) = lines(run("explain", "-q", "--as-json", str(STOP), "--at", at).stdout)
    assert found["fields"]["e_stopped"]["value"] is True
    assert found["fields"]["e_stopped"]["source"] == "EV 54"


@pytest.mark.parametrize(
    ("log", "at", "part"),
    [
        (STOP, "boot:x", "write boot:93"),
        (STOP, "boot:1", "the log begins"),
        (None, "boot:3", "only an autopilot's own"),
    ],
)
def test_a_moment_that_is_not_in_the_log_is_one_line(log: Path | None, at: str, part: str, demo_log: Path) -> None:
    done = run("explain", "-q", str(log or demo_log), "--at", at)
    assert done.returncode == 2
    assert part in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_doctor_says_what_a_log_lacks(tmp_path: Path, unpacked: Path) -> None:
    (found,) = lines(run("doctor", "-q", "--as-json", str(STOP)).stdout)
    assert (found["cause"], found["ok"], found["lacks"], found["gaps"]) == ("ok", True, [], 1)
    poor = tmp_path / "poor.bin"
    data = unpacked.read_bytes()
    at = data.index(b"RCOU\0") if b"RCOU\0" in data else data.index(b"RCOUQ")
    poor.write_bytes(data[:at] + b"XCOU" + data[at + 4 :])
    done = run("doctor", "-q", str(poor))
    assert done.returncode == 0
    assert "no RCOU: a motor test of a disarmed robot is not seen" in done.stdout


def test_statuses_reads_an_onboard_log() -> None:
    with statuses(str(PX4)) as found:
        messages = list(found)
    assert messages[0].boot_s is not None
    assert any(message.status.e_stopped == 1 for message in messages)


@pytest.mark.parametrize("log", [STOP, PX4], ids=["bin", "ulg"])
@pytest.mark.parametrize("part", [0.02, 0.5, 0.97])
def test_a_log_that_is_cut_off_shows_what_was_read(log: Path, part: float, tmp_path: Path) -> None:
    whole = lzma.decompress(log.read_bytes())
    cut = tmp_path / log.name.removesuffix(".xz")
    cut.write_bytes(whole[: round(len(whole) * part)])
    done = run(str(cut), "--changes-only")
    assert "Traceback" not in done.stderr
    assert done.returncode == (0 if done.stdout else 2)
    assert part < 0.1 or lines(done.stdout)


def test_files_that_hold_nothing_are_one_line_each(tmp_path: Path) -> None:
    files = {
        "empty.bin": b"",
        "zeros.ulg": bytes(5000),
        "head.ulg": b"ULog\x01\x12\x35\x01" + bytes(8),
        "head.bin": b"\xa3\x95\x80",
        "cut.bin.gz": gzip.compress(b"abc" * 100)[:12],
    }
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)
        done = run(str(tmp_path / name), "-q")
        assert (done.returncode, done.stdout) == (2, ""), name
        assert len(done.stderr.splitlines()) == 1, done.stderr
    assert run(str(tmp_path / "missing.ulg"), "-q").stderr.endswith("missing.ulg': No such file or directory\n")


def test_a_pipe_and_another_system_are_refused(tmp_path: Path) -> None:
    done = run(str(STOP), "--system", "7")
    assert done.returncode == 2
    assert "is the log of system 1, and system 7 is expected" in done.stderr
    pipe = tmp_path / "pipe.bin"
    os.mkfifo(pipe)
    writer = os.open(pipe, os.O_RDWR)
    os.write(writer, lzma.decompress(STOP.read_bytes())[:30_000])
    done = run(str(pipe), "-q")
    os.close(writer)
    assert done.returncode == 2
    assert "an onboard log is read twice" in done.stderr
