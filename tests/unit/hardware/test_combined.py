from __future__ import annotations

import math

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.combined import CombinedRobotHW
from mav_robot_status.hardware.group import Group
from mav_robot_status.interface import (
    IndustrialRobotStatusHandle,
    IndustrialRobotStatusInterface,
    LinkState,
    RobotHW,
    RobotMode,
    RobotStatus,
)

START = Instant(100.0, 0)


class Robot(RobotHW):
    """A robot with handles of these names."""

    def __init__(self, *names: str, due: float = math.inf) -> None:
        super().__init__()
        self.due = due
        self.explained: list[str] = []
        self.closed = 0
        self.mode = RobotMode.AUTO
        for name in names:
            self.handles.register_handle(IndustrialRobotStatusHandle(name))

    def read(self, now: Instant) -> None:
        for handle in self.handles:
            self.set_status(handle, RobotStatus(self.mode))

    def next_due(self, until: float = -math.inf) -> float:
        return self.due

    def explain(self, handle: str, now: Instant) -> None:
        self.explained.append(handle)

    def close(self) -> None:
        self.closed += 1


def test_it_offers_the_current_and_later_handles_of_all_interfaces() -> None:
    rover, arm = Robot("rover"), Robot("arm")
    both = CombinedRobotHW([rover, arm])
    assert both.get(IndustrialRobotStatusInterface).get_names() == ["rover", "arm"]
    rover.handles.register_handle(IndustrialRobotStatusHandle("rover/2.1"))
    both.read(START)
    assert both.handles.get_names() == ["rover", "arm", "rover/2.1"]


def test_a_change_of_one_interface_is_reported_by_the_combination() -> None:
    rover, arm = Robot("rover"), Robot("arm")
    both = CombinedRobotHW([rover, arm])
    both.read(START)
    assert both.changed
    both.changed = False
    both.read(START)
    assert not both.changed
    arm.mode = RobotMode.MANUAL
    both.read(START)
    assert both.changed
    assert not arm.changed


def test_a_duplicate_handle_name_is_skipped_with_one_warning(
    caplog: pytest.LogCaptureFixture,
) -> None:
    rover, arm = Robot("robot"), Robot("robot", "arm")
    both = CombinedRobotHW([rover, arm])
    both.read(START)
    assert both.handles.get_handle("robot") is rover.handles.get_handle("robot")
    assert both.handles.get_names() == ["robot", "arm"]
    assert caplog.messages == ["two hardware interfaces have a handle 'robot': the second is ignored"]


def test_it_is_due_when_its_earliest_interface_is_due() -> None:
    assert CombinedRobotHW([Robot("rover", due=7.0), Robot("arm", due=5.0)]).next_due() == 5.0


def test_each_handle_is_explained_by_its_own_interface() -> None:
    rover, arm = Robot("rover"), Robot("arm")
    CombinedRobotHW([rover, arm]).explain("arm", START)
    assert (rover.explained, arm.explained) == ([], ["arm"])


def test_forget_and_close_reach_every_interface() -> None:
    rover, arm = Robot("rover"), Robot("arm")
    both = CombinedRobotHW([rover, arm])
    both.read(START)
    both.forget()
    assert [handle.status for handle in both.handles] == [RobotStatus()] * 2
    both.close()
    assert (rover.closed, arm.closed) == (1, 1)


ROVER_AND_ARM = Group("robot", ("rover", "arm"))


def test_a_group_is_a_handle_that_follows_its_members() -> None:
    rover, arm = Robot("rover"), Robot("arm")
    both = CombinedRobotHW([rover, arm], [ROVER_AND_ARM])
    robot = both.handles.get_handle("robot")
    assert robot.detail.link is LinkState.NEVER_SEEN
    both.read(START)
    assert both.changed
    assert robot.status.mode.name == "AUTO"
    both.changed, arm.mode = False, RobotMode.MANUAL
    both.read(START)
    assert both.changed
    assert robot.status.mode.name == "MANUAL"
    both.changed = False
    both.read(START)
    assert not both.changed


def test_a_group_without_named_members_has_all_that_are_heard() -> None:
    rover = Robot("rover")
    both = CombinedRobotHW([rover], [Group("robot"), Group("other")])
    both.read(START)
    assert both.handles.get_handle("robot").detail.members == ("rover",)
    rover.handles.register_handle(IndustrialRobotStatusHandle("rover/2.1"))
    both.read(START)
    assert both.handles.get_handle("robot").detail.members == ("rover", "rover/2.1")


def test_a_member_that_was_not_heard_yet_is_unknown() -> None:
    rover = Robot("rover")
    both = CombinedRobotHW([rover], [ROVER_AND_ARM])
    both.read(START)
    assert both.handles.get_handle("robot").status.mode is RobotMode.UNKNOWN
    rover.handles.register_handle(IndustrialRobotStatusHandle("arm"))
    both.read(START)
    assert both.handles.get_handle("robot").status.mode is RobotMode.AUTO


def test_a_group_is_as_old_as_its_oldest_member_at_each_read() -> None:
    both = CombinedRobotHW([Robot("rover"), Robot("arm")], [ROVER_AND_ARM])
    for name, at in (("rover", 3.0), ("arm", 2.0)):
        both.handles.get_handle(name).heard_at = at
    both.read(START)
    assert both.handles.get_handle("robot").heard_at == 2.0
    both.handles.get_handle("arm").heard_at = 4.0
    both.read(START)
    assert both.handles.get_handle("robot").heard_at == 3.0


def test_a_group_is_explained_by_its_members() -> None:
    rover, arm = Robot("rover"), Robot("arm")
    both = CombinedRobotHW([rover, arm], [ROVER_AND_ARM])
    both.explain("robot", START)
    assert (rover.explained, arm.explained) == (["rover"], ["arm"])
    assert both.handles.get_handle("robot").evidence["mode"].rule == "rover, and 1 more"


def test_a_group_comes_before_a_robot_of_the_same_name(caplog: pytest.LogCaptureFixture) -> None:
    both = CombinedRobotHW([Robot("rover", "robot")], [Group("robot", ("rover",))])
    both.read(START)
    assert both.handles.get_handle("robot").detail.members == ("rover",)
    assert "two hardware interfaces have a handle 'robot'" in caplog.text
