"""`IndustrialRobotStatusController`: rate, phase, change, and what a busy output costs."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Mapping, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.clock import Instant, later
from mav_robot_status.controller import RETRY, IndustrialRobotStatusController
from mav_robot_status.errors import UnknownHandleError
from mav_robot_status.interface import (
    DEFAULT_HANDLE_NAME,
    IndustrialRobotStatusHandle,
    IndustrialRobotStatusInterface,
    Inhibit,
    RobotHW,
    RobotStatusMsg,
    TriState,
)
from mav_robot_status.interface import RobotStatus as Status

START = Instant(1000.0, 1_795_200_000_000_000)
PERIODIC_ONLY: Mapping[str, object] = {"publish_rate": 10, "publish_on_change": False}


class Collector:
    """A publisher that keeps what it is given; `is_busy` is for the test to set."""

    def __init__(self, *, periodic: bool = True) -> None:
        self.periodic = periodic
        self.is_busy = False
        self.messages: list[RobotStatusMsg] = []

    def busy(self) -> bool:
        return self.is_busy

    def publish(self, msg: RobotStatusMsg) -> None:
        assert not self.is_busy
        self.messages.append(msg)

    def service(self, now: Instant) -> float | None:
        return None

    def close(self) -> None:
        pass

    @property
    def times(self) -> list[float]:
        """Seconds since START, to the microsecond."""
        return [(m.unix_us - START.unix_us) / 1e6 for m in self.messages]


class Rig:
    """A hardware with one handle, a controller that has been started at START, and its outputs."""

    def __init__(self, parameters: Mapping[str, object], *outputs: Collector) -> None:
        self.handle = IndustrialRobotStatusHandle(DEFAULT_HANDLE_NAME)
        self.hw = hardware(self.handle)
        self.out = outputs[0] if outputs else Collector()
        self.controller = IndustrialRobotStatusController()
        self.controller.init(self.hw, parameters, outputs or (self.out,))
        self.controller.starting(START)
        self._last = 0.0

    def update(self, *times: float) -> None:
        """Update at these times, in seconds since START."""
        for at in times:
            self.controller.update(later(START, at), at - self._last)
            self._last = at

    def change(self, code: int) -> None:
        self.handle.status = Status(in_error=TriState.TRUE, error_code=code)

    def next_due(self, at: float) -> float:
        """In seconds since START."""
        return self.controller.next_due(START.mono + at) - START.mono


def hardware(*handles: IndustrialRobotStatusHandle) -> RobotHW:
    interface = IndustrialRobotStatusInterface()
    for handle in handles:
        interface.register_handle(handle)
    hw = RobotHW()
    hw.register_interface(interface)
    return hw


def steps(seconds: float, step: float) -> Iterable[float]:
    return (i * step for i in range(1, round(seconds / step) + 1))


# -- init ----------------------------------------------------------------------------------------------------------


def test_the_defaults_are_ten_hertz_on_change_and_the_usual_handle() -> None:
    rig = Rig({})
    assert rig.controller.publish_rate == 10.0
    assert rig.controller.publish_on_change
    assert rig.controller.handle is rig.handle


def test_each_default_that_is_used_is_announced_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    Rig({})
    assert [record.getMessage() for record in caplog.records] == [
        "'publish_rate' not set, using default: 10 Hz",
        "'handle_name' not set, using default: 'industrial_robot_status_handle'",
    ]


def test_nothing_is_announced_if_everything_is_set(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    rig = Rig({"publish_rate": 2, "handle_name": DEFAULT_HANDLE_NAME})
    assert rig.controller.publish_rate == 2.0
    assert not caplog.records


def test_an_unknown_handle_is_an_error_that_lists_the_names_there_are() -> None:
    hw = hardware(IndustrialRobotStatusHandle("rover"), IndustrialRobotStatusHandle("copter"))
    with pytest.raises(UnknownHandleError, match="no handle 'boat'; registered: 'rover', 'copter'"):
        IndustrialRobotStatusController().init(hw, {"handle_name": "boat"}, ())


# -- the message ---------------------------------------------------------------------------------------------------


def test_a_message_is_stamped_with_the_time_of_the_update_and_says_whose_it_is() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.change(7)
    rig.handle.heard_at = START.mono
    rig.update(0.25)
    msg = rig.out.messages[0]
    assert msg.unix_us == START.unix_us + 250_000
    assert (msg.handle, msg.status.error_code, msg.detail) == (DEFAULT_HANDLE_NAME, 7, rig.handle.detail)
    assert msg.heartbeat_age == pytest.approx(0.25)


def test_a_robot_that_was_never_heard_has_no_age() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.25)
    assert rig.out.messages[0].heartbeat_age is None


# -- the rate ------------------------------------------------------------------------------------------------------


def test_the_rate_gate_keeps_its_phase_over_a_thousand_updates_at_odd_times() -> None:
    rig = Rig(PERIODIC_ONLY)
    times = [0.0137 * i for i in range(1, 1001)]  # 13.7 s, no divisor of the period
    rig.update(*times)
    expected = [next(t for t in times if t > n * 0.1 + 1e-9) for n in range(1, 137)]
    assert rig.out.times == pytest.approx(expected)


def test_a_message_is_due_strictly_later_than_a_period_after_the_last() -> None:
    rig = Rig({"publish_rate": 4, "publish_on_change": False})  # a period without rounding
    rig.update(0.25)
    assert not rig.out.messages
    rig.controller.update(Instant(math.nextafter(START.mono + 0.25, math.inf), START.unix_us), 0.0)
    assert len(rig.out.messages) == 1


def test_no_message_comes_before_the_first_period_is_over() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.0, 0.03, 0.06, 0.09)
    assert not rig.out.messages


@pytest.mark.parametrize("rate", [0, -1, -0.001])
def test_nothing_is_published_periodically_at_a_rate_of_zero_or_less(rate: float) -> None:
    rig = Rig({"publish_rate": rate, "publish_on_change": False})
    rig.update(*steps(100, 1))
    assert not rig.out.messages
    assert rig.next_due(100) == math.inf


def test_changes_still_come_at_a_rate_of_zero() -> None:
    rig = Rig({"publish_rate": 0})
    rig.update(0.0, 1.0)
    rig.change(1)
    rig.update(2.0, 3.0)
    assert rig.out.times == [0.0, 2.0]


def test_an_output_that_wants_no_periodic_messages_gets_none() -> None:
    periodic, changes = Collector(), Collector(periodic=False)
    rig = Rig({"publish_rate": 10}, periodic, changes)
    rig.update(*steps(1, 0.15))
    assert len(changes.messages) == 1  # the first state
    assert len(periodic.messages) > 5


def test_a_stall_is_not_followed_by_a_burst() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.11, 5.03, 5.04, 5.05, 5.09)
    assert rig.out.times == [0.11, 5.03]


def test_the_phase_survives_a_stall() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.11, 5.03, 5.09, 5.11, 5.19, 5.21)
    assert rig.out.times == [0.11, 5.03, 5.11, 5.21]


def test_a_rate_beyond_reason_after_a_stall_does_no_harm() -> None:
    rig = Rig({"publish_rate": 1e308, "publish_on_change": False})
    rig.update(1.0, 500.0, 500.1)
    assert len(rig.out.messages) == 3


def test_starting_again_begins_the_phase_anew() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.11)
    rig.controller.stopping(later(START, 0.15))
    rig.update(0.35)  # between stopping and starting: nothing
    rig.controller.starting(later(START, 0.45))
    rig.update(0.5, 0.54, 0.56)
    assert rig.out.times == [0.11, 0.56]


# -- busy outputs --------------------------------------------------------------------------------------------------


def test_a_busy_output_is_skipped_and_asked_again_at_the_next_update_without_moving_the_phase() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.out.is_busy = True
    rig.update(0.11, 0.13)
    assert not rig.out.messages
    assert rig.next_due(0.13) <= 0.13 + RETRY + 1e-9
    rig.out.is_busy = False
    rig.update(0.15, 0.19, 0.21)
    assert rig.out.times == [0.15, 0.21]


def test_what_was_skipped_is_counted_and_told_at_the_end(caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.out.is_busy = True
    rig.update(0.11, 0.12, 0.13)
    rig.controller.stopping(later(START, 1))
    assert caplog.messages == [f"{DEFAULT_HANDLE_NAME}: an output was busy 1 times, and messages were skipped"]


def test_nothing_is_told_at_the_end_if_nothing_was_skipped(caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.11)
    rig.controller.stopping(later(START, 1))
    assert not caplog.messages


def test_a_busy_output_does_not_hold_up_another() -> None:
    slow, quick = Collector(), Collector()
    rig = Rig(PERIODIC_ONLY, slow, quick)
    slow.is_busy = True
    rig.update(0.11, 0.21)
    assert quick.times == [0.11, 0.21]
    assert not slow.messages


def test_a_change_during_which_an_output_was_busy_is_published_after_it() -> None:
    rig = Rig({"publish_rate": 0})
    rig.update(0.0)
    rig.out.is_busy = True
    rig.change(1)
    rig.update(0.01)
    rig.change(2)
    rig.update(0.02)
    rig.out.is_busy = False
    rig.update(0.04)
    assert [m.status.error_code for m in rig.out.messages] == [0, 2]


# -- changes -------------------------------------------------------------------------------------------------------


def test_the_first_state_is_published_at_once() -> None:
    rig = Rig({})
    rig.update(0.0)
    assert rig.out.times == [0.0]


def test_a_change_is_published_at_once_and_only_once() -> None:
    rig = Rig({})
    rig.update(0.0)
    rig.change(1)
    rig.update(0.03, 0.05, 0.07)
    assert rig.out.times == [0.0, 0.03]


def test_a_change_of_the_detail_is_a_change() -> None:
    rig = Rig({})
    rig.update(0.0)
    rig.handle.detail = rig.handle.detail._replace(inhibits=(Inhibit(1, "DISARMED", None, 0),))
    rig.update(0.03)
    assert len(rig.out.messages) == 2


def test_an_equal_status_that_is_set_again_is_no_change() -> None:
    rig = Rig({"publish_rate": 0})
    rig.change(1)
    rig.update(0.0)
    rig.change(1)
    rig.update(0.03)
    assert rig.out.times == [0.0]


def test_the_age_of_the_heartbeat_is_no_change() -> None:
    rig = Rig({"publish_rate": 0})
    rig.update(0.0)
    rig.handle.heard_at = START.mono + 0.02
    rig.update(0.03)
    assert rig.out.times == [0.0]


def test_changes_are_not_published_if_they_are_not_wanted() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.change(1)
    rig.update(0.05)
    assert not rig.out.messages


def test_a_change_does_not_move_the_phase_of_the_periodic_messages() -> None:
    rig = Rig({})
    rig.update(0.0, 0.11)
    rig.change(1)
    rig.update(0.17, 0.19, 0.21, 0.29, 0.31)
    assert rig.out.times == [0.0, 0.11, 0.17, 0.21, 0.31]


def test_at_most_twenty_changes_are_published_in_any_second_and_the_last_state_always() -> None:
    rig = Rig({"publish_rate": 0})
    times = list(steps(3, 0.01))
    for i, at in enumerate(times):
        rig.change(i + 1)
        rig.update(at)
    published = rig.out.times
    assert all(sum(t <= u < t + 1 - 1e-6 for u in published) <= 20 for t in published)
    assert len(published) == 3 * 20
    at = rig.next_due(3.0)
    assert 3.0 < at <= 4.0
    rig.update(at + 1e-9)
    assert rig.out.messages[-1].status.error_code == len(times)
    assert rig.next_due(at) == math.inf


def test_a_flood_of_changes_leaves_the_periodic_messages_alone() -> None:
    rig = Rig({})
    for i, at in enumerate(steps(2, 0.01)):
        rig.change(i + 1)
        rig.update(at)
    for n in range(1, 20):  # a message just after each whole period
        assert any(0 < t - n * 0.1 < 0.015 for t in rig.out.times)


# -- several ---------------------------------------------------------------------------------------------------------


def test_several_controllers_read_one_handle_each_at_its_own_rate() -> None:
    handle = IndustrialRobotStatusHandle(DEFAULT_HANDLE_NAME)
    hw = hardware(handle)
    outputs = {rate: Collector() for rate in (1.0, 5.0, 20.0)}
    controllers = []
    for rate, out in outputs.items():
        controller = IndustrialRobotStatusController()
        controller.init(hw, {"publish_rate": rate, "publish_on_change": False}, [out])
        controller.starting(START)
        controllers.append(controller)
    for at in steps(2.005, 0.005):
        for controller in controllers:
            controller.update(later(START, at), 0.005)
    assert {rate: len(out.messages) for rate, out in outputs.items()} == {1.0: 2, 5.0: 10, 20.0: 40}


def test_all_outputs_of_one_update_are_handed_the_same_message() -> None:
    one, other = Collector(), Collector()
    Rig(PERIODIC_ONLY, one, other).update(0.11)
    assert one.messages[0] is other.messages[0]


def test_a_controller_of_each_of_two_handles_publishes_its_own() -> None:
    rover, copter = IndustrialRobotStatusHandle("rover"), IndustrialRobotStatusHandle("copter")
    hw, out = hardware(rover, copter), Collector()
    for handle in (rover, copter):
        controller = IndustrialRobotStatusController()
        controller.init(hw, {**PERIODIC_ONLY, "handle_name": handle.name}, [out])
        controller.starting(START)
        controller.update(later(START, 0.15), 0.15)
    assert [m.handle for m in out.messages] == ["rover", "copter"]


# -- next_due --------------------------------------------------------------------------------------------------------


def test_an_update_at_the_time_that_next_due_names_publishes() -> None:
    rig = Rig(PERIODIC_ONLY)
    at = START.mono
    for n in range(1, 50):
        at = rig.controller.next_due(at)
        rig.controller.update(Instant(at, 0), 0.0)
        assert len(rig.out.messages) == n


@given(
    st.sampled_from([0.0, 0.3, 3.0, 10.0, 33.3, 1000.0]),
    st.booleans(),
    st.lists(st.tuples(st.floats(0, 2), st.booleans(), st.booleans()), max_size=60),
)
def test_next_due_is_never_in_the_past(rate: float, on_change: bool, life: Sequence[tuple[float, bool, bool]]) -> None:
    rig = Rig({"publish_rate": rate, "publish_on_change": on_change, "handle_name": DEFAULT_HANDLE_NAME})
    at = 0.0
    for number, (wait, changes, is_busy) in enumerate(life):
        at += wait
        if changes:
            rig.change(number + 1)
        rig.out.is_busy = is_busy
        rig.update(at)
        assert rig.controller.next_due(later(START, at).mono) > later(START, at).mono


@given(st.floats(0.1, 100), st.lists(st.floats(0.001, 0.999), min_size=1, max_size=300))
def test_the_number_of_periodic_messages_is_that_of_the_elapsed_periods_unless_stalled(
    rate: float, waits: Sequence[float]
) -> None:
    """Updates never further apart than a period, at any times: not one message is lost or doubled."""
    rig = Rig({"publish_rate": rate, "publish_on_change": False, "handle_name": DEFAULT_HANDLE_NAME})
    at = 0.0
    for wait in waits:
        at += wait / rate
        rig.update(at)
        assert abs(len(rig.out.messages) - at * rate) <= 1 + 1e-6


@given(st.floats(0.1, 100), st.lists(st.floats(0, 30), max_size=100))
def test_however_updates_come_there_are_never_more_messages_than_periods(rate: float, waits: Sequence[float]) -> None:
    rig = Rig({"publish_rate": rate, "publish_on_change": False, "handle_name": DEFAULT_HANDLE_NAME})
    at = 0.0
    for wait in waits:
        at += wait / rate
        rig.update(at)
    assert len(rig.out.messages) <= at * rate + 1e-6
    assert len(rig.out.messages) <= len(waits)
