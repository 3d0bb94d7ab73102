"""The status of a PX4 that sends events: why it cannot be armed, exact failsafes, and the requests for what is lost."""

from __future__ import annotations

from collections.abc import Iterable
from struct import pack

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.px4_events.ids import ALL_MODES, event_id
from mav_robot_status.interface import Inhibit, TriState
from mav_robot_status.mavlink.definitions import CommandLong, CurrentEventSequence, Event, RequestEvent
from mav_robot_status.mavlink.enumerations import MAV_CMD_RUN_PREARM_CHECKS

from ..driver import ACTIVE, CRITICAL, FITTED, GPS, PREARM, STANDBY, Flight, copter, px4
from ..px4_reports import (
    BARE,
    BLOCKED,
    LOITER,
    MANUAL,
    MANUAL_GROUP,
    MISSION,
    NO_FIX_NOW,
    NO_STICKS,
    NO_STICKS_NOW,
    RC_LOSS,
    event,
    report,
    table,
)

UNINIT = 0
POSITION_HOLD = 3 << 16
NOT_READY = FITTED & ~PREARM
HOLD = event_id("commander_failsafe_enter_hold")


def grounded(mode: int = LOITER, *, words: bool = True, options: HardwareOptions | None = None) -> Flight:
    """A disarmed PX4 that is not ready, for some time."""
    flight = px4(options=options).hb(mode=mode, state=STANDBY).set(health=NOT_READY)
    if words:
        flight.hw.use_event_table(None, table())
    return later(flight, 5)


def later(flight: Flight, seconds: float) -> Flight:
    flight.wait(seconds)
    return flight


def send(flight: Flight, events: Iterable[Event]) -> Flight:
    for one in events:
        flight.send(one)
    return flight


def prearm(flight: Flight) -> list[Inhibit]:
    return [inhibit for inhibit in flight.detail.inhibits if inhibit.name == "PREARM_FAILING"]


def texts(flight: Flight) -> list[str | None]:
    return [inhibit.text for inhibit in prearm(flight)]


def test_each_failing_check_of_the_current_mode_is_an_inhibit() -> None:
    flight = send(grounded(), report(1, failing=(NO_STICKS_NOW, NO_FIX_NOW)))
    assert texts(flight) == ["GPS 2 has no fix", "No sticks"]
    assert flight.detail.vehicle.can_arm is False
    assert flight.detail.vehicle.modes_blocked == ("AUTO.LOITER", "AUTO.MISSION")


def test_a_mode_that_can_be_armed_has_no_failing_check() -> None:
    flight = send(grounded(MANUAL), report(1)).set(health=FITTED | PREARM)
    flight.wait(2)
    assert flight.detail.vehicle.can_arm is True
    assert prearm(flight) == []


def test_without_a_table_components_and_numbers_of_modes_are_named() -> None:
    flight = send(grounded(words=False), report(1, failing=(NO_FIX_NOW, NO_STICKS_NOW)))
    assert texts(flight) == ["gps (2 modes)", "remote_control (all modes)"]
    assert flight.detail.vehicle.can_arm is None
    assert flight.detail.vehicle.modes_blocked is None


@pytest.mark.parametrize(("mask", "can_arm"), [(0, False), (ALL_MODES, True), (BLOCKED, None)])
def test_without_a_table_can_arm_is_known_if_it_is_the_same_in_all_modes(mask: int, can_arm: bool | None) -> None:
    flight = grounded(words=False)
    if can_arm:
        flight.set(health=FITTED | PREARM).wait(2)
    assert send(flight, report(1, can_arm=mask)).detail.vehicle.can_arm is can_arm


def test_the_words_arrive_after_the_report() -> None:
    flight = send(grounded(words=False), report(1))
    flight.hw.use_event_table((1, 1), table())
    assert texts(flight.look()) == ["GPS 2 has no fix"]
    flight.hw.use_event_table((1, 1), None)
    assert texts(flight.look()) == ["gps (2 modes)"]


def test_a_mode_outside_the_groups_has_an_unknown_can_arm_and_all_checks() -> None:
    flight = send(grounded(POSITION_HOLD), report(1, failing=(NO_FIX_NOW, NO_STICKS_NOW)))
    assert flight.detail.vehicle.can_arm is None
    assert len(texts(flight)) == 2


def test_an_inhibit_has_the_time_of_its_check() -> None:
    flight = send(grounded(), report(1))
    since = prearm(flight)[0].since_us
    flight.wait(3)
    send(flight, report(4, failing=(NO_FIX_NOW, NO_STICKS_NOW)))
    first, second = prearm(flight)
    assert first.since_us == since
    assert second.since_us == flight.clock.now().unix_us


def test_many_failing_checks_give_sixteen_inhibits() -> None:
    checks = [(event_id(f"check {number}"), ALL_MODES, number % 30, 3) for number in range(20)]
    flight = send(grounded(words=False), report(1, can_arm=0, failing=checks))
    assert len(texts(flight)) == 16


def test_a_report_that_sys_status_contradicts_makes_can_arm_unknown() -> None:
    flight = send(grounded(), report(1)).set(health=FITTED | PREARM)
    assert flight.wait(2)[-1].motion_possible is TriState.FALSE
    assert flight.detail.vehicle.can_arm is None
    assert prearm(flight) == []


def test_before_a_report_a_text_is_the_reason_then_sys_status_then_the_state() -> None:
    flight = px4().hb(mode=LOITER, state=UNINIT).stop("sys_status")
    flight.wait(7)
    assert texts(flight) == ["HEARTBEAT: MAV_STATE_UNINIT, no report of the arming checks yet"]
    flight.resume().set(health=NOT_READY & ~GPS).wait(2)
    assert texts(flight) == ["SYS_STATUS: GPS"]
    flight.text("Preflight Fail: No fix")
    assert texts(flight) == ["Preflight Fail: No fix"]
    assert texts(send(flight, report(1))) == ["gps (2 modes)"]


def test_a_lost_event_makes_the_report_unknown_until_it_arrives() -> None:
    flight = send(grounded(), report(1)).send(CurrentEventSequence(5, 0))
    assert flight.detail.vehicle.can_arm is None
    assert texts(flight) == [None]
    send(flight, [event(BARE, 4, flight.boot_ms), event(BARE, 5, flight.boot_ms)])
    assert flight.detail.vehicle.can_arm is False


def test_a_report_that_is_not_closed_makes_the_one_before_unknown() -> None:
    flight = send(grounded(), report(1))
    send(flight, report(4)[:2])
    assert flight.detail.vehicle.can_arm is False
    flight.wait(2)
    assert flight.detail.vehicle.can_arm is None


def test_a_reboot_and_a_lost_link_end_a_report() -> None:
    for silence in (False, True):
        flight = send(grounded(), report(1))
        assert flight.detail.vehicle.can_arm is False
        if silence:
            flight.stop("heartbeat", "sys_status").wait(6)
            flight.resume().wait(2)
        else:
            flight.stream("clock", flight.system_time).wait(2)
            flight.reboot(0.0).wait(4)
        assert flight.detail.vehicle.can_arm is None


def test_an_event_of_the_run_before_a_reboot_is_not_used() -> None:
    flight = grounded()
    flight.booted_us = 0
    flight.send(flight.system_time())
    send(flight, report(1, time_ms=flight.boot_ms + 600_000))
    assert flight.detail.vehicle.can_arm is None


@given(st.lists(st.integers(0, 5), max_size=12))
def test_no_report_takes_the_motion_of_an_armed_robot(order: list[int]) -> None:
    flight = px4().hb(mode=LOITER)
    flight.hw.use_event_table(None, table())
    flight.wait(8)
    flight.hb(armed=True, state=ACTIVE).wait(2)
    forged = [*report(1, can_arm=0, failing=(NO_FIX_NOW, NO_STICKS_NOW)), event(BARE, 9, 60_000), event(BARE, 1, 0)]
    send(flight, [forged[number] for number in order])
    assert flight.status.motion_possible is TriState.TRUE
    assert flight.detail.inhibits == ()


@pytest.mark.parametrize(
    ("cause", "code"), [(1, 2001), (2, 2002), (3, 2003), (4, 2004), (5, 2004), (6, 2003)], ids=lambda value: str(value)
)
def test_a_failsafe_has_its_exact_code_without_a_text_until_it_ends(cause: int, code: int) -> None:
    flight = flying()
    flight.send(event(HOLD, 1, flight.boot_ms, pack("<IBHB", 0, 5, 5, cause), 2))
    flight.hb(state=CRITICAL).wait(8)
    assert flight.codes == [code]
    flight.hb(state=ACTIVE).wait(8)
    assert flight.codes == []


def flying() -> Flight:
    flight = px4().hb(mode=MISSION)
    flight.wait(15)
    return later(flight.hb(armed=True, state=ACTIVE), 2)


def test_an_exact_cause_has_the_words_of_the_table() -> None:
    flight = flying()
    flight.hw.use_event_table(None, table())
    flight.send(event(RC_LOSS, 1, flight.boot_ms, pack("<IBB", 0, 5, 1), 2)).hb(state=CRITICAL)
    assert [(error.code, error.text) for error in flight.detail.errors] == [(2001, "Sticks lost: action 5")]


def test_another_cause_and_another_alarm_have_the_code_of_their_level() -> None:
    flight = flying()
    flight.send(event(RC_LOSS, 1, flight.boot_ms, pack("<IBB", 0, 5, 0), 2))
    assert flight.codes == [7002]
    flight.hw.use_event_table(None, table())
    flight.send(event(BARE, 2, flight.boot_ms, level=1))
    assert flight.detail.errors[0].text == "Alarm"


def test_a_repeated_or_late_failsafe_that_is_over_raises_nothing() -> None:
    flight = flying()
    failsafe = event(RC_LOSS, 2, flight.boot_ms, pack("<IBB", 0, 5, 1), 2)
    send(flight, [event(BARE, 1, flight.boot_ms), event(BARE, 3, flight.boot_ms)])
    assert flight.send(failsafe).codes == []
    flight.hb(armed=False, state=STANDBY).wait(2)
    send(flight, [failsafe, failsafe._replace(sequence=9)])
    assert flight.codes == []


def test_a_failsafe_that_its_count_announced_counts() -> None:
    flight = flying().send(CurrentEventSequence(2, 0))
    flight.send(event(RC_LOSS, 2, flight.boot_ms, pack("<IBB", 0, 5, 1), 2))
    assert flight.codes == [2001]


def test_a_late_failsafe_counts_while_its_state_lasts() -> None:
    flight = flying()
    send(flight, [event(BARE, 1, flight.boot_ms), event(BARE, 3, flight.boot_ms)]).hb(state=CRITICAL)
    flight.send(event(RC_LOSS, 2, flight.boot_ms, pack("<IBB", 0, 5, 1), 2))
    assert flight.codes == [2001]


def test_events_of_other_autopilots_have_no_meaning() -> None:
    flight = copter().set(health=FITTED & ~PREARM)
    flight.wait(12)
    assert send(flight, report(1)).detail.vehicle.can_arm is False  # what SYS_STATUS says


def test_an_autopilot_without_reports_says_in_sys_status_whether_its_checks_pass() -> None:
    for armed, told in ((False, True), (True, None)):
        flight = copter().set(health=FITTED | PREARM, armed=armed)
        flight.wait(12)
        assert flight.detail.vehicle.can_arm is told


def asked_for(flight: Flight) -> list[tuple[int, int]]:
    """The first and last number of each request for events."""
    return [(ask.first_sequence, ask.last_sequence) for ask in flight.asks if isinstance(ask, RequestEvent)]


def questions(flight: Flight) -> int:
    """How often it was asked why it cannot be armed."""
    commands = [ask for ask in flight.asks if isinstance(ask, CommandLong)]
    return sum(ask.command == MAV_CMD_RUN_PREARM_CHECKS for ask in commands)


@pytest.mark.parametrize("passive", [False, True])
def test_lost_events_are_asked_for_once_and_never_on_a_passive_link(passive: bool) -> None:
    flight = grounded()
    flight.passive = ((1, 1),) if passive else ()
    later(send(flight, [event(BARE, 1, 1), event(BARE, 4, 1)]), 5).send(CurrentEventSequence(5, 0))
    assert asked_for(later(flight, 5)) == ([] if passive else [(2, 3), (5, 5)])


def test_lost_events_are_not_asked_for_without_the_option() -> None:
    flight = grounded(options=HardwareOptions(request_events=False))
    assert asked_for(later(send(flight, [event(BARE, 1, 1), event(BARE, 4, 1)]), 5)) == []


def test_a_disarmed_px4_without_a_report_is_asked_once_for_each_connection_and_boot() -> None:
    flight = later(grounded(), 15)
    assert questions(flight) == 1
    flight.stop().wait(6)
    assert questions(later(flight.resume(), 15)) == 2
    flight.stream("clock", flight.system_time).wait(2)
    assert questions(later(flight.reboot(0.0), 15)) == 3


def test_neither_an_armed_px4_nor_one_that_reported_nor_one_on_a_passive_link_is_asked() -> None:
    passive, reported, armed = px4().set(passive=((1, 1),)), px4(), px4().hb(armed=True, state=ACTIVE)
    send(reported, report(1))
    send(reported.hb(), report(4))
    assert [questions(later(flight, 15)) for flight in (passive, reported, armed)] == [0, 0, 0]


def test_an_external_mode_is_named_once_it_is_registered() -> None:
    flight = send(grounded(), report(1, can_arm=MANUAL_GROUP, failing=((NO_STICKS, ALL_MODES & ~1, 7, 3),)))
    assert flight.detail.vehicle.modes_blocked == ("AUTO.LOITER", "AUTO.MISSION")


def test_another_interface_takes_over_the_words_of_a_vehicle() -> None:
    flight = send(grounded(words=False), report(1))
    flight.hw.use_event_table((1, 1), table())
    after = MavlinkRobotHW()
    after.adopt(flight.hw)
    after.read(flight.clock.now())
    (tracked,) = after.vehicles
    assert tracked.handle.detail.vehicle.modes_blocked == ("AUTO.LOITER", "AUTO.MISSION")
