"""Every profile is complete, and every autopilot has one."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.hardware.mavlink.autopilots import (
    ARDUPILOT,
    AUTOPILOTS,
    GENERIC,
    INAV,
    PX4,
    Autopilot,
    announced_as,
    shown_by,
)
from mav_robot_status.hardware.mavlink.autopilots import profile as parts
from mav_robot_status.hardware.mavlink.autopilots.texts import classify
from mav_robot_status.hardware.mavlink.faults.causes import CAUSES
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import Detail
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.enumerations import MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS

from ..driver import Flight, check_invariants

PARTS = [
    v for v in vars(parts).values() if isinstance(v, type) and issubclass(v, tuple) and v.__module__ == parts.__name__
]


@pytest.mark.parametrize("part", PARTS, ids=[part.__name__ for part in PARTS])
def test_a_profile_has_no_defaults_so_a_missing_field_fails_at_import(part: Any) -> None:
    assert part._fields
    assert not part._field_defaults
    with pytest.raises(TypeError, match="missing"):
        part()


def test_every_autopilot_number_selects_exactly_one_profile() -> None:
    announced = [number for p in AUTOPILOTS if p.recognition.lacks is None for number in p.recognition.autopilots]
    assert len(announced) == len(set(announced))
    assert [announced_as(number) for number in (3, 12, 0, 255)] == [ARDUPILOT, PX4, GENERIC, GENERIC]


def test_an_ardupilot_without_motor_outputs_in_sys_status_is_inav() -> None:
    assert shown_by(3, 0) is INAV
    assert shown_by(3, MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS) is None
    assert [shown_by(number, 0) for number in (0, 12, 255)] == [None, None, None]


@pytest.mark.parametrize("profile", AUTOPILOTS, ids=[p.name for p in AUTOPILOTS])
def test_a_profile_uses_only_existing_causes_and_families(profile: Autopilot) -> None:
    assert {code for rule in profile.texts.rules for code in rule.codes} <= CAUSES.keys()
    assert set(profile.sensors.weights) <= set(range(31))
    assert set(profile.modes.initialising) <= set(Family)
    assert classify("", profile.texts.rules) is None


@pytest.mark.parametrize("profile", AUTOPILOTS, ids=[p.name for p in AUTOPILOTS])
@pytest.mark.parametrize("vehicle_type", [1, 2, 10, 12, 5, 7, 45])
def test_any_message_of_any_vehicle_gives_a_valid_status(profile: Autopilot, vehicle_type: int) -> None:
    number = min(profile.recognition.autopilots, default=0)
    flight = Flight(number, vehicle_type)
    flight.wait(4)
    flight.hb(armed=True, state=4).text("Motors Emergency Stopped", 1).text("Low battery", 1).event(0x11)
    flight.send(mav.Attitude(0, 0.0, 0.0, 0.5)).send(mav.VfrHud(0.0, 0.0, 50))
    flight.send(mav.LocalPositionNed(0, 0.0, 0.0, 0.0)).send(mav.CommandAck(185, 0, 0, 0, 0, 0))
    flight.wait(2)
    check_invariants(flight.status, flight.detail, HardwareOptions())
    assert flight.detail != Detail()
