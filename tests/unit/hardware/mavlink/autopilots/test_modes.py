"""The mode tables against the enumerations that MAVLink publishes, and PX4's against docs/semantics/modes.md."""

from __future__ import annotations

import pathlib
import xml.etree.ElementTree as ET

import pytest
from pymavlink import dialects

from mav_robot_status.hardware.mavlink.autopilots import ardupilot, modes, px4
from mav_robot_status.interface import RobotMode

MANUAL, AUTO, UNKNOWN = RobotMode.MANUAL, RobotMode.AUTO, RobotMode.UNKNOWN
XML = pathlib.Path(dialects.__file__ or "").parent / "v20"

NOT_IN_THE_XML = {
    "COPTER_MODE": {
        8: "POSITION",  # removed from the firmware, but present in logs of old copters
        10: "OF_LOITER",  # removed from the firmware
        29: "RATE_ACRO",  # newer than some releases of the XML
    },
    "ROVER_MODE": {2: "LEARNING"},  # removed from the firmware
}


def published(name: str, *files: str) -> dict[int, str]:
    """The entries of a public enumeration without its name as prefix."""
    for file in files:
        for enum in ET.parse(XML / file).getroot().iter("enum"):
            if enum.get("name") == name:
                return {
                    int(entry.attrib["value"], 0): entry.attrib["name"].removeprefix(f"{name}_")
                    for entry in enum.findall("entry")
                }
    raise AssertionError(f"{name} is not in {files}")


@pytest.mark.parametrize(
    ("enum", "table"),
    [
        ("COPTER_MODE", ardupilot.COPTER),
        ("PLANE_MODE", ardupilot.PLANE),
        ("ROVER_MODE", ardupilot.ROVER),
        ("SUB_MODE", ardupilot.SUB),
        ("TRACKER_MODE", ardupilot.TRACKER),
    ],
)
def test_a_table_has_exactly_the_numbers_and_names_of_ardupilots_enumeration(enum: str, table: modes.ModeTable) -> None:
    names = {number: name for number, (name, _) in table.items()}
    assert names == NOT_IN_THE_XML.get(enum, {}) | published(enum, "ardupilotmega.xml")


CLASSES: dict[str, tuple[modes.ModeTable, set[int], set[int], set[int]]] = {
    "copter": (
        ardupilot.COPTER,
        {0, 1, 2, 5, 8, 10, 11, 13, 14, 15, 16, 22, 24, 25, 28, 29},
        {3, 4, 6, 7, 9, 17, 18, 19, 20, 21, 23, 26, 27},
        set(),
    ),
    "plane": (
        ardupilot.PLANE,
        {0, 2, 3, 4, 5, 6, 7, 8, 17, 18, 19, 22, 23},
        {1, 10, 11, 12, 13, 14, 15, 20, 21, 24, 25, 26},
        {16},
    ),
    "rover": (ardupilot.ROVER, {0, 1, 2, 3, 7}, {4, 5, 6, 8, 9, 10, 11, 12, 15}, {16}),
    "sub": (ardupilot.SUB, {0, 1, 2, 16, 19, 21}, {3, 4, 7, 9, 20}, set()),
    "tracker": (ardupilot.TRACKER, {0, 3}, {1, 2, 4, 10}, {16}),
    "blimp": (ardupilot.BLIMP, {1, 2, 3}, {0, 4}, set()),
}


@pytest.mark.parametrize(("table", "manual", "auto", "unknown"), CLASSES.values(), ids=CLASSES)
def test_every_ardupilot_mode_has_the_class_of_the_specification(
    table: modes.ModeTable, manual: set[int], auto: set[int], unknown: set[int]
) -> None:
    classes = dict.fromkeys(manual, MANUAL) | dict.fromkeys(auto, AUTO) | dict.fromkeys(unknown, UNKNOWN)
    assert {number: mode for number, (_, mode) in table.items()} == classes


def test_blimp_modes_have_the_names_of_the_firmware() -> None:
    assert [ardupilot.BLIMP[number][0] for number in range(5)] == ["LAND", "MANUAL", "VELOCITY", "LOITER", "RTL"]


def test_standard_modes_are_those_of_mavlink_except_non_standard() -> None:
    names = {number: name for number, (name, _) in modes.STANDARD_MODES.items()}
    assert {0: "NON_STANDARD"} | names == published("MAV_STANDARD_MODE", "common.xml", "development.xml")
    assert {number for number, (_, mode) in modes.STANDARD_MODES.items() if mode is MANUAL} == {1, 3, 4}


def test_px4s_main_modes_are_those_of_the_specification() -> None:
    assert px4.MAIN == {
        1: ("MANUAL", MANUAL),
        2: ("ALTCTL", MANUAL),
        3: ("POSCTL", MANUAL),
        4: ("AUTO", AUTO),
        5: ("ACRO", MANUAL),
        6: ("OFFBOARD", AUTO),
        7: ("STABILIZED", MANUAL),
        8: ("RATTITUDE", MANUAL),
        9: ("SIMPLE", MANUAL),
        10: ("TERMINATION", UNKNOWN),
        11: ("ALTITUDE_CRUISE", MANUAL),
    }


def test_px4s_sub_modes_are_those_of_the_specification() -> None:
    auto = "READY TAKEOFF LOITER MISSION RTL LAND RTGS FOLLOW_TARGET PRECLAND VTOL_TAKEOFF".split()
    assert {
        (3, 1): ("POSCTL.ORBIT", AUTO),
        (3, 2): ("POSCTL.SLOW", MANUAL),
        **{(4, sub): (f"AUTO.{name}", AUTO) for sub, name in enumerate(auto, start=1)},
    } == px4.SUB
