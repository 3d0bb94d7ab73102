from __future__ import annotations

import math

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.combined import CombinedRobotHW
from mav_robot_status.interface import (
    IndustrialRobotStatusHandle,
    IndustrialRobotStatusInterface,
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
