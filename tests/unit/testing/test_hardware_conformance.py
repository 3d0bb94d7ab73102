"""The conformance tests of hardware interfaces, on MAVLink and on a third-party interface."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import closing

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.config import Config, LinkConfig, VehicleConfig
from mav_robot_status.gateway.guards.hardware import GuardedHardware
from mav_robot_status.gateway.mavlink_hardware import MavlinkHardware, robot_hw
from mav_robot_status.hardware.combined import CombinedRobotHW
from mav_robot_status.interface import HardwareContext, HardwareInterface, RobotHW, RobotMode, RobotStatus, TriState
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.testing.conformance.hardware import START, Driver, HardwareConformance
from tests.examples.line_robot import LineRobotHW

from ...ports import free_port


class Sender:
    """A robot that sends datagrams to a local port."""

    def __init__(self) -> None:
        self.port = free_port()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def make(self, *, replay: bool = False) -> HardwareInterface:
        return LineRobotHW(HardwareContext("arm", {"port": self.port}, replay))

    def speak(self) -> None:
        self.send(b"mode=auto powered=1 moving=0 stopped=0")

    def send(self, data: bytes) -> None:
        self._socket.sendto(data, ("127.0.0.1", self.port))

    def close(self) -> None:
        self._socket.close()


class Rover(Sender):
    """A MAVLink vehicle."""

    def make(self, *, replay: bool = False) -> HardwareInterface:
        config = Config((LinkConfig(f"udpin:127.0.0.1:{self.port}"),), vehicles=(VehicleConfig(1, None, "rover"),))
        return robot_hw(config) if replay else MavlinkHardware(config, lambda: START)

    def speak(self) -> None:
        self.send(encode(Heartbeat(0, 10, 3, 65, 4, 3), system=1, component=1, sequence=0))


class Both(Sender):
    """A third-party robot as in the gateway: under guard, and combined with another one."""

    def make(self, *, replay: bool = False) -> HardwareInterface:
        hardware = LineRobotHW(HardwareContext("arm", {"port": self.port}, replay))
        return CombinedRobotHW([RobotHW(), GuardedHardware(hardware, "arm", lambda: START.mono - 1.0)])


class TestLineRobot(HardwareConformance):
    @pytest.fixture
    def robot(self) -> Iterator[Sender]:
        with closing(Sender()) as robot:
            yield robot


class TestMavlink(HardwareConformance):
    @pytest.fixture
    def robot(self) -> Iterator[Rover]:
        with closing(Rover()) as robot:
            yield robot


class TestCombinedAndGuarded(HardwareConformance):
    @pytest.fixture
    def robot(self) -> Iterator[Both]:
        with closing(Both()) as robot:
            yield robot


# -- the tests can fail ------------------------------------------------------------------------------------------------


class Forgetful(LineRobotHW):
    """Does not set `changed`."""

    def read(self, now: Instant) -> None:
        super().read(now)
        self.changed = False


class NeverStale(LineRobotHW):
    """Never detects that the robot is silent."""

    def read(self, now: Instant) -> None:
        if self._robot.heard_at is not None:
            super().read(Instant(self._robot.heard_at, now.unix_us))


class Contradictory(LineRobotHW):
    """Reports powered drives during an e-stop."""

    def read(self, now: Instant) -> None:
        super().read(now)
        if self._robot.status.mode is RobotMode.AUTO:
            self.set_status(self._robot, RobotStatus(RobotMode.AUTO, TriState.TRUE, TriState.TRUE))


class Restless(LineRobotHW):
    """Is always due."""

    def next_due(self, until: float = 0.0) -> float:
        return float("-inf")


@pytest.mark.parametrize(
    ("kind", "test"),
    [
        (Forgetful, HardwareConformance.test_data_from_the_robot_changes_a_handle),
        (NeverStale, HardwareConformance.test_a_robot_that_falls_silent_becomes_unknown),
        (Contradictory, HardwareConformance.test_data_from_the_robot_changes_a_handle),
        (Restless, HardwareConformance.test_next_due_does_not_keep_the_processor_busy),
    ],
)
def test_an_interface_that_breaks_a_rule_fails_its_test(kind: type[LineRobotHW], test: object) -> None:
    with closing(Sender()) as robot:
        hardware = kind(HardwareContext("arm", {"port": robot.port}))
        with closing(hardware), pytest.raises((AssertionError, pytest.fail.Exception)):
            test(HardwareConformance(), Driver(hardware), robot)  # type: ignore[operator]
