"""`UrRobotHW` on real sockets, against the fake controller."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator

import pytest

from mav_robot_status.clock import later
from mav_robot_status.errors import UsageError
from mav_robot_status.hardware.tcp_arm import SILENCE
from mav_robot_status.hardware.ur.interface import ANSWER, UrRobotHW
from mav_robot_status.hardware.ur.rtde import LONGEST
from mav_robot_status.interface import HardwareContext, HardwareInterface, LinkState, RobotMode, RobotStatus, TriState
from mav_robot_status.testing.conformance.hardware import Driver, HardwareConformance, Robot
from mav_robot_status.testing.fake_arm import FakeArm

PATIENCE = 20.0  # s


class Controller:
    """The fake controller, for the conformance tests."""

    def __init__(self) -> None:
        self.arm = FakeArm()

    def make(self, *, replay: bool = False) -> HardwareInterface:
        ports = {"port": self.arm.port, "dashboard_port": self.arm.dashboard_port}
        return UrRobotHW(HardwareContext("arm", {"host": "127.0.0.1", **ports}, replay))

    def speak(self) -> None:
        """It speaks by itself."""

    def send(self, data: bytes) -> None:
        self.arm.garbage = data


@pytest.fixture
def controller() -> Iterator[Controller]:
    controller = Controller()
    yield controller
    controller.arm.close()


@pytest.fixture
def driver(controller: Controller) -> Iterator[Driver]:
    hardware = controller.make()
    yield Driver(hardware)
    hardware.close()


class TestUr(HardwareConformance):
    @pytest.fixture
    def robot(self, controller: Controller) -> Robot:
        return controller


def status_of(driver: Driver) -> RobotStatus:
    (handle,) = driver.hardware.handles
    return handle.status


def wait_for(driver: Driver, reached: Callable[[RobotStatus], bool]) -> RobotStatus:
    """Turn the hardware interface, with its clock beside the real one, until the status is so."""
    deadline = time.monotonic() + PATIENCE
    while not reached(status_of(driver)):
        assert time.monotonic() < deadline, status_of(driver)
        driver.turn(0.05)
        driver.receive(0.05)
    return status_of(driver)


def test_the_whole_status_of_a_running_arm(driver: Driver, controller: Controller) -> None:
    controller.arm.run_program(moving=True)
    status = wait_for(driver, lambda s: s.in_motion is TriState.TRUE and s.mode is RobotMode.AUTO)
    assert (status.e_stopped, status.drives_powered, status.motion_possible) == (0, 1, 1)
    controller.arm.press_emergency_stop()
    status = wait_for(driver, lambda s: s.e_stopped is TriState.TRUE)
    assert (status.drives_powered, status.motion_possible) == (0, 0)


def test_a_controller_that_falls_silent_is_lost_and_comes_back(driver: Driver, controller: Controller) -> None:
    wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)
    controller.arm.silent = True
    wait_for(driver, lambda s: s == RobotStatus())
    (handle,) = driver.hardware.handles
    assert handle.detail.link is LinkState.LOST
    assert [inhibit.name for inhibit in handle.detail.inhibits] == ["LINK_STALE"]
    controller.arm.silent = False
    wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)


def test_a_controller_that_reboots_is_asked_again(driver: Driver, controller: Controller) -> None:
    wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)
    controller.arm.drop_clients()
    controller.arm.robot_mode, controller.arm.robot_bits = 2, 0
    wait_for(driver, lambda s: s.drives_powered is TriState.FALSE)


def test_what_waited_while_the_gateway_was_stopped_says_nothing_about_now(
    driver: Driver, controller: Controller
) -> None:
    wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)
    controller.arm.press_emergency_stop()
    driver.now = later(driver.now, 60.0)
    assert driver.receive(PATIENCE)
    driver.hardware.read(driver.now)
    assert status_of(driver) == RobotStatus()
    wait_for(driver, lambda s: s.e_stopped is TriState.TRUE)


def test_a_frame_that_never_ends_costs_a_few_seconds(
    driver: Driver, controller: Controller, caplog: pytest.LogCaptureFixture
) -> None:
    wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)
    controller.arm.garbage = LONGEST.to_bytes(2, "big") + b"U"
    wait_for(driver, lambda s: s == RobotStatus())
    lost_at = driver.now.mono
    wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)
    assert driver.now.mono - lost_at < SILENCE
    assert caplog.messages == ["arm: values did not arrive within 3 s"]


def test_a_controller_that_does_not_know_a_value_leaves_its_field_unknown(
    driver: Driver, controller: Controller, caplog: pytest.LogCaptureFixture
) -> None:
    controller.arm.unknown = frozenset({"safety_status_bits"})
    status = wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)
    assert (status.e_stopped, status.motion_possible, status.in_error) == (-1, -1, -1)
    assert caplog.text.count("arm: the controller does not know safety_status_bits") == 1


def test_a_controller_that_drops_what_follows_a_question_is_heard(driver: Driver, controller: Controller) -> None:
    controller.arm.drops_what_follows = True
    wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)
    (handle,) = driver.hardware.handles
    assert handle.detail.vehicle.firmware == "5.11.1"


def test_a_controller_that_does_not_tell_its_version_is_heard_after_a_second(
    driver: Driver, controller: Controller
) -> None:
    controller.arm.tells_version = False
    began = driver.now.mono
    wait_for(driver, lambda s: s.drives_powered is TriState.TRUE)
    assert ANSWER <= driver.now.mono - began < SILENCE
    (handle,) = driver.hardware.handles
    assert handle.detail.vehicle.firmware is None


def test_an_old_controller_gets_one_line(
    driver: Driver, controller: Controller, caplog: pytest.LogCaptureFixture
) -> None:
    controller.arm.speaks_version_2 = False
    deadline = time.monotonic() + PATIENCE
    while "does not speak RTDE version 2" not in caplog.text:
        assert time.monotonic() < deadline
        driver.turn(0.05)
        driver.receive(0.05)
    for _ in range(20):
        driver.turn(0.05)
        driver.receive(0.02)
    assert caplog.text.count("does not speak RTDE version 2") == 1
    assert status_of(driver) == RobotStatus()


def test_a_controller_without_a_dashboard_server_has_the_assumed_mode(controller: Controller) -> None:
    with socket.create_server(("127.0.0.1", 0)) as closed:
        nobody = closed.getsockname()[1]
    options = {"host": "127.0.0.1", "port": controller.arm.port, "dashboard_port": nobody, "assume_mode": "auto"}
    hardware = UrRobotHW(HardwareContext("arm", options))
    try:
        assert wait_for(Driver(hardware), lambda s: s.drives_powered is TriState.TRUE).mode is RobotMode.AUTO
    finally:
        hardware.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "ur: the option 'host' is missing: the controller"),
        ({"host": "x", "prot": 1}, "ur: unknown option 'prot'; did you mean 'port'?"),
        ({"host": "x", "port": 0}, "ur: port: must be a number from 1 to 65535, not 0"),
        ({"host": "x", "assume_mode": "car"}, "ur: assume_mode: must be one of none, auto, manual, not 'car'"),
    ],
)
def test_a_wrong_option_is_one_line(options: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError) as caught:
        UrRobotHW(HardwareContext("arm", options))
    assert str(caught.value) == message
