"""The example of the how-to for arms passes the conformance tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from mav_robot_status.interface import HardwareContext, HardwareInterface, RobotMode, RobotStatus, TriState
from mav_robot_status.testing.conformance.hardware import Driver, HardwareConformance, Robot
from tests.examples.acme_arm import AcmeRobotHW
from tests.unit.hardware.controller import TcpController


class Acme(TcpController):
    def make(self, *, replay: bool = False) -> HardwareInterface:
        return AcmeRobotHW(HardwareContext("arm", {"host": "127.0.0.1", "port": self.port}, replay))

    def speak(self) -> None:
        self.send(b"auto=1 stopped=0 powered=1 moving=0\n")


@pytest.fixture
def acme() -> Iterator[Acme]:
    acme = Acme()
    yield acme
    acme.close()


class TestAcmeArm(HardwareConformance):
    @pytest.fixture
    def robot(self, acme: Acme) -> Robot:
        return acme


def test_its_line_is_its_status(acme: Acme) -> None:
    hardware = acme.make()
    driver = Driver(hardware)
    driver.wait_for_status(acme)
    (handle,) = hardware.handles
    unknown = TriState.UNKNOWN
    assert handle.status == RobotStatus(RobotMode.AUTO, TriState.FALSE, TriState.TRUE, unknown, TriState.FALSE)
    hardware.close()
