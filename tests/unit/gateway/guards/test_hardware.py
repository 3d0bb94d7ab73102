from __future__ import annotations

import logging
import math
from collections.abc import Sequence

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.gateway.guards.handle_check import INVALID
from mav_robot_status.gateway.guards.hardware import LONGEST, MOST_AT_ONCE, PAUSE, PERIOD, SLOW, GuardedHardware
from mav_robot_status.interface import (
    Detail,
    IndustrialRobotStatusHandle,
    IoSource,
    LinkState,
    RobotHW,
    RobotMode,
    RobotStatus,
    TriState,
)

START = Instant(100.0, 1_800_000_000_000_000)
KNOWN = RobotStatus(RobotMode.AUTO)


class Arm(RobotHW):
    """A third party's hardware interface. A test makes it fail, block or report invalid values."""

    def __init__(self) -> None:
        super().__init__()
        self.now = START.mono
        self.reports = KNOWN
        self.takes = 0.0
        """Duration of each call in seconds."""
        self.fails = ""
        """The method that raises."""
        self.silent = False
        """Whether `read` sets no status."""
        self.calls: list[str] = []
        self.limits: list[int] = []
        self.handle = IndustrialRobotStatusHandle("arm")
        self.handles.register_handle(self.handle)

    def _do(self, name: str) -> None:
        self.calls.append(name)
        self.now += self.takes
        if name == self.fails:
            raise ZeroDivisionError(name)

    def read(self, now: Instant) -> None:
        self._do("read")
        if not self.silent:
            self.set_status(self.handle, self.reports)

    def write(self, now: Instant) -> None:
        self._do("write")

    def sources(self) -> Sequence[IoSource]:
        self._do("sources")
        return [self]

    def fileno(self) -> int:
        self._do("fileno")
        return 7

    def receive(self, now: Instant, limit: int) -> None:
        self._do("receive")
        self.limits.append(limit)

    def next_due(self, until: float = -math.inf) -> float:
        self._do("next_due")
        return -math.inf

    def close(self) -> None:
        self._do("close")


def guarded() -> tuple[Arm, GuardedHardware]:
    arm = Arm()
    return arm, GuardedHardware(arm, "arm", lambda: arm.now)


def turn(hardware: GuardedHardware, now: Instant = START) -> None:
    """One turn of the gateway."""
    for source in hardware.sources():
        source.fileno()
        source.next_due()
        source.receive(now, 1024)
        source.service(now)
    hardware.read(now)
    hardware.write(now)
    hardware.next_due(now.mono)


@pytest.mark.parametrize("method", ["read", "write", "sources", "fileno", "receive", "next_due"])
def test_an_exception_is_logged_once_and_the_handles_become_unknown(
    method: str, caplog: pytest.LogCaptureFixture
) -> None:
    arm, hardware = guarded()
    turn(hardware)
    assert arm.handle.status == KNOWN
    hardware.changed = False
    arm.fails = method
    for tick in range(4):
        turn(hardware, later(START, 0.1 * tick))
    assert [record.message for record in caplog.records] == [
        "hardware interface 'arm' failed and is stopped; all other parts continue"
    ]
    assert hardware.changed
    assert (arm.handle.status, arm.handle.detail.link) == (RobotStatus(), LinkState.LOST)
    assert [inhibit.name for inhibit in arm.handle.detail.inhibits] == ["LINK_STALE"]
    assert (list(hardware.sources()), hardware.next_due()) == ([], math.inf)


def test_a_failure_causes_an_immediate_turn_and_unknown_handles() -> None:
    arm, hardware = guarded()
    turn(hardware)
    arm.fails = "receive"
    hardware.sources()[0].receive(START, 1)
    assert hardware.next_due() == -math.inf


def test_a_value_of_the_wrong_type_makes_the_handle_unknown_and_the_interface_keeps_running(
    caplog: pytest.LogCaptureFixture,
) -> None:
    arm, hardware = guarded()
    turn(hardware)
    arm.reports = KNOWN._replace(mode="AUTO")  # type: ignore[arg-type]
    details = set()
    for tick in range(4):
        turn(hardware, later(START, 0.1 * tick))
        assert arm.handle.status == RobotStatus()
        details.add(arm.handle.detail)
    assert [inhibit.text for detail in details for inhibit in detail.inhibits] == [INVALID]
    assert [record.message for record in caplog.records] == [
        "hardware interface 'arm' puts invalid values into the handle 'arm', which is unknown while it does: "
        "mode: must be a RobotMode, not 'AUTO'"
    ]
    assert "write" in arm.calls


def test_the_first_valid_value_restores_an_unknown_handle(caplog: pytest.LogCaptureFixture) -> None:
    arm, hardware = guarded()
    arm.reports = None  # type: ignore[assignment]
    turn(hardware)
    arm.reports = KNOWN
    turn(hardware)
    assert (arm.handle.status, arm.handle.detail) == (KNOWN, Detail())
    assert len(caplog.records) == 1


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("status", RobotStatus(e_stopped=TriState.TRUE)),
        ("status", "AUTO"),
        ("detail", Detail(errors=["BATTERY_LOW"])),  # type: ignore[arg-type]
        ("evidence", {"mode": "teach pendant"}),
    ],
)
def test_every_invalid_value_makes_its_handle_unknown(name: str, value: object) -> None:
    arm, hardware = guarded()
    turn(hardware)
    setattr(arm.handle, name, value)
    arm.reports = arm.handle.status
    hardware.read(START)
    assert (arm.handle.status, arm.handle.detail.link) == (RobotStatus(), LinkState.LOST)
    assert arm.handle.evidence == {}


def test_an_invalid_value_of_one_handle_does_not_affect_other_handles(caplog: pytest.LogCaptureFixture) -> None:
    arm, hardware = guarded()
    gripper = IndustrialRobotStatusHandle("gripper", RobotStatus(RobotMode.MANUAL))
    arm.handles.register_handle(gripper)
    arm.reports = None  # type: ignore[assignment]
    turn(hardware)
    assert (arm.handle.status, gripper.status) == (RobotStatus(), RobotStatus(RobotMode.MANUAL))


@pytest.mark.parametrize("heard_at", ["now", math.nan, True])
def test_an_invalid_time_of_the_last_message_becomes_none(heard_at: object, caplog: pytest.LogCaptureFixture) -> None:
    arm, hardware = guarded()
    for _ in range(3):
        arm.handle.heard_at = heard_at  # type: ignore[assignment]
        turn(hardware)
        assert arm.handle.heard_at is None
    assert len(caplog.records) == 1


def test_a_value_that_cannot_be_printed_stops_the_interface() -> None:
    class Unprintable:
        def __repr__(self) -> str:
            raise ZeroDivisionError

    arm, hardware = guarded()
    arm.reports = Unprintable()  # type: ignore[assignment]
    turn(hardware)
    turn(hardware)
    assert arm.handle.status == RobotStatus()
    assert hardware.next_due() == math.inf


def test_a_pause_of_several_times_its_duration_follows_a_slow_call(caplog: pytest.LogCaptureFixture) -> None:
    arm, hardware = guarded()
    hardware.sources()
    arm.takes = 10 * SLOW
    hardware.read(START)
    ended = arm.now
    arm.calls.clear()
    arm.takes = 0.0
    turn(hardware)
    assert arm.calls == []
    assert hardware.next_due() == pytest.approx(START.mono + LONGEST + PERIOD)
    arm.now = ended + PAUSE * 10 * SLOW
    turn(hardware)
    assert "read" in arm.calls
    assert [r.levelno for r in caplog.records] == [logging.WARNING]
    assert "took 1.0 s for one call" in caplog.text


def test_the_handles_are_unknown_while_nobody_has_read_them_for_long() -> None:
    """A process that was stopped for 5 s within a call does not call the interface for 20 s more."""
    arm, hardware = guarded()
    arm.takes = 5.0
    hardware.read(START)
    arm.takes = 0.0
    assert arm.handle.status == RobotStatus()
    assert (arm.handle.detail.link, hardware.changed) == (LinkState.LOST, True)
    assert arm.handle.detail.inhibits[0].text == "its hardware interface is too slow"
    end = hardware.next_due()
    assert end == pytest.approx(START.mono + 5.0 + PAUSE * 5.0)
    hardware.changed = False
    arm.now = end
    hardware.read(later(START, end - START.mono))
    assert (arm.handle.status, hardware.changed) == (KNOWN, True)


def test_handles_that_did_not_change_while_they_were_unknown_are_shown_again() -> None:
    arm, hardware = guarded()
    turn(hardware)
    arm.takes = 5.0
    hardware.read(START)
    arm.takes, arm.silent = 0.0, True
    arm.now = hardware.next_due()
    hardware.read(later(START, arm.now - START.mono))
    assert arm.handle.status == KNOWN


def test_an_interface_that_is_always_due_is_called_a_hundred_times_a_second() -> None:
    _, hardware = guarded()
    turn(hardware)
    assert hardware.next_due() == START.mono + PERIOD
    hardware.sources()[0].receive(START, 1)
    assert hardware.next_due() == START.mono + PERIOD


def test_a_flood_is_read_in_limited_batches() -> None:
    arm, hardware = guarded()
    turn(hardware)
    assert arm.limits == [MOST_AT_ONCE]


def test_an_interface_removed_from_the_configuration_is_unknown_and_not_called(
    caplog: pytest.LogCaptureFixture,
) -> None:
    arm, hardware = guarded()
    turn(hardware)
    hardware.retire()
    arm.calls.clear()
    turn(hardware)
    assert arm.calls == []
    assert arm.handle.detail.inhibits[0].text == "its hardware interface is no longer configured"
    assert not caplog.records


def test_a_failed_interface_is_closed() -> None:
    arm, hardware = guarded()
    arm.fails = "read"
    turn(hardware)
    hardware.close()
    assert arm.calls[-1] == "close"
