"""A rover with an arm on it as one robot: the demo, and the program of the tutorial with the example configuration."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest

from mav_robot_status.testing import decode

from ..ports import free_port
from .gateway_process import Gateway, run

ROOT = Path(__file__).parents[2]
FIELDS: Final = ("mode", "e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")


class Phase(NamedTuple):
    """A status of the group that the story leads to."""

    what: str
    fields: tuple[Any, ...]
    """The values of FIELDS."""

    def reached(self, line: dict[str, Any]) -> bool:
        return line["handle"] == "robot" and tuple(line[name] for name in FIELDS) == self.fields


PHASES: Final = (
    Phase("the base is disarmed", ("MANUAL", False, True, True, False, False)),
    Phase("the base drives", ("AUTO", False, True, True, True, False)),
    Phase("both stand", ("AUTO", False, True, True, False, False)),
    Phase("the arm reaches", ("AUTO", False, True, True, True, False)),
    Phase("the arm is stopped", ("AUTO", None, True, True, False, False)),
    Phase("the base drives with the arm stopped", ("AUTO", None, True, True, True, False)),
    Phase("both stand, the arm stopped", ("AUTO", None, True, True, False, False)),
    Phase("the arm is released", ("AUTO", False, True, True, False, False)),
    Phase("the base is lost, the arm reaches", ("UNKNOWN", None, True, True, True, None)),
    Phase("both are back", ("AUTO", False, True, True, False, False)),
)


@pytest.mark.slow
def test_the_demo_tells_the_story_of_one_robot(
    gateway: Callable[..., Gateway], validate: Callable[[Any], None]
) -> None:
    demo = gateway("demo", "--mobile-manipulator")
    at = 0.0
    for phase in PHASES:
        at = demo.wait_for(phase.reached, after=at, what=phase.what, seconds=30).at
    assert demo.wait_for_end(seconds=30) == 0
    lines = [line.status for line in demo.lines]
    for line in lines:
        validate(line)
    assert {line["handle"] for line in lines} == {"robot", "base", "arm"}
    assert all(line.get("members") == (["base", "arm"] if line["handle"] == "robot" else None) for line in lines)
    assert not [line for line in lines if line["handle"] == "base" and line["e_stopped"]]
    assert not [line for line in lines if line["handle"] == "robot" and line["e_stopped"]], "the base is never stopped"
    stopped = [[one["name"] for one in line["inhibits"]] for line in lines if line["handle"] == "arm"]
    assert ["E_STOPPED", "POWER_OFF"] in stopped


@contextlib.contextmanager
def fakes(folder: Path) -> Iterator[tuple[Path, list[str]]]:
    """The program that plays base and arm on free ports; the example configuration with these ports."""
    base = str(free_port())
    command = [sys.executable, "-m", "mav_robot_status.testing.mobile_manipulator"]
    ports = ["--base", base, "--arm", "0", "--dashboard", "0"]
    with subprocess.Popen([*command, *ports], stdout=subprocess.PIPE, text=True) as program:
        assert program.stdout is not None
        first = program.stdout.readline() + program.stdout.readline()
        found = re.search(r"the arm listens on 127\.0\.0\.1:(\d+), its dashboard on (\d+)", first)
        assert found, first
        text = (ROOT / "config" / "mobile_manipulator.yaml").read_text().replace("14550", base)
        path = folder / "robot.yaml"
        path.write_text(
            text.replace("host: 127.0.0.1", f"host: 127.0.0.1, port: {found[1]}, dashboard_port: {found[2]}")
        )
        told: list[str] = []
        yield path, told
        program.send_signal(signal.SIGINT)
        told += program.stdout.readlines()
        assert program.wait(10) == 0


@pytest.fixture
def station() -> Iterator[socket.socket]:
    """A ground station that listens."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("127.0.0.1", 0))
        udp.setblocking(False)
        yield udp


def subjects(station: socket.socket) -> set[tuple[int, int]]:
    """System and component of everything that the ROBOT_STATUS in its buffer are about."""
    messages = []
    with contextlib.suppress(BlockingIOError):
        while True:
            messages += decode(station.recv(2000))
    statuses = [message for message in messages if message.get_type() == "ROBOT_STATUS"]
    return {(status.subject_system, status.subject_component) for status in statuses}


@pytest.mark.slow
def test_the_program_and_the_example_configuration_make_one_robot(
    gateway: Callable[..., Gateway], tmp_path: Path, station: socket.socket
) -> None:
    with fakes(tmp_path) as (path, told):
        gate = gateway("--config", str(path), "--out", f"udpout:127.0.0.1:{station.getsockname()[1]}")
        assert gate.wait_for(lambda line: line["mode"] == "AUTO" and line["motion_possible"], seconds=30)
        assert {line.status["handle"] for line in gate.lines} == {"robot"}
        assert subjects(station) == {(1, 192)}
        assert gate.stop() == 0
        explained = [
            json.loads(line) for line in run("explain", "--config", str(path), "--as-json").stdout.splitlines()
        ]
        table = run("explain", "--config", str(path)).stdout
    assert told[0].startswith("  0.0 s  ")
    by_handle = {one["handle"]: one for one in explained}
    assert by_handle["robot"]["members"] == ["base", "arm"]
    assert by_handle["robot"]["fields"]["drives_powered"]["rule"].startswith(("base: ", "arm: "))
    assert "members" not in by_handle["arm"]
    assert "group robot (base, arm), CONNECTED" in table
    assert "robot arm (" in table
    assert "vehicle 1.1 (ARDUPILOTMEGA" in table


@pytest.mark.parametrize("port", ["--arm", "--dashboard"])
def test_the_program_says_which_port_is_taken(port: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        number = str(taken.getsockname()[1])
        other = {"--arm": "--dashboard", "--dashboard": "--arm"}[port]
        command = [sys.executable, "-m", "mav_robot_status.testing.mobile_manipulator", port, number, other, "0"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 1
    assert re.fullmatch(rf"mobile_manipulator: ports .*\b{number}\b.*: Address already in use\n", done.stderr)
