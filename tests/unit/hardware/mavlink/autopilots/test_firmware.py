from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.autopilots.ardupilot import FIRMWARE
from mav_robot_status.hardware.mavlink.autopilots.firmware import Firmware, of_number, of_text
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.mavlink.definitions import AutopilotVersion

from ..driver import PLANE, Flight, copter, px4, rover

V456 = AutopilotVersion(0x040506FF)
BANNER = "ArduCopter V4.5.6 (2e4ab5e2)"


@pytest.mark.parametrize(
    ("number", "shown"),
    [
        (0x040506FF, "4.5.6"),
        (0x04070000, "4.7.0-dev"),
        (0x01100040, "1.16.0-alpha"),
        (0x04050080, "4.5.0-beta"),
        (0x010F00C0, "1.15.0-rc"),
        (0x000900FF, "0.9.0"),
    ],
)
def test_the_number_of_autopilot_version_has_three_numbers_and_a_stage(number: int, shown: str) -> None:
    assert str(of_number(number)) == shown


@pytest.mark.parametrize("number", [0, 255, 0x0000FFFF])
def test_a_build_without_a_version_has_none(number: int) -> None:
    assert of_number(number) is None


@pytest.mark.parametrize(
    ("text", "family", "shown"),
    [
        (BANNER, Family.COPTER, "4.5.6"),
        ("ArduRover V4.5.6 (12345678)", Family.ROVER, "4.5.6"),
        ("APMrover2 V3.5.2 (12345678)", Family.ROVER, "3.5.2"),
        ("ArduPlane V4.4.0-beta2 (12345678)", Family.PLANE, "4.4.0-beta"),
        ("ArduSub V4.7.0-dev (12345678)", Family.SUB, "4.7.0-dev"),
        ("ArduCopter V3.3-rc9 (12345678)", Family.COPTER, "3.3.0-rc"),
        ("AntennaTracker V4.5.6", Family.TRACKER, "4.5.6"),
    ],
)
def test_the_text_of_a_boot_names_the_version(text: str, family: Family, shown: str) -> None:
    assert str(of_text(text, FIRMWARE, family)) == shown


@pytest.mark.parametrize(
    "text",
    ["ArduRover V4.5.6 (12345678)", "ArduCopter 4.5.6", "Frame: QUAD/PLUS", "ArduCopter V4.5.6.7", "", "Other V1.2.3"],
)
def test_a_text_of_another_vehicle_or_form_names_no_version(text: str) -> None:
    assert of_text(text, FIRMWARE, Family.COPTER) is None


def test_a_version_is_at_least_an_older_one() -> None:
    assert Firmware(4, 4) >= (4, 4)
    assert Firmware(4, 3, 9) < (4, 4)


def version(flight: Flight) -> str | None:
    return flight.detail.vehicle.firmware


def test_the_version_is_unknown_until_it_is_told() -> None:
    flight = copter(version=None).hb()
    assert version(flight) is None
    assert version(flight.send(V456)) == "4.5.6"


def test_a_text_tells_the_version_of_the_vehicle_that_it_names() -> None:
    assert version(copter().hb().text(BANNER, 6)) == "4.5.6"
    assert version(rover().hb().text(BANNER, 6)) is None
    assert version(px4().hb().text(BANNER, 6)) is None


def test_a_version_stays_during_a_link_loss_and_is_forgotten_at_a_reboot() -> None:
    flight = copter()
    flight.stream("system_time", flight.system_time)
    flight.wait(3)
    flight.send(V456).stop()
    flight.wait(10)
    assert (flight.detail.link.value, version(flight)) == ("LOST", "4.5.6")
    flight.resume().stream("system_time", flight.system_time)
    flight.wait(3)
    assert version(flight) == "4.5.6"
    flight.reboot().wait(3)
    assert flight.vehicle.boots == 1
    assert version(flight) is None
    assert version(flight.send(V456)) == "4.5.6"


def test_a_version_told_after_the_boot_survives_the_detection_of_that_boot() -> None:
    flight = copter()
    flight.stream("system_time", flight.system_time)
    flight.wait(3.5)
    flight.reboot(uptime_s=0.5)
    flight.text(BANNER, 6).wait(5)
    assert flight.vehicle.boots == 1
    assert version(flight) == "4.5.6"


def test_another_vehicle_with_the_same_ids_has_no_version_yet() -> None:
    flight = copter().hb().send(V456)
    flight.vehicle_type = PLANE
    assert version(flight.hb()) is None


def test_the_version_is_requested_once_and_again_after_a_reboot() -> None:
    flight = copter()
    flight.stream("system_time", flight.system_time)
    flight.wait(60)
    assert sum(ask.command == 512 for ask in flight.asks if hasattr(ask, "command")) == 4  # one, with three retries
    flight.asks.clear()
    flight.reboot().wait(60)
    assert any(getattr(ask, "command", 0) == 512 and ask.param1 == 148 for ask in flight.asks)
