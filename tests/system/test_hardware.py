"""A hardware interface of another package in the installed command: alone, beside MAVLink, broken, and reloaded."""

from __future__ import annotations

import contextlib
import json
import re
import signal
import socket
import threading
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.testing import FakeAutopilot, ardurover

from ..deadline import SOON, allow, in_time, wait_until
from ..ports import free_port
from .gateway_process import Gateway, run
from .mqtt_broker import MISSING, Broker, Listener
from .wire import Wire

EXAMPLE = Path(__file__).parents[1] / "examples" / "line_robot.py"
ENTRY_POINTS = """\
[mav_robot_status.hardware]
line_robot = line_robot:LineRobotHW
faulty = faulty_robot:FaultyRobotHW
"""
FAULTY = """\
import time
from line_robot import LineRobotHW

class FaultyRobotHW(LineRobotHW):
    def __init__(self, context):
        super().__init__(context)
        self._robot.heard_at = 0.0

    def read(self, now):
        super().read(now)
        if self._line.get("mode") == "crash":
            raise ZeroDivisionError("as third parties do")
        if self._line.get("mode") == "sleep":
            time.sleep(0.5)

    def next_due(self, until=0.0):
        return float("-inf")
"""
ARM = "industrial arm"
CONFIG = """\
hardware:
  - {{type: line_robot, name: {name}, port: {port}}}
"""


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """As if a package with the example were installed."""
    place = tmp_path / "site"
    info = place / "line_robot-1.0.dist-info"
    info.mkdir(parents=True)
    (place / "line_robot.py").write_text(EXAMPLE.read_text())
    (place / "faulty_robot.py").write_text(FAULTY)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: line-robot\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(ENTRY_POINTS)
    monkeypatch.setenv("PYTHONPATH", str(place))
    return place


class Arm:
    """A robot that sends its line to a port."""

    def __init__(self) -> None:
        self.port = free_port()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def say(self, line: str = "mode=auto powered=1 moving=0 stopped=0") -> float:
        self._socket.sendto(line.encode(), ("127.0.0.1", self.port))
        return time.monotonic()

    @contextlib.contextmanager
    def saying(self) -> Iterator[None]:
        """It says its line ten times a second."""
        ended = threading.Event()

        def speak() -> None:
            while not ended.wait(0.1):
                self.say()

        thread = threading.Thread(target=speak)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def arm() -> Iterator[Arm]:
    with contextlib.closing(Arm()) as made:
        yield made


@pytest.fixture
def configured(tmp_path: Path) -> Callable[[str], str]:
    """Write a configuration; its path."""

    def write(text: str) -> str:
        (tmp_path / "config.yaml").write_text(text)
        return str(tmp_path / "config.yaml")

    return write


def of(name: str, **members: Any) -> Callable[[dict[str, Any]], bool]:
    return lambda line: line["handle"] == name and all(line[key] == value for key, value in members.items())


def fetched(url: str) -> str:
    with urllib.request.urlopen(url, timeout=allow(SOON)) as answer:
        return str(answer.read().decode())


def test_alone_it_needs_no_link_and_reaches_the_lines_the_page_and_the_metrics(
    gateway: Callable[..., Gateway], arm: Arm, configured: Callable[[str], str], validate: Callable[[Any], None]
) -> None:
    gate = gateway("--config", configured(CONFIG.format(name="arm", port=arm.port)), "--http", "127.0.0.1:0")
    first = gate.wait_for(of("arm"))
    assert first.status["link"]["state"] == "NEVER_SEEN"
    sent = arm.say()
    seen = gate.wait_for(of("arm", mode="AUTO", drives_powered=True, e_stopped=False, motion_possible=None), after=sent)
    assert in_time(seen.at - sent, 1.0)
    validate(seen.status)
    page = gate.wait_for_log(r"the page is at (http://\S+)/")[1]
    metric = re.compile(r'_in_motion\{.*handle="arm".*\} 0')
    with arm.saying():
        gate.wait_for(of("arm", mode="AUTO"), after=time.monotonic())
        wait_until(lambda: metric.search(fetched(f"{page}/metrics")), what="no metric")
        (shown,) = json.loads(fetched(f"{page}/api/v1/vehicles"))
    assert (shown["handle"], shown["mode"]) == ("arm", "AUTO")
    gate.wait_for(lambda line: line["link"]["state"] == "LOST" and line["mode"] == "UNKNOWN", after=seen.at)
    assert gate.stop() == 0
    assert not any("autopilot" in line for line in gate.log)


@pytest.mark.skipif(MISSING is not None, reason=str(MISSING))
def test_it_reaches_a_broker(
    gateway: Callable[..., Gateway],
    arm: Arm,
    configured: Callable[[str], str],
    ended: contextlib.ExitStack,
    tmp_path: Path,
) -> None:
    broker = ended.enter_context(contextlib.closing(Broker(tmp_path)))
    heard = ended.enter_context(contextlib.closing(Listener(broker.port)))
    path = configured(CONFIG.format(name="arm", port=arm.port))
    gate = gateway("--config", path, "--mqtt", broker.url, "--mqtt-robot", "{handle}")
    gate.wait_for(of("arm"))
    arm.say()
    heard.wait_for(lambda h: (h.robot, h.what) == ("arm", "status") and json.loads(h.text)["mode"] == "AUTO")


def test_beside_mavlink_both_have_their_handles(
    gateway: Callable[..., Gateway],
    arm: Arm,
    configured: Callable[[str], str],
    autopilot: Callable[..., FakeAutopilot],
) -> None:
    text = f"""\
links: ["udpin:127.0.0.1:0"]
hardware:
  - {{type: mavlink, hover_is_motion: false}}
  - {{type: line_robot, name: {ARM}, port: {arm.port}}}
robot_status_controller:
  type: mav_robot_status/IndustrialRobotStatusController
arm_status_controller:
  type: mav_robot_status/IndustrialRobotStatusController
  handle_name: {ARM}
"""
    gate = gateway("--config", configured(text))
    autopilot(ardurover.READY, gate.address)
    gate.wait_for(of(ARM))
    arm.say()
    gate.wait_for(of(ARM, mode="AUTO"))
    gate.wait_for(of("industrial_robot_status_handle", mode="MANUAL"))
    assert gate.stop() == 0


@pytest.mark.parametrize(("mode", "logged"), [("crash", "failed and is stopped"), ("sleep", "a call must not block")])
def test_one_that_fails_or_blocks_leaves_mavlink_alone(
    gateway: Callable[..., Gateway],
    wire: Callable[..., Wire],
    arm: Arm,
    configured: Callable[[str], str],
    mode: str,
    logged: str,
) -> None:
    text = f"links: ['udpin:127.0.0.1:0']\nhardware: [{{type: faulty, name: arm, port: {arm.port}}}]\n"
    gate = gateway("--config", configured(text))
    rover = wire(gate.address).beating()
    gate.wait_for(of("industrial_robot_status_handle", drives_powered=False))
    sent = arm.say(f"mode={mode}")
    gate.wait_for_log(logged)
    if mode == "crash":
        gate.wait_for(lambda s: s["handle"] == "arm" and s["link"]["state"] == "LOST", after=sent)
    for custom_mode, mode in ((10, "AUTO"), (0, "MANUAL"), (10, "AUTO"), (0, "MANUAL")):
        beat = rover.beat(armed=True, custom_mode=custom_mode)
        seen = of("industrial_robot_status_handle", drives_powered=True, mode=mode)
        gate.wait_for(seen, after=beat, seconds=2.0)
    assert sum(logged in line for line in gate.log) == 1
    assert gate.stop() == 0


def test_explain_shows_the_evidence_of_its_handle(arm: Arm, configured: Callable[[str], str]) -> None:
    path = configured(CONFIG.format(name="arm", port=arm.port))
    with arm.saying():
        done = run("explain", "--config", path)
    assert done.returncode == 0, done.stderr
    assert "the robot reports its mode  [mode=auto]" in done.stdout
    assert "mode             AUTO" in done.stdout


def test_a_reload_opens_and_closes_hardware_interfaces(
    gateway: Callable[..., Gateway], arm: Arm, configured: Callable[[str], str]
) -> None:
    gate = gateway("--config", configured(CONFIG.format(name="arm", port=arm.port)))
    gate.wait_for(of("arm"))
    arm.say()
    gate.wait_for(of("arm", mode="AUTO"))
    with contextlib.closing(Arm()) as second:
        both = f"{CONFIG.format(name='arm', port=arm.port)}  - {{type: line_robot, name: lift, port: {second.port}}}\n"
        configured(both)
        gate.process.send_signal(signal.SIGHUP)
        gate.wait_for(of("lift"))
        with arm.saying():
            sent = gate.wait_for(of("arm", mode="AUTO"), after=time.monotonic()).at
            configured(CONFIG.format(name="lift", port=second.port))
            gate.process.send_signal(signal.SIGHUP)
            last = gate.wait_for(of("arm", mode="UNKNOWN"), after=sent)
        assert last.status["inhibits"][0]["text"] == "its hardware interface is no longer configured"
        second.say()
        gate.wait_for(of("lift", mode="AUTO"), after=last.at)
        assert not [line for line in gate.lines if line.status["handle"] == "arm" and line.stamp > last.stamp]
        configured("hardware: [{type: line_robt}]\n")
        gate.process.send_signal(signal.SIGHUP)
        gate.wait_for_log("the configuration stays as it was: .*did you mean 'line_robot'")
        configured(f"{CONFIG.format(name='lift', port=second.port)}  - {{type: line_robot, name: x, port: bad}}\n")
        gate.process.send_signal(signal.SIGHUP)
        gate.wait_for_log("the configuration stays as it was: .*hardware interface 'x' cannot be made: ValueError")
        sent = second.say("mode=manual")
        gate.wait_for(of("lift", mode="MANUAL"), after=sent)
    assert gate.stop() == 0


def test_check_config_says_what_it_means_and_what_is_wrong(configured: Callable[[str], str]) -> None:
    done = run("check-config", configured(CONFIG.format(name="arm", port=5005)))
    assert "hardware: 'arm' of type line_robot (port: 5005)" in done.stdout.splitlines()
    done = run("check-config", configured("hardware: [{type: mavlnk}]\n"))
    assert done.returncode == 2
    assert "config.yaml:1:12: nothing is registered as 'mavlnk' in mav_robot_status.hardware" in done.stderr
    assert "did you mean 'mavlink'?" in done.stderr


def test_a_handle_that_no_hardware_interface_has_is_an_error_that_lists_them(
    arm: Arm, configured: Callable[[str], str]
) -> None:
    controller = "c: {type: mav_robot_status/IndustrialRobotStatusController, handle_name: leg}\n"
    done = run("--config", configured(CONFIG.format(name="arm", port=arm.port) + controller))
    assert done.returncode == 2
    assert "there is no handle 'leg'; registered: 'arm'" in done.stderr


def test_a_log_is_replayed_with_its_handle_unknown(demo_log: Path, arm: Arm, configured: Callable[[str], str]) -> None:
    path = configured(CONFIG.format(name="arm", port=arm.port))
    done = run(str(demo_log), "--config", path)
    assert done.returncode == 0, done.stderr
    states = {(line["handle"], line["mode"]) for line in map(json.loads, done.stdout.splitlines())}
    assert ("arm", "UNKNOWN") in states
    assert ("industrial_robot_status_handle", "AUTO") in states
