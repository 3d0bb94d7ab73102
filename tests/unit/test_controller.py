"""`IndustrialRobotStatusController`: rate, phase, changes and busy outputs."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Iterable, Mapping, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.clock import Instant, later
from mav_robot_status.controller import RETRY, IndustrialRobotStatusController
from mav_robot_status.errors import ConfigError, UnknownHandleError
from mav_robot_status.interface import (
    DEFAULT_HANDLE_NAME,
    IndustrialRobotStatusHandle,
    IndustrialRobotStatusInterface,
    Inhibit,
    InterfaceManager,
    RobotStatusMsg,
    TriState,
)
from mav_robot_status.interface import RobotStatus as Status

START = Instant(1000.0, 1_795_200_000_000_000)
PERIODIC_ONLY: Mapping[str, object] = {"publish_rate": 10, "publish_on_change": False}


class Collector:
    """A publisher that stores its messages. A test sets `is_busy`."""

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
    """Hardware with one handle, a controller started at START, and its outputs."""

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


def hardware(*handles: IndustrialRobotStatusHandle) -> InterfaceManager:
    interface = IndustrialRobotStatusInterface()
    for handle in handles:
        interface.register_handle(handle)
    interfaces = InterfaceManager()
    interfaces.register_interface(interface)
    return interfaces


def steps(seconds: float, step: float) -> Iterable[float]:
    return (i * step for i in range(1, round(seconds / step) + 1))


# -- init ----------------------------------------------------------------------------------------------------------


def test_the_defaults_are_ten_hertz_on_change_and_the_default_handle() -> None:
    rig = Rig({})
    assert rig.controller.publish_rate == 10.0
    assert rig.controller.publish_on_change
    assert rig.controller.handle is rig.handle


def test_each_default_in_use_is_logged(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    Rig({})
    assert [record.getMessage() for record in caplog.records] == [
        "'publish_rate' not set, using default: 10 Hz",
        "'handle_name' not set, using default: 'industrial_robot_status_handle'",
    ]


@pytest.mark.parametrize(
    ("parameters", "found"),
    [
        ({"publish_rate": "fast"}, "publish_rate: must be a number of Hz, not 'fast'"),
        ({"publish_rate": True}, "publish_rate: must be a number of Hz, not True"),
        ({"publish_rate": math.nan}, "publish_rate: must be a number of Hz, not nan"),
        ({"publish_rate": math.inf}, "publish_rate: must be a number of Hz, not inf"),
        ({"handle_name": 7}, "handle_name: must be a text, not 7"),
        ({"publish_on_change": "no"}, "publish_on_change: must be true or false, not 'no'"),
    ],
)
def test_a_parameter_of_the_wrong_type_is_an_error_that_names_it(parameters: dict[str, object], found: str) -> None:
    with pytest.raises(ConfigError) as error:
        Rig(parameters)
    assert str(error.value) == found


def test_nothing_is_logged_if_every_parameter_is_set(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    rig = Rig({"publish_rate": 2, "handle_name": DEFAULT_HANDLE_NAME})
    assert rig.controller.publish_rate == 2.0
    assert not caplog.records


def test_an_unknown_handle_is_an_error_that_lists_the_known_names() -> None:
    hw = hardware(IndustrialRobotStatusHandle("rover"), IndustrialRobotStatusHandle("copter"))
    with pytest.raises(UnknownHandleError, match="no handle 'boat'; registered: 'rover', 'copter'"):
        IndustrialRobotStatusController().init(hw, {"handle_name": "boat"}, ())


# -- the message ---------------------------------------------------------------------------------------------------


def test_a_message_has_the_time_of_the_update_and_the_name_of_its_handle() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.change(7)
    rig.handle.heard_at = START.mono
    rig.update(0.25)
    msg = rig.out.messages[0]
    assert msg.unix_us == START.unix_us + 250_000
    assert (msg.handle, msg.status.error_code, msg.detail) == (DEFAULT_HANDLE_NAME, 7, rig.handle.detail)
    assert msg.heartbeat_age == pytest.approx(0.25)


def test_the_controller_reads_the_registered_handle_itself() -> None:
    rig = Rig(PERIODIC_ONLY)
    registered = rig.hw.get(IndustrialRobotStatusInterface).get_handle(DEFAULT_HANDLE_NAME)
    registered.status = Status(in_error=TriState.TRUE, error_code=7)
    rig.update(0.2)
    assert rig.out.messages[0].status is registered.status


def test_a_message_is_handed_over_in_the_thread_of_the_update() -> None:
    threads = []

    class Remembers(Collector):
        def publish(self, msg: RobotStatusMsg) -> None:
            threads.append(threading.current_thread())

    Rig(PERIODIC_ONLY, Remembers()).update(0.2)
    assert threads == [threading.current_thread()]


def test_a_robot_without_a_heartbeat_has_no_age() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.25)
    assert rig.out.messages[0].heartbeat_age is None


# -- the rate ------------------------------------------------------------------------------------------------------


def test_the_rate_gate_keeps_its_phase_over_a_thousand_updates_at_odd_times() -> None:
    rig = Rig(PERIODIC_ONLY)
    times = [0.0137 * i for i in range(1, 1001)]  # 13.7 s, not a divisor of the period
    rig.update(*times)
    expected = [next(t for t in times if t > n * 0.1 + 1e-9) for n in range(1, 137)]
    assert rig.out.times == pytest.approx(expected)


def test_a_message_is_due_strictly_later_than_a_period_after_the_last() -> None:
    rig = Rig({"publish_rate": 4, "publish_on_change": False})  # a period without rounding
    rig.update(0.25)
    assert not rig.out.messages
    rig.controller.update(Instant(math.nextafter(START.mono + 0.25, math.inf), START.unix_us), 0.0)
    assert len(rig.out.messages) == 1


def test_no_message_is_published_before_the_first_period_ends() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.0, 0.03, 0.06, 0.09)
    assert not rig.out.messages


@pytest.mark.parametrize("rate", [0, -1, -0.001])
def test_nothing_is_published_periodically_at_a_rate_of_zero_or_less(rate: float) -> None:
    rig = Rig({"publish_rate": rate, "publish_on_change": False})
    rig.update(*steps(100, 1))
    assert not rig.out.messages
    assert rig.next_due(100) == math.inf


def test_changes_are_published_at_a_rate_of_zero() -> None:
    rig = Rig({"publish_rate": 0})
    rig.update(0.0, 1.0)
    rig.change(1)
    rig.update(2.0, 3.0)
    assert rig.out.times == [0.0, 2.0]


def test_an_output_that_is_not_periodic_gets_no_periodic_messages() -> None:
    periodic, changes = Collector(), Collector(periodic=False)
    rig = Rig({"publish_rate": 10}, periodic, changes)
    rig.update(*steps(1, 0.15))
    assert len(changes.messages) == 1  # the first state
    assert len(periodic.messages) > 5


class Resting(Collector):
    """A publisher that has no use for periodic messages within a second of the last one."""

    def rests_until(self, handle: str) -> float:
        assert handle == DEFAULT_HANDLE_NAME
        return START.mono + self.times[-1] + 1.0 if self.messages else -math.inf


def test_an_output_that_rests_gets_changes_and_no_periodic_messages() -> None:
    busy, resting = Collector(), Resting()
    rig = Rig({"publish_rate": 10}, busy, resting)
    rig.update(*steps(0.5, 0.05))
    rig.change(1)
    rig.update(0.52)
    rig.update(*(0.55 + step for step in steps(1.2, 0.05)))
    assert resting.times == pytest.approx([0.05, 0.52, 1.55])
    assert len(busy.messages) > 15


def test_a_controller_sleeps_while_its_only_output_rests() -> None:
    rig = Rig({"publish_rate": 10}, Resting())
    rig.update(0.0)
    assert rig.next_due(0.0) == pytest.approx(1.0)
    rig.change(1)
    assert rig.next_due(0.3) == pytest.approx(0.3, abs=0.03)


def test_no_output_rests_while_a_change_shows_in_periodic_messages_only() -> None:
    rig = Rig(PERIODIC_ONLY, Resting())
    rig.update(*steps(0.95, 0.05))
    assert len(rig.out.messages) == 9


def test_a_stall_is_not_followed_by_a_burst() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.11, 5.03, 5.04, 5.05, 5.09)
    assert rig.out.times == [0.11, 5.03]


def test_the_phase_survives_a_stall() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.11, 5.03, 5.09, 5.11, 5.19, 5.21)
    assert rig.out.times == [0.11, 5.03, 5.11, 5.21]


def test_an_absurd_rate_after_a_stall_is_harmless() -> None:
    rig = Rig({"publish_rate": 1e308, "publish_on_change": False})
    rig.update(1.0, 500.0, 500.1)
    assert len(rig.out.messages) == 3


def test_starting_again_restarts_the_phase() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.11)
    rig.controller.stopping(later(START, 0.15))
    rig.update(0.35)  # between stopping and starting: nothing
    rig.controller.starting(later(START, 0.45))
    rig.update(0.5, 0.54, 0.56)
    assert rig.out.times == [0.11, 0.56]


# -- busy outputs --------------------------------------------------------------------------------------------------


def test_a_busy_output_is_skipped_and_retried_at_the_next_update_without_moving_the_phase() -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.out.is_busy = True
    rig.update(0.11, 0.13)
    assert not rig.out.messages
    assert rig.next_due(0.13) <= 0.13 + RETRY + 1e-9
    rig.out.is_busy = False
    rig.update(0.15, 0.19, 0.21)
    assert rig.out.times == [0.15, 0.21]


def test_skipped_messages_are_counted_and_logged_at_the_end(caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.out.is_busy = True
    rig.update(0.11, 0.12, 0.13)
    rig.controller.stopping(later(START, 1))
    assert caplog.messages == [f"{DEFAULT_HANDLE_NAME}: an output was busy 1 times, and messages were skipped"]


def test_nothing_is_logged_at_the_end_without_skipped_messages(caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig(PERIODIC_ONLY)
    rig.update(0.11)
    rig.controller.stopping(later(START, 1))
    assert not caplog.messages


def test_a_busy_output_does_not_delay_another() -> None:
    slow, quick = Collector(), Collector()
    rig = Rig(PERIODIC_ONLY, slow, quick)
    slow.is_busy = True
    rig.update(0.11, 0.21)
    assert quick.times == [0.11, 0.21]
    assert not slow.messages


def test_a_change_while_an_output_is_busy_is_published_afterwards() -> None:
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
    rig.handle.detail = rig.handle.detail._replace(inhibits=(Inhibit("DISARMED", None, 0),))
    rig.update(0.03)
    assert len(rig.out.messages) == 2


def test_setting_an_equal_status_is_not_a_change() -> None:
    rig = Rig({"publish_rate": 0})
    rig.change(1)
    rig.update(0.0)
    rig.change(1)
    rig.update(0.03)
    assert rig.out.times == [0.0]


def test_the_age_of_the_heartbeat_is_not_a_change() -> None:
    rig = Rig({"publish_rate": 0})
    rig.update(0.0)
    rig.handle.heard_at = START.mono + 0.02
    rig.update(0.03)
    assert rig.out.times == [0.0]


def test_changes_are_not_published_if_that_is_disabled() -> None:
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


def test_a_flood_of_changes_does_not_affect_the_periodic_messages() -> None:
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


def test_all_outputs_of_one_update_get_the_same_message() -> None:
    one, other = Collector(), Collector()
    Rig(PERIODIC_ONLY, one, other).update(0.11)
    assert one.messages[0] is other.messages[0]


def test_two_controllers_publish_their_own_handles() -> None:
    rover, copter = IndustrialRobotStatusHandle("rover"), IndustrialRobotStatusHandle("copter")
    hw, out = hardware(rover, copter), Collector()
    for handle in (rover, copter):
        controller = IndustrialRobotStatusController()
        controller.init(hw, {**PERIODIC_ONLY, "handle_name": handle.name}, [out])
        controller.starting(START)
        controller.update(later(START, 0.15), 0.15)
    assert [m.handle for m in out.messages] == ["rover", "copter"]


# -- next_due --------------------------------------------------------------------------------------------------------


def test_an_update_at_the_time_of_next_due_publishes() -> None:
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
def test_the_number_of_periodic_messages_equals_the_elapsed_periods_without_a_stall(
    rate: float, waits: Sequence[float]
) -> None:
    """Updates at any times, at most a period apart: no message is lost or duplicated."""
    rig = Rig({"publish_rate": rate, "publish_on_change": False, "handle_name": DEFAULT_HANDLE_NAME})
    at = 0.0
    for wait in waits:
        at += wait / rate
        rig.update(at)
        assert abs(len(rig.out.messages) - at * rate) <= 1 + 1e-6


@given(st.floats(0.1, 100), st.lists(st.floats(0, 30), max_size=100))
def test_any_updates_give_at_most_one_message_a_period(rate: float, waits: Sequence[float]) -> None:
    rig = Rig({"publish_rate": rate, "publish_on_change": False, "handle_name": DEFAULT_HANDLE_NAME})
    at = 0.0
    for wait in waits:
        at += wait / rate
        rig.update(at)
    assert len(rig.out.messages) <= at * rate + 1e-6
    assert len(rig.out.messages) <= len(waits)
