"""Sequences of failsafes: which cause a text announces, and when each one ends."""

from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink.definitions import AutopilotVersion

from ..driver import ACTIVE, BATTERY, CRITICAL, FENCE, PREARM, RC, STANDBY, Flight, copter, px4, rover

TRUE, FALSE = TriState.TRUE, TriState.FALSE
MAG = 1 << 2
LOW = "Battery 1 is low 10.50V used 1500 mAh"


def driving(radio: bool | None) -> Flight:
    """An armed rover whose SYS_STATUS shows the radio: healthy, lost, or not at all (None)."""
    flight = rover()
    if radio is not None:
        flight.present |= RC
        flight.enabled |= RC
        flight.health |= RC
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).wait(2)
    if radio is False:
        flight.set(health=flight.health & ~RC).wait(2)
    return flight


@pytest.mark.parametrize("text", ["Radio Failsafe", "GCS Failsafe"])
@pytest.mark.parametrize(("radio", "code"), [(True, 2002), (False, 2001), (None, 2000)])
def test_a_rover_names_either_failsafe_and_its_radio_tells_which(text: str, radio: bool | None, code: int) -> None:
    flight = driving(radio).text(text).hb(state=CRITICAL)
    assert {status.error_code for status in flight.wait(10)} == {code}
    assert flight.detail.errors[0].text == text


def test_an_old_report_of_a_healthy_radio_does_not_tell_which_failsafe_it_is() -> None:
    flight = driving(True).stop("sys_status")
    flight.wait(2)
    assert flight.text("Radio Failsafe").code == 2000


def test_the_next_report_of_the_radio_tells_which_failsafe_it_is() -> None:
    flight = driving(True).text("Radio Failsafe").hb(state=CRITICAL)
    assert flight.code == 2002
    flight.set(health=flight.health & ~RC).wait(1.1)
    assert flight.code == 2001
    flight = driving(True).stop("sys_status")
    flight.wait(2)
    flight.text("Radio Failsafe").hb(state=CRITICAL).resume().wait(1)
    assert flight.codes == [2002]


def test_the_mask_of_an_old_rover_names_its_failsafe() -> None:
    assert driving(None).text("Failsafe trigger 0x2").code == 2002
    assert driving(True).text("Failsafe trigger 0x1").code == 2001


@pytest.mark.parametrize("text", ["Radio Failsafe Cleared", "GCS Failsafe Cleared"])
@pytest.mark.parametrize("radio", [True, False, None])
def test_on_a_rover_either_text_ends_both(text: str, radio: bool | None) -> None:
    flight = driving(radio).text("Radio Failsafe").hb(state=CRITICAL)
    flight.wait(3)
    flight.set(health=flight.health | RC).wait(1)
    flight.text(text, 6)
    assert (flight.codes, flight.status.in_error) == ([], FALSE)
    flight.hb(state=ACTIVE)
    assert {status.error_code for status in flight.wait(10)} == {0}


def test_on_a_copter_a_text_ends_only_the_failsafe_that_it_names() -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=CRITICAL).text("Radio Failsafe").text("GCS Failsafe")
    assert flight.text("Radio Failsafe Cleared").codes == [2002]


def test_a_text_that_clears_is_believed_before_the_next_heartbeat() -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=CRITICAL).text("Radio Failsafe")
    flight.wait(3.5)
    flight.text("Radio Failsafe Cleared")
    assert (flight.code, flight.status.in_error) == (0, FALSE)
    assert {status.error_code for status in flight.wait(0.4)} == {0}
    flight.hb(state=ACTIVE)
    assert {status.error_code for status in flight.wait(5)} == {0}


def test_a_state_that_stays_critical_after_a_text_that_clears_is_another_failsafe() -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=CRITICAL).text("Radio Failsafe")
    flight.wait(3)
    flight.text("Radio Failsafe Cleared").wait(3)
    assert flight.code == 2000


def test_a_text_that_clears_nothing_known_leaves_the_state_critical_an_error() -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=CRITICAL)
    assert flight.text("Radio Failsafe Cleared").code == 2000


@pytest.mark.parametrize(("text", "code"), [("Battery 1 is low", 2003), ("Battery 1 is critical", 2004)])
def test_a_battery_cause_lasts_while_sys_status_shows_the_battery(text: str, code: int) -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).text(f"{text} 10.50V used 1500 mAh").set(health=flight.health & ~BATTERY)
    assert {status.error_code for status in flight.wait(60)} == {code}
    flight.hb(armed=False, state=STANDBY)
    assert {status.error_code for status in flight.wait(60)} == {code}
    flight.set(health=flight.health | BATTERY).wait(1.1)
    assert flight.code == 0


def test_a_battery_cause_ends_as_before_without_a_fault_in_sys_status() -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).text(LOW).wait(4.9)
    assert flight.code == 2003
    flight.wait(0.2)
    assert flight.code == 0


def test_a_battery_cause_does_not_outlast_the_sys_status_that_shows_it() -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).text(LOW).set(health=flight.health & ~BATTERY)
    flight.wait(10)
    flight.stop("sys_status")
    flight.wait(12)
    assert flight.codes == []


def test_an_ignored_sensor_holds_no_cause() -> None:
    flight = copter(options=HardwareOptions(ignore_sensors=frozenset({"BATTERY"})))
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).text(LOW).set(health=flight.health & ~BATTERY)
    flight.wait(6)
    assert flight.codes == []


def test_a_fence_cause_lasts_while_sys_status_shows_the_breach() -> None:
    flight = copter()
    flight.present, flight.enabled = flight.present | FENCE, flight.enabled | FENCE
    flight.health |= FENCE
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).set(health=flight.health & ~FENCE).text("Circle fence breached")
    assert {status.error_code for status in flight.wait(60)} == {2009}
    flight.set(health=flight.health | FENCE).wait(2)
    assert flight.codes == []


def test_an_event_of_a_failsafe_ends_with_it() -> None:
    flight = px4()
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).wait(3)
    flight.event(0x22).wait(0.5)
    assert flight.code == 7002
    flight.hb(state=CRITICAL).wait(3)
    flight.hb(state=ACTIVE)
    assert (flight.codes, flight.status.in_error) == ([], FALSE)


def test_an_event_long_before_a_failsafe_or_after_it_lasts_as_before() -> None:
    flight = px4()
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).wait(3)
    flight.event(0x22).wait(3)
    flight.hb(state=CRITICAL).wait(1)
    flight.hb(state=ACTIVE)
    assert flight.codes == [7002]
    flight.wait(10)
    assert flight.event(0x22).code == 7002
    assert {status.error_code for status in flight.wait(9.9)} == {7002}


def test_the_health_of_a_compass_counts_from_version_4_1_on() -> None:
    flight = copter(version=None)
    flight.set(health=flight.health & ~MAG).wait(15)
    assert flight.codes == [3002]  # PREARM_CHECK shows 4.1 or later
    flight.set(present=flight.present & ~PREARM).wait(3)
    assert flight.codes == []  # the version is not known: real flights of Copter 4.0.5 had 3002 for hours
    flight.set(present=flight.present | PREARM)
    assert flight.send(AutopilotVersion(0x040005FF)).codes == []
    flight.hb(armed=True, state=ACTIVE).wait(5)
    assert flight.status.in_error is FALSE
    assert flight.send(AutopilotVersion(0x040100FF)).codes == [3002]


def test_the_compass_of_other_autopilots_counts_in_every_version() -> None:
    flight = px4()
    flight.set(health=flight.health & ~MAG).wait(15)
    assert flight.send(AutopilotVersion(0x010D00FF)).status.in_error is TRUE
