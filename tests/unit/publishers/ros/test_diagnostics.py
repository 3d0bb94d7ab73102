from __future__ import annotations

import pytest

from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    NotReady,
    RobotMode,
    RobotStatus,
    Vehicle,
)
from mav_robot_status.publishers.ros.diagnostics import Level, diagnostic_status, headline, level

from .statuses import BLOCKED, DISARMED, FAILING, HEARD, MOVABLE, RADIO, TRUE, UNKNOWN, message


def _inhibited(*names: str) -> Detail:
    return Detail(1, 1, inhibits=tuple(Inhibit(name, None, 1) for name in names))


PARKED = _inhibited("DISARMED")
GROUP = Detail(1, 192, members=("base", "arm"))
STOPPED = BLOCKED._replace(e_stopped=TRUE)
BASE_STOPPED = NotReady("base", "E_STOPPED")
ARM_FAULT = ErrorCause(8003, "SAFETY_FAULT", "a fault", 1, "arm")
LOST = Detail(1, 1, inhibits=(Inhibit("LINK_STALE", None, 1),), link=LinkState.LOST)


@pytest.mark.parametrize(
    ("status", "detail", "expected"),
    [
        (MOVABLE, HEARD, Level.OK),
        (BLOCKED, DISARMED, Level.WARN),
        (BLOCKED, PARKED, Level.OK),
        (BLOCKED, PARKED._replace(vehicle=Vehicle(can_arm=True)), Level.OK),
        (BLOCKED, PARKED._replace(vehicle=Vehicle(can_arm=False)), Level.WARN),
        (BLOCKED._replace(drives_powered=TRUE), _inhibited("BRAKES_ENGAGED"), Level.OK),
        (BLOCKED, _inhibited("POWER_OFF", "DISARMED"), Level.OK),
        (BLOCKED, _inhibited("SAFEGUARD_STOP"), Level.WARN),
        (BLOCKED, HEARD, Level.WARN),
        (BLOCKED._replace(e_stopped=UNKNOWN), PARKED, Level.OK),
        (BLOCKED._replace(e_stopped=TRUE), PARKED, Level.ERROR),
        (MOVABLE._replace(e_stopped=TRUE), HEARD, Level.ERROR),
        (MOVABLE._replace(e_stopped=UNKNOWN), HEARD, Level.OK),
        (MOVABLE._replace(motion_possible=UNKNOWN), HEARD, Level.WARN),
        (MOVABLE._replace(drives_powered=UNKNOWN), HEARD, Level.WARN),
        (MOVABLE._replace(in_motion=UNKNOWN), HEARD, Level.OK),
        (MOVABLE._replace(mode=RobotMode.UNKNOWN), HEARD, Level.OK),
        (MOVABLE, GROUP, Level.OK),
        (MOVABLE, GROUP._replace(not_ready=(NotReady("arm", "DISARMED"),)), Level.WARN),
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
        (MOVABLE, GROUP._replace(not_ready=(BASE_STOPPED,)), "MOTION POSSIBLE; not ready: base (E_STOPPED)"),
        (STOPPED, GROUP._replace(not_ready=(BASE_STOPPED,)), "MOTION NOT POSSIBLE; not ready: base (E_STOPPED)"),
        (
            STOPPED,
            GROUP._replace(not_ready=(BASE_STOPPED, NotReady("arm", "E_STOPPED"))),
            "EMERGENCY STOP; not ready: base (E_STOPPED), arm (E_STOPPED)",
        ),
        (FAILING, GROUP._replace(errors=(ARM_FAULT,)), "MOTION POSSIBLE: arm: SAFETY_FAULT (a fault)"),
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
