"""Handles: a name and its latest status."""

from __future__ import annotations

from mav_robot_status.interface import DEFAULT_HANDLE_NAME, IndustrialRobotStatusHandle, RobotStatus, TriState


def test_the_default_name_is_that_of_the_ros_control_handle() -> None:
    assert DEFAULT_HANDLE_NAME == "industrial_robot_status_handle"


def test_a_new_handle_is_unknown() -> None:
    handle = IndustrialRobotStatusHandle("arm")
    assert handle.name == "arm"
    assert handle.status == RobotStatus()
    assert handle.heard_at is None
    assert dict(handle.evidence) == {}


def test_a_handle_can_be_given_its_first_status() -> None:
    status = RobotStatus(in_motion=TriState.FALSE)
    assert IndustrialRobotStatusHandle("arm", status).status is status


def test_a_reader_keeps_what_it_read_when_a_new_status_is_set() -> None:
    handle = IndustrialRobotStatusHandle("arm")
    read = handle.status
    handle.status = read._replace(in_motion=TriState.TRUE)
    assert read.in_motion is TriState.UNKNOWN


def test_two_handles_share_nothing() -> None:
    one, other = IndustrialRobotStatusHandle("one"), IndustrialRobotStatusHandle("other")
    one.status = RobotStatus(in_error=TriState.TRUE, error_code=1)
    assert other.status == RobotStatus()


def test_the_repr_shows_the_name_and_the_status() -> None:
    text = repr(IndustrialRobotStatusHandle("arm", RobotStatus(error_code=7)))
    assert "'arm'" in text
    assert "error_code=7" in text
