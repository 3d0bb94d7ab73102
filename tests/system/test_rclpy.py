"""ROS 2 itself hears the gateway over DDS: rclpy of two distributions, which `.ci/run` installs from the registry."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import pytest

from mav_robot_status.testing.fake_arm import FakeArm

from ..deadline import SOON, allow, wait_until
from .gateway_process import Gateway, run
from .ros2_network import NO_DDS, Program

ROOT: Final = Path(__file__).parents[2]
DISTRIBUTIONS: Final = ("jazzy", "kilted")
WORKER: Final = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
DOMAIN: Final = 83 + WORKER
"""One for each process of tests: they hear one another."""
QUIET: Final = 113 + WORKER
"""A domain for captures. Its ports begin at 7400 + 250 * QUIET."""
SUBSCRIBER: Final = str(Path(__file__).with_name("rclpy_subscriber.py"))
LONG: Final = "60"
"""Seconds after which a forgotten subscriber ends."""
Start = Callable[..., Any]


def python_of(distribution: str) -> Path:
    return ROOT / "build" / f"ros-{distribution}" / "bin" / "python"


def is_installed(distribution: str) -> bool:
    """Whether its installation is complete."""
    packages = ROOT / "build" / f"ros-{distribution}" / "lib" / "python3.11" / "site-packages"
    return all((packages / name).exists() for name in ("rclpy", "diagnostic_msgs"))


def reason(distribution: str) -> str:
    return NO_DDS or f"ros-{distribution}-rclpy is not installed in build/ros-{distribution}: .ci/run does that"


BOTH = pytest.mark.parametrize(
    "distribution",
    [
        pytest.param(name, marks=pytest.mark.skipif(not is_installed(name) or NO_DDS is not None, reason=reason(name)))
        for name in DISTRIBUTIONS
    ],
)
pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def _on_this_computer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    monkeypatch.setenv("RMW_IMPLEMENTATION", "rmw_fastrtps_cpp")
    for name in ("CYCLONEDDS_URI", "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def arm() -> Iterator[FakeArm]:
    with FakeArm() as arm:
        yield arm


@pytest.fixture
def robot(gateway: Start, arm: FakeArm) -> Gateway:
    """A gateway with an arm, on the domain of the environment."""
    running: Gateway = gateway("--arm", f"ur:127.0.0.1:{arm.port}", "--ros2", "dds://")
    running.wait_for(lambda line: line["handle"] == "arm" and line["motion_possible"] is True)
    return running


@pytest.fixture
def subscriber(ended: contextlib.ExitStack) -> Start:
    def started(distribution: str, *arguments: str) -> Program:
        command = (str(python_of(distribution)), SUBSCRIBER, LONG)
        environment = {name: os.environ[name] for name in os.environ if name != "CYCLONEDDS_URI"}
        made = Program(*arguments, command=command, environment=environment)
        return ended.enter_context(contextlib.closing(made))

    return started


def of_the_arm(one: dict[str, Any]) -> bool:
    return one.get("hardware_id") == "arm"


@BOTH
@pytest.mark.parametrize("variable", ["ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY", None])
def test_it_hears_right_messages(
    distribution: str,
    variable: str | None,
    gateway: Start,
    arm: FakeArm,
    subscriber: Start,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    if variable != "ROS_AUTOMATIC_DISCOVERY_RANGE":
        monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "SUBNET")
    if variable == "ROS_LOCALHOST_ONLY":
        if distribution != "jazzy":
            pytest.skip("Kilted has dropped ROS_LOCALHOST_ONLY")
        monkeypatch.setenv(variable, "1")
    running = gateway("--arm", f"ur:127.0.0.1:{arm.port}", "--ros2", f"dds://{DOMAIN}")
    viewer = subscriber(distribution)
    wait_until(lambda: len([one for one in viewer.diagnostics if of_the_arm(one)]) >= 5, 20)
    said = viewer.wait_for(lambda one: of_the_arm(one) and one["level"] == 0)
    assert (said["message"], said["values"]["drives_powered"]) == ("MOTION POSSIBLE", "TRUE")
    arm.press_emergency_stop()
    said = viewer.wait_for(lambda one: of_the_arm(one) and one["level"] == 2)
    assert said["message"].startswith("EMERGENCY STOP: E_STOPPED")
    group = viewer.wait_for(lambda one: one.get("hardware_id") == "robot" and one["level"] == 2)
    assert group["values"]["not ready arm"] == "E_STOPPED"
    assert running.stop() == 0


@BOTH
def test_a_gateway_that_is_killed_is_noticed(distribution: str, robot: Gateway, subscriber: Start) -> None:
    viewer = subscriber(distribution, "DiagnosticArray", "watched")
    viewer.wait_for(of_the_arm, 20)
    robot.stop(signal.SIGKILL)
    viewer.wait_for(lambda one: one.get("event") == "deadline missed", 5)
    viewer.wait_for(lambda one: one.get("event") == "liveliness" and one["alive"] == 0, 5)


@BOTH
def test_a_late_subscriber_gets_the_last_status_once_at_rate_0(
    distribution: str, gateway: Start, subscriber: Start, tmp_path: Path
) -> None:
    file = tmp_path / "rover.yaml"
    file.write_text(
        "links: ['udp:127.0.0.1:0']\nvehicles: [{system: 1, handle: rover}]\n"
        "robot_status_controller:\n  type: mav_robot_status/IndustrialRobotStatusController\n"
        "  handle_name: rover\n  publishers: [json, {type: ros2, url: 'dds://', rate: 0}]\n"
    )
    running = gateway("--config", str(file))
    running.wait_for_log(f"DDS domain {DOMAIN} .LOCALHOST.: connected")
    running.wait_for(lambda line: line["handle"] == "rover")
    viewer = subscriber(distribution, "DiagnosticArray", "late")
    viewer.wait_for(lambda one: "level" in one, 20)
    time.sleep(1.0)  # nothing more comes
    assert [one["level"] for one in viewer.diagnostics] == [3]


@BOTH
@pytest.mark.parametrize(
    ("arguments", "cause", "why"),
    [
        (("DiagnosticArray",), "ros2-ok", ""),
        (("DiagnosticStatus",), "ros2-not-matched", "its type is diagnostic_msgs::msg::dds_::DiagnosticStatus_"),
        (("DiagnosticArray", "strict"), "ros2-not-matched", "it wants another deadline"),
    ],
)
def test_doctor_and_the_log_say_who_cannot_hear(
    distribution: str, robot: Gateway, subscriber: Start, arguments: tuple[str, ...], cause: str, why: str
) -> None:
    subscriber(distribution, *arguments)
    done = run("doctor", "--ros2", "dds://", "--as-json")
    found = json.loads(done.stdout)
    assert (found["cause"], found["ok"], done.returncode) == (cause, not why, bool(why))
    (one,) = found["subscriptions"]
    assert one["matched"] is not bool(why)
    assert one["why"].startswith(why)
    told = f"ros2: a subscriber of /diagnostics hears nothing: {why}"
    if why:
        wait_until(lambda: any(told in line for line in robot.log))
        time.sleep(2.5)  # two looks more
    assert sum("hears nothing" in line for line in robot.log) == bool(why)


@pytest.mark.skipif(shutil.which("tshark") is None or os.geteuid() != 0, reason="tshark and root are needed to capture")
@pytest.mark.skipif(NO_DDS is not None, reason=str(NO_DDS))
@pytest.mark.parametrize("variable", ["ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY", None])
def test_with_localhost_nothing_leaves_the_computer(
    variable: str | None, gateway: Start, monkeypatch: pytest.MonkeyPatch
) -> None:
    if variable != "ROS_AUTOMATIC_DISCOVERY_RANGE":
        monkeypatch.delenv("ROS_AUTOMATIC_DISCOVERY_RANGE")
    if variable == "ROS_LOCALHOST_ONLY":
        monkeypatch.setenv(variable, "1")
    first = 7400 + 250 * QUIET
    ports = f"udp and dst portrange {first}-{first + 249} and not dst net 127.0.0.0/8"
    capture = ["tshark", "-l", "-q", "-i", "any", "-f", ports, "-a", "duration:6", "-T", "fields", "-e", "ip.dst"]
    with subprocess.Popen([*capture, "-P"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as tshark:
        assert tshark.stderr is not None
        wait_until(lambda: "Capturing" in tshark.stderr.readline())  # type: ignore[union-attr]
        running = gateway("udp:127.0.0.1:0", "--system", "1", "--ros2", f"dds://{QUIET}")
        running.wait_for_log("connected")
        out, _ = tshark.communicate(timeout=allow(SOON + 6))
    assert (out == "") is (variable is not None)
