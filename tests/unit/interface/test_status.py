"""The values of a status: the numbers are stable, the defaults are unknown."""

from __future__ import annotations

import pytest

from mav_robot_status.interface import Detail, LinkState, RobotMode, RobotStatus, TriState, Vehicle


def test_tri_states_have_the_values_of_industrial_msgs() -> None:
    assert {t.name: t.value for t in TriState} == {"UNKNOWN": -1, "FALSE": 0, "TRUE": 1}


def test_robot_modes_have_the_values_of_industrial_msgs_except_zero() -> None:
    assert {m.name: m.value for m in RobotMode} == {"UNKNOWN": -1, "MANUAL": 1, "AUTO": 2}
    with pytest.raises(ValueError):
        RobotMode(0)


def test_a_new_status_is_unknown_with_error_code_0() -> None:
    status = RobotStatus()
    assert all(value == -1 for value in status[:-1])
    assert status.error_code == 0


def test_unknown_is_neither_true_nor_false() -> None:
    assert TriState.UNKNOWN not in (TriState.TRUE, TriState.FALSE)


def test_the_fields_equal_those_of_the_message_in_order() -> None:
    # a consumer of the ROS forms sees these names
    assert RobotStatus._fields == (
        "mode", "e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error", "error_code",
    )  # fmt: skip


def test_the_default_detail_is_that_of_a_connected_robot() -> None:
    detail = Detail()
    assert detail.link is LinkState.CONNECTED
    assert (detail.system, detail.errors, detail.inhibits, detail.vehicle) == (None, (), (), Vehicle())


def test_statuses_compare_by_value() -> None:
    status = RobotStatus()
    assert status._replace(in_motion=TriState.TRUE) == RobotStatus(in_motion=TriState.TRUE)
    assert status == RobotStatus()
    with pytest.raises(AttributeError):
        status.in_motion = TriState.TRUE  # type: ignore[misc]


@pytest.mark.parametrize(("value", "state"), [(True, TriState.TRUE), (False, TriState.FALSE), (None, TriState.UNKNOWN)])
def test_a_tri_state_is_created_from_a_bool_or_none(value: bool | None, state: TriState) -> None:
    assert TriState.of(value) is state


@pytest.mark.parametrize(
    ("automatic", "mode"), [(True, RobotMode.AUTO), (False, RobotMode.MANUAL), (None, RobotMode.UNKNOWN)]
)
def test_a_mode_is_created_from_a_bool_or_none(automatic: bool | None, mode: RobotMode) -> None:
    assert RobotMode.of(automatic) is mode
