"""A STATUS frame as a status: what has no meaning is UNKNOWN, and so is a contradiction."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.simple_message.status import NO_CODE, status_of, values_of
from mav_robot_status.interface import Detail, RobotMode, RobotStatus, TriState
from mav_robot_status.interface.validation import validate
from mav_robot_status.simple_message import FIELDS, StatusFrame

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
RUNNING = StatusFrame(1, 0, 0, 0, 1, 2, 1)
NUMBERS = st.sampled_from([-1, 0, 1, 2]) | st.integers(-(2**31), 2**31 - 1)


def test_a_frame_is_the_status_that_it_says() -> None:
    assert status_of(RUNNING) == RobotStatus(RobotMode.AUTO, FALSE, TRUE, TRUE, TRUE, FALSE, 0)
    failed = RUNNING._replace(in_error=1, error_code=-7, motion_possible=0, mode=1)
    assert status_of(failed) == RobotStatus(RobotMode.MANUAL, FALSE, TRUE, FALSE, TRUE, TRUE, -7)


@pytest.mark.parametrize("name", FIELDS)
def test_a_value_out_of_its_range_is_unknown(name: str) -> None:
    status = status_of(RUNNING._replace(**{name: 3}))
    assert getattr(status, name) == (0 if name == "error_code" else UNKNOWN)


@pytest.mark.parametrize(
    ("says", "stopped", "powered", "possible"),
    [
        ({"drives_powered": 0}, FALSE, UNKNOWN, UNKNOWN),  # without power, and able to move
        ({"e_stopped": 1}, UNKNOWN, TRUE, UNKNOWN),
        ({"e_stopped": 1, "drives_powered": 0}, UNKNOWN, UNKNOWN, UNKNOWN),
        ({"drives_powered": 0, "motion_possible": -1}, FALSE, FALSE, UNKNOWN),  # by its definition it needs no power
        ({"e_stopped": 1, "motion_possible": 0}, TRUE, TRUE, FALSE),
    ],
)
def test_two_values_that_contradict_each_other_are_unknown(
    says: dict[str, int], stopped: TriState, powered: TriState, possible: TriState
) -> None:
    status = status_of(RUNNING._replace(**says))
    assert (status.e_stopped, status.drives_powered, status.motion_possible) == (stopped, powered, possible)


def test_an_error_without_a_code_has_ours_and_a_code_without_an_error_is_none() -> None:
    assert status_of(RUNNING._replace(in_error=1)).error_code == NO_CODE
    assert status_of(RUNNING._replace(error_code=5)).error_code == 0
    assert status_of(RUNNING._replace(in_error=-1, error_code=5)).error_code == 0


@pytest.mark.parametrize(
    ("says", "names"),
    [
        ({"e_stopped": 1, "drives_powered": 0}, ["E_STOPPED", "POWER_OFF"]),
        ({"in_error": 1, "error_code": 5}, ["CONTROLLER_ERROR"]),
        ({}, ["MOTION_NOT_POSSIBLE"]),
    ],
)
def test_a_robot_that_cannot_move_has_a_reason_with_its_time(says: dict[str, int], names: list[str]) -> None:
    frame = RUNNING._replace(motion_possible=0, **says)
    first = values_of(frame, Detail(), 5, 1.0).detail
    again = values_of(frame, first, 9, 2.0).detail
    assert [one.name for one in again.inhibits] == names
    assert {one.since_us for one in again.inhibits} == {5}
    assert [one.since_us for one in again.errors] == [5] * ("in_error" in says)


def test_the_evidence_is_the_number_of_the_frame() -> None:
    evidence = values_of(RUNNING, Detail(), 5, 1.0).evidence
    assert evidence["mode"].source == "STATUS.mode 2"
    assert set(evidence) == set(RobotStatus._fields) - {"error_code"}


@given(st.builds(StatusFrame, *[NUMBERS] * 7))
def test_every_frame_makes_a_valid_status(frame: StatusFrame) -> None:
    status, detail, _ = values_of(frame, Detail(), 5, 1.0)
    assert validate(status, detail, stops_cut_power=False, motion_needs_power=False) is None
    assert detail.inhibits or status.motion_possible is not FALSE
    assert not detail.inhibits or status.motion_possible is not TRUE


@pytest.mark.parametrize(
    ("powered", "stopped", "names"), [(0, 0, ["POWER_OFF"]), (1, 1, ["E_STOPPED"]), (0, 1, ["E_STOPPED", "POWER_OFF"])]
)
def test_what_is_off_or_stopped_is_named_while_motion_is_unknown(powered: int, stopped: int, names: list[str]) -> None:
    frame = RUNNING._replace(drives_powered=powered, e_stopped=stopped, motion_possible=-1, in_error=1)
    status, detail, _ = values_of(frame, Detail(), 5, 1.0)
    assert (status.motion_possible, [one.name for one in detail.inhibits]) == (UNKNOWN, names)
