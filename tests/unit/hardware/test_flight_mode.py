from __future__ import annotations

import pytest

from mav_robot_status.hardware.flight_mode import AvailableMode, ModeSources, flight_mode, is_initialising
from mav_robot_status.hardware.identity import Family, Stack
from mav_robot_status.hardware.observation import heard
from mav_robot_status.interface import RobotMode
from mav_robot_status.mavlink.definitions import CurrentMode, Heartbeat

MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN
NOW = 100.0
NOTHING = ModeSources()


def mode_of(
    number: int,
    stack: Stack = Stack.ARDUPILOT,
    family: Family = Family.COPTER,
    sources: ModeSources = NOTHING,
    base_mode: int = 0x51,
) -> tuple[RobotMode, str | None]:
    found = flight_mode(Heartbeat(number, 2, 3, base_mode, 4, 3), stack, family, sources, NOW)
    return found.mode, found.name


def available(number: int, name: str = "", standard_mode: int = 0, properties: int = 0) -> ModeSources:
    return ModeSources({number: AvailableMode(name, standard_mode, properties)})


def px4(main: int, sub: int = 0) -> int:
    return main << 16 | sub << 24


@pytest.mark.parametrize(
    ("family", "number", "expected"),
    [
        (Family.COPTER, 5, (MANUAL, "LOITER")),
        (Family.PLANE, 12, (AUTO, "LOITER")),
        (Family.ROVER, 5, (AUTO, "LOITER")),
        (Family.SUB, 16, (MANUAL, "POSHOLD")),
        (Family.TRACKER, 16, (UNKNOWN, "INITIALIZING")),
        (Family.BLIMP, 1, (MANUAL, "MANUAL")),
        (Family.COPTER, 77, (UNKNOWN, "CMODE(77)")),
        (Family.OTHER, 4, (UNKNOWN, "CMODE(4)")),
    ],
)
def test_an_ardupilots_family_picks_its_table(family: Family, number: int, expected: tuple[RobotMode, str]) -> None:
    assert mode_of(number, family=family) == expected


@pytest.mark.parametrize("stack", [Stack.ARDUPILOT, Stack.PX4])
def test_base_mode_flags_do_not_matter_where_there_is_a_table(stack: Stack) -> None:
    number = px4(6) if stack is Stack.PX4 else 4
    assert {mode_of(number, stack, base_mode=flags)[0] for flags in range(256)} == {AUTO}


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (px4(1), (MANUAL, "MANUAL")),
        (px4(3), (MANUAL, "POSCTL")),
        (px4(3, 1), (AUTO, "POSCTL.ORBIT")),
        (px4(4, 4), (AUTO, "AUTO.MISSION")),
        (px4(4, 13), (AUTO, "AUTO.13")),
        (px4(6), (AUTO, "OFFBOARD")),
        (px4(10), (UNKNOWN, "TERMINATION")),
        (px4(0), (UNKNOWN, "CMODE(0)")),
        (px4(99), (UNKNOWN, f"CMODE({px4(99)})")),
        (px4(6) | 0xFFFF, (AUTO, "OFFBOARD")),
    ],
)
def test_a_px4_mode_is_in_the_two_high_bytes(number: int, expected: tuple[RobotMode, str]) -> None:
    assert mode_of(number, Stack.PX4) == expected


def test_a_name_from_available_modes_serves_where_the_table_has_none_and_only_there() -> None:
    assert mode_of(77, sources=available(77, "Drone show")) == (UNKNOWN, "Drone show")
    assert mode_of(px4(4, 13), Stack.PX4, sources=available(px4(4, 13), "External")) == (AUTO, "External")
    assert mode_of(9, family=Family.SUB, sources=available(9, "CIRCLE")) == (AUTO, "SURFACE")


def test_a_users_override_wins_over_every_table() -> None:
    sources = ModeSources(overrides={"copter": {77: AUTO, 5: AUTO}, "px4": {px4(6): MANUAL}, "other": {0: AUTO}})
    assert mode_of(77, sources=sources) == (AUTO, "CMODE(77)")
    assert mode_of(5, sources=sources) == (AUTO, "LOITER")
    assert mode_of(5, family=Family.ROVER, sources=sources)[0] is AUTO
    assert mode_of(77, family=Family.ROVER, sources=sources)[0] is UNKNOWN
    assert mode_of(px4(6), Stack.PX4, sources=sources) == (MANUAL, "OFFBOARD")
    assert mode_of(0, Stack.OTHER, Family.OTHER, sources, base_mode=0x51)[0] is AUTO


@pytest.mark.parametrize(
    ("family", "number", "expected"),
    [
        (Family.ROVER, 4, (MANUAL, "ACRO")),
        (Family.PLANE, 12, (AUTO, "LOITER")),
        (Family.PLANE, 23, (UNKNOWN, "CMODE(23)")),
        (Family.COPTER, 5, (MANUAL, "LOITER")),
        (Family.COPTER, 22, (UNKNOWN, "CMODE(22)")),
    ],
)
def test_an_inav_uses_the_planes_numbers_for_all_but_copters(
    family: Family, number: int, expected: tuple[RobotMode, str]
) -> None:
    assert mode_of(number, Stack.INAV, family) == expected


@pytest.mark.parametrize(
    ("base_mode", "expected"),
    [
        (0, UNKNOWN), (64, MANUAL), (192, MANUAL), (66, MANUAL), (194, MANUAL), (80, MANUAL), (208, MANUAL),
        (88, AUTO), (216, AUTO), (92, AUTO), (220, AUTO), (128, UNKNOWN),
    ],
)  # fmt: skip
def test_other_autopilots_are_told_by_mavlinks_base_modes(base_mode: int, expected: RobotMode) -> None:
    assert mode_of(0, Stack.OTHER, base_mode=base_mode) == (expected, None)


@pytest.mark.parametrize(
    ("standard_mode", "expected"),
    [(1, MANUAL), (2, AUTO), (3, MANUAL), (4, MANUAL), (5, AUTO), (6, AUTO), (7, AUTO), (8, AUTO)],
)
def test_a_standard_mode_goes_before_base_mode(standard_mode: int, expected: RobotMode) -> None:
    wrong = 0x51 if expected is AUTO else 0x09
    current = ModeSources(current=heard(CurrentMode(3, 3, standard_mode), NOW - 4, None))
    assert mode_of(3, Stack.OTHER, sources=current, base_mode=wrong) == (expected, "CMODE(3)")
    listed = available(3, "Cruise", standard_mode)
    assert mode_of(3, Stack.OTHER, sources=listed, base_mode=wrong) == (expected, "Cruise")


@pytest.mark.parametrize(("age", "number", "standard_mode"), [(6, 3, 6), (1, 4, 6), (1, 3, 0), (1, 3, 99)])
def test_a_current_mode_that_is_old_of_another_mode_or_not_standard_says_nothing(
    age: float, number: int, standard_mode: int
) -> None:
    sources = ModeSources(current=heard(CurrentMode(number, number, standard_mode), NOW - age, None))
    assert mode_of(3, Stack.OTHER, sources=sources)[0] is MANUAL


def test_the_property_auto_mode_goes_before_base_mode() -> None:
    assert mode_of(3, Stack.OTHER, sources=available(3, "Brave", 0, 4)) == (AUTO, "Brave")


def test_initialising_is_a_mode_of_plane_rover_and_tracker_only() -> None:
    sixteen = Heartbeat(16, 1, 3, 1, 2, 3)
    starting = {family for family in Family if is_initialising(sixteen, Stack.ARDUPILOT, family)}
    assert starting == {Family.PLANE, Family.ROVER, Family.TRACKER}
    assert not is_initialising(sixteen, Stack.INAV, Family.PLANE)
