"""Conformance tests for hardware interfaces: the behaviour that the gateway relies on.

`mav_robot_status.interface.hardware` specifies it. Subclass `HardwareConformance` in a test module of your package, and
provide the robot in a fixture::

    class TestMyRobot(HardwareConformance):
        @pytest.fixture
        def robot(self) -> Iterator[MyRobot]:
            with MyRobot() as robot:
                yield robot

pytest then runs the tests on your hardware interface. Time is an argument; real time passes only until input arrives.
"""

from __future__ import annotations

import math
import select
import time
from collections.abc import Iterator
from typing import Final, Protocol

import pytest

from ...clock import Instant, later
from ...interface import Evidence, HardwareInterface, IndustrialRobotStatusHandle, LinkState, RobotStatus
from ...interface.validation import assumptions, validate

START: Final = Instant(1000.0, 1_800_000_000_000_000)
LIMIT: Final = 64
AT_ONCE: Final = 0.1
"""Seconds that a call may take. The gateway runs in one thread."""
PATIENCE: Final = 10.0
"""Seconds that a test waits for a status. Only a test that fails waits so long."""
STEP: Final = 0.1
"""Seconds that one turn waits for input."""
LONG: Final = 3600.0
"""Seconds of silence after which every status must be unknown."""
NOISE: Final = (b"", b"\0", b"\xff" * 1500, b"\xfd" * 300, b"a=b=c \n;{}[]" * 50, bytes(range(256)) * 4)


class Robot(Protocol):
    """The robot behind the hardware interface under test, or a simulation of it."""

    def make(self, *, replay: bool = False) -> HardwareInterface:
        """Make the hardware interface, as the gateway does with a `HardwareContext`."""

    def speak(self) -> None:
        """Send data that makes at least one field of one status known."""

    def send(self, data: bytes) -> None:
        """Send these bytes. Do nothing if the robot cannot send arbitrary bytes."""


class Driver:
    """Turns a hardware interface as the gateway does."""

    def __init__(self, hardware: HardwareInterface) -> None:
        self.hardware = hardware
        self.now = START
        self.assumptions = assumptions(hardware)

    def turn(self, seconds: float = 0.0) -> None:
        """Advance the time, then do everything that a turn of the gateway does."""
        self.now = later(self.now, seconds)
        for source in self.hardware.sources():
            if source.next_due() <= self.now.mono:
                source.service(self.now)
        self.hardware.read(self.now)
        self.hardware.write(self.now)

    def receive(self, patience: float = 0.0) -> bool:
        """Wait for input and receive it; False if none arrives."""
        poll = select.poll()
        sources = {source.fileno(): source for source in self.hardware.sources() if source.fileno() >= 0}
        for descriptor in sources:
            poll.register(descriptor, select.POLLIN)
        events = poll.poll(patience * 1000)
        for descriptor, event in events:
            assert not event & select.POLLNVAL, f"fileno() gave {descriptor}, which is closed"
            sources[descriptor].receive(self.now, LIMIT)
        return bool(events)

    def wait_for_status(self, robot: Robot) -> None:
        """Let the robot send until a status is known."""
        deadline = time.monotonic() + PATIENCE
        while not self.known():
            assert time.monotonic() < deadline, "the robot has sent data, but no status is known"
            self.turn(STEP)
            robot.speak()
            self.receive(STEP)
            self.turn()

    def known(self) -> list[IndustrialRobotStatusHandle]:
        """The handles with a known field."""
        return [handle for handle in self.hardware.handles if handle.status != RobotStatus()]

    def check(self) -> None:
        """Assert that every handle holds a valid status."""
        for handle in self.hardware.handles:
            broken = validate(handle.status, handle.detail, **self.assumptions)
            assert broken is None, f"{handle.name}: {broken}"


class HardwareConformance:
    """The tests for every hardware interface."""

    @pytest.fixture
    def robot(self) -> Robot:
        """The robot behind the hardware interface under test."""
        raise NotImplementedError(f"{type(self).__name__} needs a fixture `robot`")

    @pytest.fixture
    def driver(self, robot: Robot) -> Iterator[Driver]:
        """The open hardware interface."""
        hardware = robot.make()
        yield Driver(hardware)
        hardware.close()

    def test_its_handles_exist_from_the_start_and_are_unknown(self, driver: Driver) -> None:
        """A configuration can name the handles. A status is unknown before the robot has sent data."""
        assert driver.hardware.handles.get_names()
        driver.turn()
        driver.check()
        assert driver.known() == []

    def test_data_from_the_robot_changes_a_handle(self, driver: Driver, robot: Robot) -> None:
        """The gateway publishes only if `changed` is set."""
        driver.turn()
        driver.hardware.changed = False
        driver.wait_for_status(robot)
        assert driver.hardware.changed
        driver.check()
        assert any(handle.detail.link is LinkState.CONNECTED for handle in driver.known())

    def test_reading_again_changes_nothing(self, driver: Driver, robot: Robot) -> None:
        """A turn without input must publish nothing."""
        driver.wait_for_status(robot)
        driver.hardware.changed = False
        before = [(handle.status, handle.detail) for handle in driver.hardware.handles]
        driver.hardware.read(driver.now)
        assert not driver.hardware.changed
        assert [(handle.status, handle.detail) for handle in driver.hardware.handles] == before

    def test_a_robot_that_falls_silent_becomes_unknown(self, driver: Driver, robot: Robot) -> None:
        """An outdated status is the dangerous answer."""
        driver.wait_for_status(robot)
        driver.hardware.changed = False
        driver.turn(LONG)
        assert driver.known() == []
        assert driver.hardware.changed
        driver.check()

    def test_a_robot_that_sends_again_is_known_again(self, driver: Driver, robot: Robot) -> None:
        """A loss of the link is temporary."""
        for _ in range(2):
            driver.wait_for_status(robot)
            driver.turn(LONG)

    def test_no_call_blocks(self, driver: Driver, robot: Robot) -> None:
        """One thread serves all robots."""
        for known in (False, True):
            if known:
                driver.wait_for_status(robot)
            start = time.monotonic()
            for source in driver.hardware.sources():
                source.receive(driver.now, LIMIT)
                source.receive(driver.now, 1)
            driver.turn(0.01)
            assert time.monotonic() - start < AT_ONCE

    def test_noise_does_not_raise_or_make_a_status_invalid(self, driver: Driver, robot: Robot) -> None:
        """A socket can receive any data."""
        for data in NOISE:
            robot.send(data)
            driver.receive(0.02)
            driver.turn(0.01)
            driver.check()
        driver.wait_for_status(robot)

    def test_a_flood_is_received_in_batches(self, driver: Driver, robot: Robot) -> None:
        """`receive` returns after `limit` datagrams or pieces, even if more wait."""
        for _ in range(2000):
            robot.send(b"x" * 100)
        start = time.monotonic()
        driver.receive()
        driver.turn()
        assert time.monotonic() - start < AT_ONCE

    def test_next_due_does_not_keep_the_processor_busy(self, driver: Driver, robot: Robot) -> None:
        """An interface that is always due would use a whole core."""
        driver.wait_for_status(robot)
        end = driver.now.mono + 10.0
        for _ in range(1000):
            due = driver.hardware.next_due()
            assert isinstance(due, float)
            assert not math.isnan(due)
            if due > end:
                return
            driver.turn(max(due - driver.now.mono, 1e-3))
        pytest.fail("next_due() asks for more than a hundred calls a second")

    def test_explain_may_be_called_at_any_time(self, driver: Driver, robot: Robot) -> None:
        """Even before the robot has sent data, and for a name that is not a handle."""
        for _ in range(2):
            for name in (*driver.hardware.handles.get_names(), "unknown"):
                driver.hardware.explain(name, driver.now)
            driver.wait_for_status(robot)
        for handle in driver.hardware.handles:
            assert set(handle.evidence) <= set(RobotStatus._fields)
            assert all(isinstance(evidence, Evidence) for evidence in handle.evidence.values())

    def test_forget_makes_every_handle_unknown(self, driver: Driver, robot: Robot) -> None:
        """The handles remain: controllers refer to them."""
        driver.wait_for_status(robot)
        before = list(driver.hardware.handles)
        driver.hardware.forget()
        assert list(driver.hardware.handles) == before
        assert driver.known() == []
        driver.turn()
        assert driver.known() == []
        driver.wait_for_status(robot)

    def test_it_can_be_closed_twice_and_made_again(self, robot: Robot) -> None:
        """`close` releases the port or the device."""
        for _ in range(2):
            hardware = robot.make()
            sources = list(hardware.sources())
            hardware.close()
            hardware.close()
            assert [source.fileno() for source in sources if source.fileno() >= 0] == []

    def test_a_replay_opens_nothing_and_has_the_same_handles(self, driver: Driver, robot: Robot) -> None:
        """A running gateway may use the port or the device."""
        replayed = robot.make(replay=True)
        try:
            assert replayed.handles.get_names() == driver.hardware.handles.get_names()
            Driver(replayed).turn(1.0)
        finally:
            replayed.close()
