from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.hardware.mavlink.autopilots import ARDUPILOT, GENERIC, INAV, PX4, Autopilot
from mav_robot_status.hardware.mavlink.autopilots.modes import AvailableMode, ModeHints
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import RobotMode
from mav_robot_status.mavlink.definitions import CurrentMode, Heartbeat

from ..driver import QUAD, ROVER, Flight

MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN
NOTHING = ModeHints()


def mode_of(
    number: int,
    profile: Autopilot = ARDUPILOT,
    family: Family = Family.COPTER,
    hints: ModeHints = NOTHING,
    base_mode: int = 0x51,
) -> tuple[RobotMode, str | None]:
    found = profile.modes.flight_mode(Heartbeat(number, 2, 3, base_mode, 4, 3), family, hints)
    return found.mode, found.name


def available(number: int, name: str = "", standard_mode: int = 0, properties: int = 0) -> ModeHints:
    return ModeHints(AvailableMode(name, standard_mode, properties))


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
def test_the_ardupilot_family_selects_the_mode_table(
    family: Family, number: int, expected: tuple[RobotMode, str]
) -> None:
    assert mode_of(number, family=family) == expected


@pytest.mark.parametrize("profile", [ARDUPILOT, PX4])
def test_base_mode_flags_are_ignored_if_a_table_exists(profile: Autopilot) -> None:
    number = px4(6) if profile is PX4 else 4
    assert {mode_of(number, profile, base_mode=flags)[0] for flags in range(256)} == {AUTO}


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
    assert mode_of(number, PX4) == expected


def test_a_name_from_available_modes_is_used_only_if_the_table_has_none() -> None:
    assert mode_of(77, hints=available(77, "Drone show")) == (UNKNOWN, "Drone show")
    assert mode_of(px4(4, 13), PX4, hints=available(px4(4, 13), "External")) == (AUTO, "External")
    assert mode_of(9, family=Family.SUB, hints=available(9, "CIRCLE")) == (AUTO, "SURFACE")


def test_a_configured_override_wins_over_every_table() -> None:
    overrides: Any = {"copter": {77: AUTO, 5: AUTO}, "px4": {px4(6): MANUAL}}
    options = HardwareOptions(mode_overrides=overrides)

    def mode(number: int, vehicle_type: int = QUAD, autopilot: int = 3) -> tuple[RobotMode, str | None]:
        flight = Flight(autopilot, vehicle_type, options=options).hb(mode=number)
        return flight.status.mode, flight.detail.vehicle.flight_mode

    assert mode(77) == (AUTO, "CMODE(77)")
    assert mode(5) == (AUTO, "LOITER")
    assert mode(5, ROVER) == (AUTO, "LOITER")
    assert mode(77, ROVER)[0] is UNKNOWN
    assert mode(px4(6), autopilot=12) == (MANUAL, "OFFBOARD")


@pytest.mark.parametrize(
    ("family", "number", "expected"),
    [
        (Family.ROVER, 4, (MANUAL, "ACRO")),
        (Family.PLANE, 12, (AUTO, "LOITER")),
        (Family.PLANE, 23, (UNKNOWN, "CMODE(23)")),
        (Family.COPTER, 5, (MANUAL, "LOITER")),
        (Family.COPTER, 22, (UNKNOWN, "CMODE(22)")),
        (Family.OTHER, 5, (MANUAL, "LOITER")),
    ],
)
def test_inav_uses_the_plane_modes_for_planes_rovers_and_boats_alone(
    family: Family, number: int, expected: tuple[RobotMode, str]
) -> None:
    assert mode_of(number, INAV, family) == expected


@pytest.mark.parametrize(
    ("base_mode", "expected"),
    [
        (0, UNKNOWN), (64, MANUAL), (192, MANUAL), (66, MANUAL), (194, MANUAL), (80, MANUAL), (208, MANUAL),
        (88, AUTO), (216, AUTO), (92, AUTO), (220, AUTO), (128, UNKNOWN),
    ],
)  # fmt: skip
def test_other_autopilots_use_the_mavlink_base_mode_flags(base_mode: int, expected: RobotMode) -> None:
    assert mode_of(0, GENERIC, base_mode=base_mode) == (expected, None)


@pytest.mark.parametrize(
    ("standard_mode", "expected"),
    [(1, MANUAL), (2, AUTO), (3, MANUAL), (4, MANUAL), (5, AUTO), (6, AUTO), (7, AUTO), (8, AUTO)],
)
def test_a_standard_mode_takes_precedence_over_base_mode(standard_mode: int, expected: RobotMode) -> None:
    wrong = 0x51 if expected is AUTO else 0x09
    current = ModeHints(standard_mode=standard_mode)
    assert mode_of(3, GENERIC, hints=current, base_mode=wrong) == (expected, "CMODE(3)")
    listed = available(3, "Cruise", standard_mode)
    assert mode_of(3, GENERIC, hints=listed, base_mode=wrong) == (expected, "Cruise")


@pytest.mark.parametrize(("age", "number", "standard_mode"), [(6, 3, 6), (1, 4, 6), (1, 3, 0), (1, 3, 99)])
def test_a_current_mode_that_is_stale_mismatched_or_not_standard_is_ignored(
    age: float, number: int, standard_mode: int
) -> None:
    flight = Flight(0).hb(mode=3, flags=0x51)
    flight.send(CurrentMode(number, number, standard_mode)).wait(age)
    assert flight.status.mode is MANUAL


def test_a_fresh_current_mode_gives_the_mode() -> None:
    assert Flight(0).hb(mode=3, flags=0x51).send(CurrentMode(3, 3, 6)).status.mode is AUTO


def test_the_auto_mode_property_takes_precedence_over_base_mode() -> None:
    assert mode_of(3, GENERIC, hints=available(3, "Brave", 0, 4)) == (AUTO, "Brave")


def test_initialising_is_a_mode_of_plane_rover_and_tracker_only() -> None:
    assert ARDUPILOT.modes.initialising == dict.fromkeys((Family.PLANE, Family.ROVER, Family.TRACKER), 16)
    assert not INAV.modes.initialising
