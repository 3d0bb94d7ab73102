from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.identity import AIRCRAFT, Family, family_of, is_autopilot
from mav_robot_status.mavlink.definitions import Heartbeat


def speaker(vehicle_type: int, autopilot: int) -> Heartbeat:
    return Heartbeat(0, vehicle_type, autopilot, 0, 3, 3)


@pytest.mark.parametrize("vehicle_type", [1, 2, 10, 11, 12, 5, 7, 19, 45])
@pytest.mark.parametrize("autopilot", [0, 3, 9, 12, 20])
def test_a_vehicle_is_an_autopilot_with_any_component_id(vehicle_type: int, autopilot: int) -> None:
    assert is_autopilot(speaker(vehicle_type, autopilot), 1)
    assert is_autopilot(speaker(vehicle_type, autopilot), 5)


@pytest.mark.parametrize(
    "vehicle_type", [6, 18, 26, 27, 30, 31, 32, 33, 34, 36, 37, 38, 39, 40, 41, 42, 44, 48, 49]
)  # fmt: skip
def test_a_ground_station_or_peripheral_is_not_an_autopilot_even_with_an_autopilot_number(vehicle_type: int) -> None:
    assert not is_autopilot(speaker(vehicle_type, 3), 1)


@pytest.mark.parametrize("autopilot", [1, 8])
def test_a_component_with_autopilot_invalid_is_not_an_autopilot(autopilot: int) -> None:
    assert not is_autopilot(speaker(2, autopilot), 1)


def test_a_generic_type_counts_only_from_component_1() -> None:
    assert is_autopilot(speaker(0, 12), 1)
    assert not is_autopilot(speaker(0, 12), 50)


def test_every_type_has_the_family_of_its_mode_table() -> None:
    families = {
        Family.COPTER: [2, 3, 4, 13, 14, 15, 29, 35, 43],
        Family.PLANE: [1, 16, 19, 20, 21, 22, 23, 24, 25],
        Family.ROVER: [10, 11, 46],
        Family.SUB: [12],
        Family.TRACKER: [5],
        Family.BLIMP: [7],
    }
    known = {number: family for family, numbers in families.items() for number in numbers}
    assert {number: family_of(number) for number in range(256)} == {
        number: known.get(number, Family.OTHER) for number in range(256)
    }


def test_aircraft_are_the_powered_flying_types() -> None:
    assert sorted(AIRCRAFT) == [1, 2, 3, 4, 7, 13, 14, 15, 16, *range(19, 26), 29, 35, 43]
