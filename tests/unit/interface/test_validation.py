from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.interface import (
    Detail,
    ErrorCause,
    Inhibit,
    LinkState,
    RobotMode,
    RobotStatus,
    TriState,
    Vehicle,
    validate,
)

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
MOVING = RobotStatus(
    mode=RobotMode.AUTO, e_stopped=FALSE, drives_powered=TRUE, motion_possible=TRUE, in_motion=TRUE, in_error=FALSE
)
FAILING = MOVING._replace(in_error=TRUE, error_code=4001)
ERROR = ErrorCause(4001, "BATTERY_LOW", None, 7)
DISARMED = Inhibit("DISARMED", None, 7)
LOST = Detail(link=LinkState.LOST)


@pytest.mark.parametrize(
    ("status", "detail"),
    [
        (RobotStatus(), None),
        (RobotStatus(), Detail()),
        (RobotStatus(), Detail(1, 1, (), (DISARMED,), Vehicle("PX4", "ROCKET", "AUTO", 4, "ACTIVE"), LinkState.LOST)),
        (MOVING, Detail(1, 1)),
        (FAILING, Detail(1, 1, (ERROR,))),
        (FAILING, Detail()),
        (RobotStatus(e_stopped=TRUE, drives_powered=FALSE, motion_possible=FALSE), Detail(inhibits=(DISARMED,))),
        (RobotStatus(in_error=TRUE, error_code=9001), LOST._replace(errors=(ErrorCause(9001, "LINK_LOST", None, 7),))),
    ],
)
def test_a_status_that_holds_the_invariants_is_valid(status: RobotStatus, detail: Detail | None) -> None:
    assert validate(status, detail) is None


@pytest.mark.parametrize(
    ("status", "detail", "found"),
    [
        (MOVING._replace(e_stopped=TRUE), None, "I1: e_stopped is TRUE, so drives_powered must be FALSE"),
        (RobotStatus(e_stopped=TRUE), None, "I1: e_stopped is TRUE, so drives_powered must be FALSE"),
        (MOVING._replace(drives_powered=FALSE), None, "I2: drives_powered is FALSE, so motion_possible must be FALSE"),
        (MOVING._replace(error_code=1), None, "I3: error_code must be non-zero if in_error is TRUE"),
        (MOVING._replace(in_error=TRUE), None, "I3: error_code must be non-zero if in_error is TRUE"),
        (MOVING, LOST, "I4: the link is LOST, so every field must be UNKNOWN"),
        (RobotStatus(in_error=FALSE), LOST, "I4: the link is LOST, so every field must be UNKNOWN"),
        (RobotStatus(in_motion=FALSE), Detail(link=LinkState.NEVER_SEEN), "I4: the link is NEVER_SEEN"),
        (MOVING, Detail(inhibits=(DISARMED,)), "motion_possible is TRUE, so there must be no inhibits, not DISARMED"),
        (MOVING, Detail(errors=(ERROR,)), "error_code must be the code of the first error, 4001, not 0"),
    ],
)
def test_a_broken_invariant_is_named(status: RobotStatus, detail: Detail | None, found: str) -> None:
    assert (validate(status, detail) or "").startswith(found)


@pytest.mark.parametrize(
    ("status", "found"),
    [
        (RobotStatus(mode="AUTO"), "mode: must be a RobotMode, not 'AUTO'"),  # type: ignore[arg-type]
        (RobotStatus(mode=0), "mode: must be a RobotMode, not 0"),  # type: ignore[arg-type]
        (RobotStatus(in_motion=True), "in_motion: must be a TriState, not True"),  # type: ignore[arg-type]
        (RobotStatus(error_code=2**31), "error_code: must be a whole number of 32 bits, not 2147483648"),
        (RobotStatus(error_code=True), "error_code: must be a whole number of 32 bits, not True"),
        (RobotStatus(error_code=1.0), "error_code: must be a whole number of 32 bits, not 1.0"),  # type: ignore[arg-type]
        ((1, 2), "the status must be a RobotStatus, not (1, 2)"),
    ],
)
def test_a_value_of_the_wrong_type_is_reported_with_the_name_of_its_field(status: Any, found: str) -> None:
    assert validate(status) == found


@pytest.mark.parametrize(
    ("detail", "found"),
    [
        (Detail(system=300), "system: must be an id from 0 to 255 or None, not 300"),
        (Detail(component="1"), "component: must be an id from 0 to 255 or None, not '1'"),  # type: ignore[arg-type]
        (Detail(errors=[]), "errors: must be a tuple of ErrorCause, not []"),  # type: ignore[arg-type]
        (Detail(errors=(ErrorCause(0, "X", None, 0),)), "errors: the code of an error must not be 0"),
        (Detail(inhibits=("DISARMED",)), "inhibits: must be a tuple of Inhibit, not ('DISARMED',)"),  # type: ignore[arg-type]
        (Detail(vehicle=Vehicle(type=1)), "vehicle: must be a Vehicle"),  # type: ignore[arg-type]
        (Detail(link="LOST"), "link: must be a LinkState, not 'LOST'"),  # type: ignore[arg-type]
        (7, "the detail must be a Detail, not 7"),
    ],
)
def test_a_detail_of_the_wrong_type_is_reported_with_the_name_of_its_member(detail: Any, found: str) -> None:
    assert (validate(RobotStatus(), detail) or "").startswith(found)
