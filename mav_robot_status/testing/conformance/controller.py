"""Conformance tests for controllers: the behaviour that the gateway relies on.

Subclass `ControllerConformance` in a test module of your package::

    class TestMine(ControllerConformance):
        parameters = {"threshold": 3}

        def make_controller(self) -> MyController:
            return MyController()

pytest then runs the tests on your controller.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

import pytest

from ...clock import Instant, later
from ...errors import MavRobotStatusError
from ...interface import (
    DEFAULT_HANDLE_NAME,
    Controller,
    IndustrialRobotStatusHandle,
    IndustrialRobotStatusInterface,
    RobotHW,
    RobotStatus,
    RobotStatusMsg,
    TriState,
    validate,
)
from .publisher import CASES, START

PERIOD: Final = 0.05  # s between two updates


class Collector:
    """A publisher that stores its messages. A test sets `is_busy`."""

    periodic = True

    def __init__(self) -> None:
        self.is_busy = False
        self.messages: list[RobotStatusMsg] = []

    def busy(self) -> bool:
        """The value that the test has set."""
        return self.is_busy

    def publish(self, msg: RobotStatusMsg) -> None:
        """Store the message. A controller must not call it while the publisher is busy."""
        assert not self.is_busy, "a controller must not publish to a busy publisher"
        self.messages.append(msg)

    def service(self, now: Instant) -> float | None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""


class ControllerConformance:
    """The tests. A subclass provides the controller and its parameters."""

    parameters: Mapping[str, object] = {}

    def make_controller(self) -> Controller:
        """A new controller, before `init`."""
        raise NotImplementedError(f"{type(self).__name__} needs a method `make_controller`")

    def setup_method(self) -> None:
        """A hardware interface with one handle."""
        self.handle = IndustrialRobotStatusHandle(DEFAULT_HANDLE_NAME)
        self.hw = RobotHW()
        handles = IndustrialRobotStatusInterface()
        handles.register_handle(self.handle)
        self.hw.register_interface(handles)
        self.out = Collector()

    def make(self, **more: object) -> Controller:
        """A controller after `init`; `more` are further parameters."""
        made = self.make_controller()
        made.init(self.hw, {**self.parameters, **more}, [self.out])
        return made

    def started(self) -> Controller:
        """A controller after `starting`."""
        made = self.make()
        made.starting(START)
        return made

    def test_init_sets_its_handle(self) -> None:
        """The gateway updates a controller when the status in `handle` changes."""
        assert self.make(handle_name=DEFAULT_HANDLE_NAME).handle is self.handle

    def test_an_unknown_handle_is_one_of_our_errors(self) -> None:
        """The gateway prints it as one line."""
        with pytest.raises(MavRobotStatusError, match="no such handle"):
            self.make(handle_name="no such handle")

    def test_init_publishes_nothing(self) -> None:
        """The first message comes from `update`."""
        self.make()
        assert self.out.messages == []

    def test_its_messages_are_valid_and_name_its_handle(self) -> None:
        """For every kind of status."""
        made, now = self.started(), START
        for status, detail in CASES:
            self.handle.status, self.handle.detail = status, detail
            now = later(now, PERIOD)
            made.update(now, PERIOD)
        assert all(msg.handle == self.handle.name for msg in self.out.messages)
        assert [found for msg in self.out.messages if (found := validate(msg.status, msg.detail))] == []
        stamps = [msg.unix_us for msg in self.out.messages]
        assert stamps == sorted(stamps)

    def test_a_busy_publisher_gets_nothing(self) -> None:
        """`Collector.publish` fails if it does."""
        made, self.out.is_busy = self.started(), True
        for number in range(50):
            self.handle.status = RobotStatus(in_motion=TriState.of(number % 2 == 0))
            made.update(later(START, number * PERIOD), PERIOD)

    def test_next_due_is_later_than_now(self) -> None:
        """Otherwise the gateway would update it in an endless loop. inf: only when the handle changes."""
        made = self.started()
        for number in range(50):
            self.out.is_busy = number % 3 == 0
            self.handle.status = RobotStatus(in_motion=TriState.of(number % 4 == 0))
            now = later(START, number * PERIOD)
            made.update(now, PERIOD)
            due = made.next_due(now.mono)
            assert due > now.mono, f"next_due() must be later than now ({now.mono}), not {due!r}"
            assert not math.isnan(due)

    def test_an_update_without_time_passing_is_allowed(self) -> None:
        """Two changes may arrive within one instant."""
        made = self.started()
        for moving in (True, False, True):
            self.handle.status = RobotStatus(in_motion=TriState.of(moving))
            made.update(START, 0.0)

    def test_it_can_be_stopped_and_started_again(self) -> None:
        """The gateway does this after a jump in the time of a log."""
        made, now = self.started(), START
        for _ in range(3):
            now = later(now, PERIOD)
            made.update(now, PERIOD)
            made.stopping(now)
            made.starting(now)
        made.stopping(now)
