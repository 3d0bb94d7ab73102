"""What is not known after frames were lost: why it was disarmed, and whether it was armed when it restarted."""

from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.faults.causes import CRASH, EMERGENCY, REBOOT_WHILE_ARMED
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav
from mav_robot_status.mavlink.enumerations import MAV_STATE_EMERGENCY, MAV_TYPE_FIXED_WING

from .driver import ACTIVE, Flight, copter, rover
from .test_sequences import Outputs

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
FAST = mav.VfrHud(12.0, 0.0, 60)


def flying(flight: Flight) -> Flight:
    flight.stream("vfr_hud", lambda: FAST, hz=4).wait(15)
    flight.hb(armed=True, state=ACTIVE).wait(3)
    assert flight.status.in_motion is TRUE
    return flight


@pytest.mark.parametrize(("lost", "stopped", "in_error"), [(0, FALSE, FALSE), (3, UNKNOWN, UNKNOWN)])
def test_why_it_was_disarmed_in_flight_is_unknown_if_frames_are_lost_around_it(
    lost: int, stopped: TriState, in_error: TriState
) -> None:
    flight = flying(copter(version=(4, 5, 6)))
    flight.lose(lost).wait(0.5)
    flight.hb(armed=False).wait(6)
    assert (flight.status.e_stopped, flight.status.in_error) == (stopped, in_error)


def test_frames_that_are_lost_long_after_a_disarm_in_flight_hide_nothing() -> None:
    flight = flying(copter(version=(4, 5, 6)))
    flight.hb(armed=False).wait(6)
    flight.lose(3).wait(6)
    assert flight.status.e_stopped is FALSE


def test_the_next_arming_ends_the_doubt_about_a_disarm_in_flight() -> None:
    flight = flying(copter(version=(4, 5, 6))).lose(3)
    flight.hb(armed=False).wait(6)
    flight.hb(armed=True).wait(6)
    assert flight.status.in_error is FALSE


def test_a_rover_may_be_disarmed_while_it_rolls() -> None:
    flight = flying(rover(version=(4, 5, 6))).lose(3)
    flight.hb(armed=False).wait(6)
    assert flight.status.in_error is FALSE


@pytest.mark.parametrize(("missed", "known"), [(1.0, True), (6.0, False)])
def test_whether_it_was_armed_when_it_restarted_is_unknown_if_other_frames_went_on_without_heartbeats(
    missed: float, known: bool
) -> None:
    flight = copter()
    flight.stream("clock", flight.system_time, hz=4).wait(10)
    flight.hb(armed=True, state=ACTIVE).wait(3)
    flight.stop("heartbeat", "sys_status").wait(missed)
    flight.stop().wait(1.0)
    flight.set(armed=False, state=3).reboot(0.5).resume().stream("clock", flight.system_time, hz=4).wait(5)
    assert (REBOOT_WHILE_ARMED in flight.codes) is known


@pytest.mark.parametrize(("vehicle_type", "code"), [(MAV_TYPE_FIXED_WING, CRASH), (2, EMERGENCY)])
def test_emergency_means_a_crash_where_the_autopilot_sets_it_for_nothing_else(vehicle_type: int, code: int) -> None:
    flight = Flight(vehicle_type=vehicle_type)
    flight.wait(3)
    flight.hb(armed=True, state=MAV_STATE_EMERGENCY).wait(1)
    assert flight.codes == [code]


def test_outputs_at_their_stop_value_under_throttle_leave_a_doubt_even_if_nothing_shows_that_they_are_motors() -> None:
    flight = Flight(vehicle_type=MAV_TYPE_FIXED_WING)
    outputs = Outputs(flight, [1500, 1500, 1000, 1500])
    outputs.speed = 15.0
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE)
    outputs.set([1500, 1500, 1000, 1500], 50)
    flight.wait(3)
    assert (flight.status.drives_powered, flight.status.motion_possible) == (UNKNOWN, UNKNOWN)
    outputs.set([1500, 1500, 1600, 1500], 50)
    flight.wait(1)
    assert (flight.status.drives_powered, flight.status.motion_possible) == (TRUE, TRUE)
