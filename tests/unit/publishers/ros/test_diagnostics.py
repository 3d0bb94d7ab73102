from __future__ import annotations

import pytest

from mav_robot_status.interface import Detail, Inhibit, LinkState, RobotMode, RobotStatus, Vehicle
from mav_robot_status.publishers.ros.diagnostics import Level, diagnostic_status, headline, level

from .statuses import BLOCKED, DISARMED, FAILING, HEARD, MOVABLE, RADIO, TRUE, UNKNOWN, message

STOPPED = BLOCKED._replace(e_stopped=TRUE)
LOST = Detail(1, 1, inhibits=(Inhibit("LINK_STALE", None, 1),), link=LinkState.LOST)


@pytest.mark.parametrize(
    ("status", "detail", "expected"),
    [
        (MOVABLE, HEARD, Level.OK),
        (BLOCKED, DISARMED, Level.WARN),
        (MOVABLE._replace(motion_possible=UNKNOWN), HEARD, Level.WARN),
        (MOVABLE._replace(in_motion=UNKNOWN), HEARD, Level.WARN),
        (MOVABLE._replace(mode=RobotMode.UNKNOWN), HEARD, Level.WARN),
        (FAILING, RADIO, Level.ERROR),
        (BLOCKED._replace(in_error=TRUE, error_code=1), DISARMED, Level.ERROR),
        (RobotStatus(), LOST, Level.STALE),
        (RobotStatus(in_error=TRUE, error_code=9001), LOST, Level.STALE),
        (RobotStatus(), Detail(link=LinkState.NEVER_SEEN), Level.STALE),
    ],
)
def test_the_level_is_that_of_the_worst_finding(status: RobotStatus, detail: Detail, expected: Level) -> None:
    assert level(status, detail) is expected


@pytest.mark.parametrize(
    ("status", "detail", "expected"),
    [
        (MOVABLE, HEARD, "MOTION POSSIBLE"),
        (BLOCKED, DISARMED, "MOTION NOT POSSIBLE: DISARMED"),
        (BLOCKED._replace(in_motion=TRUE), DISARMED, "MOVING"),
        (FAILING, RADIO, "MOTION POSSIBLE: RADIO_FAILSAFE (Radio Failsafe)"),
        (STOPPED, HEARD, "EMERGENCY STOP"),
        (STOPPED._replace(in_motion=TRUE), HEARD, "MOVING"),
        (RobotStatus(), HEARD, "UNKNOWN: it may move"),
        (RobotStatus(), LOST, "NO LINK: its state is unknown, it may move"),
        (RobotStatus(), Detail(link=LinkState.NEVER_SEEN), "NEVER SEEN"),
    ],
)
def test_the_headline_says_what_a_person_beside_the_robot_must_know(
    status: RobotStatus, detail: Detail, expected: str
) -> None:
    assert headline(status, detail) == expected


def test_the_values_are_the_fields_the_reasons_and_the_vehicle() -> None:
    detail = RADIO._replace(inhibits=DISARMED.inhibits, vehicle=Vehicle("PX4", flight_mode="HOLD"))
    found = diagnostic_status(message(FAILING, detail))
    assert found.values == (
        ("mode", "AUTO"), ("e_stopped", "FALSE"), ("drives_powered", "TRUE"), ("motion_possible", "TRUE"),
        ("in_motion", "FALSE"), ("in_error", "TRUE"), ("error_code", "2001"),
        ("error 2001", "RADIO_FAILSAFE (Radio Failsafe)"), ("error 2003", "LOW"),
        ("inhibit DISARMED", ""), ("inhibit PREARM_FAILING", "PreArm: Bad fix"),
        ("link", "CONNECTED"), ("autopilot", "PX4"), ("flight_mode", "HOLD"),
    )  # fmt: skip


def test_it_is_about_the_handle() -> None:
    found = diagnostic_status(message())
    assert (found.name, found.hardware_id) == ("mav_robot_status: rover", "rover")
