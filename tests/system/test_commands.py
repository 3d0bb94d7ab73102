"""The other commands: demo, check-config, dialect."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.demo import run_demo

from .gateway_process import Gateway, run

ROOT = Path(__file__).parents[2]


def test_the_demo_plays_to_its_end(tmp_path: Path, validate: Callable[[Any], None]) -> None:
    with open(tmp_path / "lines", "w+", encoding="utf-8") as stdout:
        run_demo(stdout, speed=12.0)
        stdout.seek(0)
        statuses = [json.loads(line) for line in stdout]
    for status in statuses:
        validate(status)
    assert [s["drives_powered"] for s in statuses if s["mode"] == "AUTO"].count(True) > 0
    assert any(s["in_error"] for s in statuses)
    assert 5 < len(statuses) < 60


def test_the_demo_starts_at_once_and_sigint_ends_it(gateway: Callable[..., Gateway]) -> None:
    gate = gateway("demo")
    line = gate.wait_for_lines(1)
    assert line.status["vehicle"]["type"] == "GROUND_ROVER"
    assert line.status["drives_powered"] is False  # the story arms the rover 8.5 s after its begin
    gate.wait_for_log(r" 0\.0 s  power on")
    assert gate.stop(signal.SIGINT) == 0
    assert not any("Traceback" in text for text in gate.log)


@pytest.mark.parametrize("path", sorted((ROOT / "config").glob("*.yaml")), ids=lambda path: path.name)
def test_every_example_configuration_is_valid(path: Path) -> None:
    done = run("check-config", str(path))
    assert (done.returncode, done.stderr) == (0, "")
    assert "link: " in done.stdout
    assert "controller " in done.stdout


def test_check_config_gives_the_place_of_an_error(tmp_path: Path) -> None:
    config = tmp_path / "faulty.yaml"
    config.write_text("links: [udp:127.0.0.1:14550]\nhardware:\n  heartbeat_timeuot: 3\n")
    done = run("check-config", str(config))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"mav-robot-status: {config}:3:3: ")
    assert "heartbeat_timeout" in done.stderr


def test_check_config_does_not_wait_for_a_pipe(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    done = run("check-config", str(pipe))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"mav-robot-status: {pipe}: this is a pipe: a configuration is a file, or /dev/stdin\n"
    piped = run("check-config", "/dev/stdin", input="links: [udp:127.0.0.1:14550]\n")
    assert piped.returncode == 0


def test_dialect_writes_xml_and_lua(tmp_path: Path) -> None:
    done = run("dialect", "-o", str(tmp_path / "new"))
    assert done.returncode == 0
    xml, lua = (Path(line) for line in done.stdout.splitlines())
    assert xml.read_bytes() == (ROOT / "dialects" / "mav_robot_status.xml").read_bytes()
    assert "59900" in lua.read_text("utf-8")
    assert "ROBOT_STATUS" in lua.read_text("utf-8")


def test_dialect_says_where_it_cannot_write(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    done = run("dialect", "-o", str(tmp_path / "file" / "folder"))
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
