"""`SimpleMessageRobotHW` on real sockets, against a server whose bytes the test chooses."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import pytest

from mav_robot_status.clock import later
from mav_robot_status.errors import UsageError
from mav_robot_status.hardware.simple_message.interface import SimpleMessageRobotHW
from mav_robot_status.hardware.tcp_arm import SILENCE
from mav_robot_status.interface import HardwareContext, HardwareInterface, LinkState, RobotMode, RobotStatus, TriState
from mav_robot_status.simple_message import LONGEST_LENGTH, StatusEncoder
from mav_robot_status.testing.conformance.hardware import Driver, HardwareConformance, Robot
from tests.unit.hardware.controller import TcpController

PATIENCE = 20.0  # s
RUNNING = RobotStatus(RobotMode.AUTO, TriState.FALSE, TriState.TRUE, TriState.TRUE, TriState.TRUE, TriState.FALSE, 0)


class Controller(TcpController):
    """Sends statuses."""

    def __init__(self, byte_order: str = "little") -> None:
        super().__init__()
        self.byte_order = byte_order

    def make(self, *, replay: bool = False) -> HardwareInterface:
        options = {"host": "127.0.0.1", "port": self.port, "byte_order": self.byte_order}
        return SimpleMessageRobotHW(HardwareContext("arm", options, replay))

    def speak(self, status: RobotStatus = RUNNING) -> None:
        self.send(StatusEncoder(self.byte_order).encode(status))


@pytest.fixture
def controller() -> Iterator[Controller]:
    controller = Controller()
    yield controller
    controller.close()


@pytest.fixture
def driver(controller: Controller) -> Iterator[Driver]:
    hardware = controller.make()
    yield Driver(hardware)
    hardware.close()


class TestSimpleMessage(HardwareConformance):
    @pytest.fixture
    def robot(self, controller: Controller) -> Robot:
        return controller


def status_of(driver: Driver) -> RobotStatus:
    (handle,) = driver.hardware.handles
    return handle.status


def wait_for(
    driver: Driver, reached: Callable[[RobotStatus], bool], speak: Callable[[], None] = lambda: None
) -> RobotStatus:
    """Turn the hardware interface until the status is so."""
    deadline = time.monotonic() + PATIENCE
    while not reached(status_of(driver)):
        assert time.monotonic() < deadline, status_of(driver)
        speak()
        driver.turn(0.1)
        driver.receive(0.02)
    return status_of(driver)


@pytest.mark.parametrize("byte_order", ["little", "big"])
def test_the_status_is_that_of_the_frame_in_either_byte_order(byte_order: str) -> None:
    controller = Controller(byte_order)
    hardware = controller.make()
    try:
        assert wait_for(Driver(hardware), lambda s: s != RobotStatus(), controller.speak) == RUNNING
    finally:
        hardware.close()
        controller.close()


def test_a_frame_that_is_older_than_three_seconds_is_unknown(driver: Driver, controller: Controller) -> None:
    wait_for(driver, lambda s: s == RUNNING, controller.speak)
    (handle,) = driver.hardware.handles
    assert handle.heard_at is not None
    driver.turn(SILENCE - (driver.now.mono - handle.heard_at) - 0.01)
    assert handle.status == RUNNING
    due = driver.hardware.next_due()
    driver.turn(due - driver.now.mono)
    assert (handle.status, handle.detail.link) == (RobotStatus(), LinkState.LOST)
    assert [inhibit.name for inhibit in handle.detail.inhibits] == ["LINK_STALE"]
    wait_for(driver, lambda s: s == RUNNING, controller.speak)


def test_what_waited_while_the_gateway_was_stopped_says_nothing_about_now(
    driver: Driver, controller: Controller
) -> None:
    wait_for(driver, lambda s: s == RUNNING, controller.speak)
    controller.speak(RUNNING._replace(drives_powered=TriState.FALSE, motion_possible=TriState.FALSE))
    driver.now = later(driver.now, 60.0)
    assert driver.receive(PATIENCE)
    driver.hardware.read(driver.now)
    assert status_of(driver) == RobotStatus()
    wait_for(driver, lambda s: s == RUNNING, controller.speak)


def test_a_frame_that_never_ends_costs_a_few_seconds(
    driver: Driver, controller: Controller, caplog: pytest.LogCaptureFixture
) -> None:
    wait_for(driver, lambda s: s == RUNNING, controller.speak)
    controller.send(LONGEST_LENGTH.to_bytes(4, "little") + b"\r\0\0\0" + b"\1\0\0\0")
    wait_for(driver, lambda s: s == RobotStatus())
    wait_for(driver, lambda s: s == RUNNING, controller.speak)
    assert caplog.messages == ["arm: no status arrived within 3 s"]


def test_garbage_is_one_line(driver: Driver, controller: Controller, caplog: pytest.LogCaptureFixture) -> None:
    deadline = time.monotonic() + PATIENCE
    while not caplog.messages:
        assert time.monotonic() < deadline
        controller.send(b"220 FTP server ready\r\n")
        driver.turn(0.1)
        driver.receive(0.02)
    for _ in range(30):
        controller.send(b"500 what?\r\n500 what?\r\n")
        driver.turn(0.1)
        driver.receive(0.01)
    (line,) = caplog.messages
    assert line == "arm: this is not simple_message; it begins with 32 32 30 20 46 54 50 20 73 65 72 76"
    assert status_of(driver) == RobotStatus()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "simple_message: the option 'host' is missing: the controller, or another gateway"),
        ({"host": "x", "order": "big"}, "simple_message: unknown option 'order'; did you mean 'byte_order'?"),
        ({"host": "x", "port": 70000}, "simple_message: port: must be a number from 1 to 65535, not 70000"),
        ({"host": "x", "byte_order": "b"}, "simple_message: byte_order: must be one of little, big, not 'b'"),
    ],
)
def test_a_wrong_option_is_one_line(options: dict[str, object], message: str) -> None:
    with pytest.raises(UsageError) as caught:
        SimpleMessageRobotHW(HardwareContext("arm", options))
    assert message in str(caught.value)
