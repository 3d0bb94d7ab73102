"""Stories and random flights that reach every handler. After each step the handle has the status of that moment."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from struct import pack
from typing import Any, Final

import pytest

from mav_robot_status.hardware.mavlink.subjects import EDGES, HANDLERS, WANTED_IDS
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav

from . import driver
from .driver import (
    ACTIVE,
    AHRS,
    BATTERY,
    CRITICAL,
    FITTED,
    GYRO,
    PREARM,
    TERMINATED,
    Flight,
    copter,
    frame_of,
    px4,
    rover,
)
from .px4_reports import report
from .random_flights import MESSAGES, fly
from .test_sequences import Outputs

SEEDS: Final = range(6)


def held(flight: Flight, stop: list[int], driven: list[int]) -> Flight:
    """The motor outputs return to their stop value while throttle is demanded."""
    outputs = Outputs(flight, stop)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE)
    outputs.set(driven, 39)
    flight.wait(3)
    outputs.set(stop, 100)
    flight.wait(3)
    return flight


def a_rover_turns_while_its_outputs_are_held() -> None:
    flight = rover()
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0, 0, 0))
    held(flight, [1500, 0, 1500], [1500, 0, 1700])
    flight.stop("attitude").send(mav.Attitude(flight.boot_ms, 0, 0, 1.0))
    flight.send(mav.ParamValue(70.0, 0, 0, b"SERVO3_FUNCTION", 2))


def a_motor_stops_turning_while_its_output_is_at_the_stop_value(make: Callable[[bytes], Any], rpm: str) -> None:
    flight = copter()
    outputs = Outputs(flight, [1000] * 4)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE).wait(2)
    outputs.set([1000] * 4, 0)
    flight.send(make(pack(rpm, 900, 0, 0, 0))).send(make(pack(rpm, 0, 0, 0, 0)))


def parameters_arrive_while_a_motor_turns() -> None:
    flight = copter()
    outputs = Outputs(flight, [1000] * 4)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE).wait(2)
    outputs.set([1000] * 4, 0)
    flight.send(mav.EscStatus(0, pack("<4i", 900, 0, 0, 0), b"", b"", 0))
    flight.send(mav.ParamValue(33.0, 0, 0, b"SERVO5_FUNCTION", 2))
    flight.send(mav.ParamValue(165.0, 0, 0, b"RC7_OPTION", 2))


def a_copter_climbs_while_its_outputs_are_held_and_then_drives_them() -> None:
    flight = held(copter(), [1000] * 4, [1632] * 4)
    flight.stop("vfr_hud", "outputs").send(mav.VfrHud(0.0, 2.0, 100))
    flight.send(mav.ServoOutputRaw._make((*[1632] * 8, 0, *[0] * 8)))


def a_turning_copter_says_that_its_estimate_is_wrong() -> None:
    flight = copter()
    flight.set(health=FITTED | AHRS)
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0, 0, 1.0), hz=4).wait(3)
    flight.send(mav.EkfStatusReport(0x400)).send(mav.EkfStatusReport(0x33F))
    flight.set(health=FITTED & ~AHRS).wait(3)


def a_plane_in_the_air_has_its_throttle_at_stop_and_lands() -> None:
    flight = Flight(driver.ARDUPILOT, driver.PLANE)
    outputs = Outputs(flight, [1000] * 4)
    flight.send(mav.ParamValue(70.0, 0, 0, b"SERVO3_FUNCTION", 2)).wait(5)
    flight.stream("landed", lambda: mav.ExtendedSysState(0, 2)).hb(armed=True, state=ACTIVE)
    outputs.set([1632] * 4, 39)
    flight.wait(3)
    outputs.set([1000] * 4, 39)
    flight.wait(3)
    flight.send(mav.ParamValue(0.0, 0, 0, b"SERVO3_FUNCTION", 2)).wait(1)
    flight.send(mav.ParamValue(70.0, 0, 0, b"SERVO3_FUNCTION", 2)).stop("landed").send(mav.ExtendedSysState(0, 1))


def a_quadplane_lies_on_the_ground_until_it_moves(position: Callable[[Flight, int], Any]) -> None:
    flight = Flight(driver.ARDUPILOT, driver.QUADPLANE)
    flight.stream("position", lambda: position(flight, 0), hz=4).stream("hud", lambda: mav.VfrHud(0.0, 0.0, 0), hz=2)
    flight.send(mav.ExtendedSysState(3, 2)).hb(armed=True, state=ACTIVE).wait(4)
    flight.send(mav.ExtendedSysState(4, 2)).send(mav.ExtendedSysState(3, 2))
    flight.stop("position").send(position(flight, 1))


def a_plane_in_the_air_closes_its_throttle() -> None:
    flight = Flight(driver.ARDUPILOT, driver.PLANE).hb(armed=True, state=ACTIVE)
    flight.stream("landed", lambda: mav.ExtendedSysState(0, 2), hz=4).wait(3)
    for throttle in (50, 0, 50):
        flight.send(mav.VfrHud(9.0, 0.0, throttle)).wait(0.5)


def a_motor_is_driven_after_a_stop_was_announced() -> None:
    flight = copter()
    outputs = Outputs(flight, [1000] * 4)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE)
    outputs.set([1632] * 4, 39)
    flight.wait(3)
    flight.text("RC7: MotorEStop HIGH", 2).wait(1)


def an_autopilot_shows_late_that_it_is_inav() -> None:
    flight = copter()
    flight.wait(5)
    flight.set(present=GYRO).wait(2)


def internal_errors_end_after_they_were_announced() -> None:
    flight = copter().hb(armed=True, state=ACTIVE).set(internal_errors=1)
    flight.wait(2)
    flight.text("Internal Errors 0x400", 2).set(internal_errors=0).wait(2)


def a_vehicle_without_a_global_position_starts_to_move() -> None:
    flight = px4()
    flight.stream("rest", lambda: mav.LocalPositionNed(flight.boot_ms, 0, 0, 0), hz=4).wait(3)
    flight.stop("rest").stream("motion", lambda: mav.LocalPositionNed(flight.boot_ms, 2, 0, 0), hz=4).wait(3)


def a_vehicle_stays_armed_after_it_announces_a_termination() -> None:
    flight = Flight(driver.ARDUPILOT, driver.PLANE).hb(armed=True, state=ACTIVE)
    flight.text("Terminating due to GCS request", 0).wait(5)


def px4_says_that_it_stops_while_it_is_terminated() -> None:
    flight = px4().hb(armed=True, state=TERMINATED)
    flight.wait(2)
    flight.text("Kill-switch engaged", 0).wait(2)


def the_checks_pass_after_a_stop_was_said() -> None:
    flight = copter().set(health=FITTED)
    flight.wait(12)
    flight.text("RC7: MotorEStop HIGH", 2).wait(3)
    flight.set(health=FITTED | PREARM).wait(5)


def a_failsafe_is_said_between_two_heartbeats_of_the_same_time() -> None:
    flight = px4().hb(armed=True, state=CRITICAL)
    flight.wait(2)
    flight.hb(state=ACTIVE).text("Failsafe activated\t", 2).send(flight.heartbeat())


def a_sensor_is_faulty_at_boot_and_the_clock_is_heard_late() -> None:
    flight = copter().set(health=FITTED & ~GYRO | PREARM)
    flight.wait(3)
    flight.send(flight.system_time())


def word(flight: Flight, value: float) -> mav.NamedValueFloat:
    return mav.NamedValueFloat(flight.boot_ms, value, b"RS_STOP")


def the_applet_speaks_while_a_motor_is_driven_and_falls_silent() -> None:
    flight = copter()
    outputs = Outputs(flight, [1000] * 4)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE)
    outputs.set([1632] * 4, 39)
    flight.stream("word", lambda: word(flight, 1), hz=4).wait(5)
    outputs.set([1000] * 4, 0)
    flight.wait(3)
    flight.stop("word").wait(3.5)
    flight.send(word(flight, 1)).wait(1)
    flight.send(word(flight, 0))


def a_switch_is_moved() -> None:
    flight = copter().send(mav.ParamValue(31.0, 0, 0, b"RC7_OPTION", 2)).look()
    for pulse in (1000, 1900, 1000):
        flight.send(mav.RcChannels(*[pulse] * 18)).wait(0.5)


def a_switch_is_moved_back_and_the_text_of_its_release_is_lost() -> None:
    flight = copter().send(mav.ParamValue(31.0, 0, 0, b"RC7_OPTION", 2)).hb(armed=True, state=ACTIVE)
    flight.text("RC7: MotorEStop HIGH", 6).wait(3)
    flight.send(mav.RcChannels(*[1000] * 18)).wait(0.5)


def the_receiver_loses_its_fix_at_rest() -> None:
    flight = px4()
    flight.stream("gps", lambda: mav.GpsRawInt(0, 3), hz=4).wait(4)
    flight.stop("gps").send(mav.GpsRawInt(0, 1))


def a_copter_climbs_in_the_first_second_of_a_hold() -> None:
    flight = copter()
    outputs = Outputs(flight, [1000] * 4, climb=2.0)
    flight.wait(15)
    flight.hb(armed=True, state=ACTIVE)
    outputs.set([1632] * 4, 39)
    flight.wait(3)
    outputs.set([1000] * 4, 39)
    flight.wait(0.6)
    outputs.set([1632] * 4, 39)
    flight.wait(1)


def two_clocks_alternate_sample_by_sample() -> None:
    flight = copter()
    for _ in range(5):
        for boot_ms in (900_000, 0):
            flight.wait(0.3)
            flight.send(mav.SystemTime(0, boot_ms + flight.boot_ms))
    assert 9002 in flight.codes


def another_sender_disagrees_for_some_time() -> None:
    flight = copter()
    for number in range(8):
        flight.wait(1)
        armed = flight.heartbeat()._replace(base_mode=209)
        flight.hw.on_frame(frame_of(armed, sequence=100 + number), flight.clock.now(), "another channel")
    assert flight.wait(0.5)[-1].error_code == 9002
    flight.wait(20)
    assert flight.codes == []


def the_checks_pass_after_a_reason_was_said() -> None:
    flight = copter().set(health=FITTED)
    flight.wait(2)
    flight.text("PreArm: Compass not calibrated", 2).wait(1.5)
    flight.set(health=FITTED | PREARM).wait(2)


def a_plane_in_the_air_takes_its_throttle_back() -> None:
    flight = Flight(driver.ARDUPILOT, driver.PLANE)
    flight.stream("landed", lambda: mav.ExtendedSysState(0, 2)).hb(armed=True, state=ACTIVE).wait(5)
    for throttle in (50, 5, 50):
        flight.wait(0.5)
        flight.send(mav.VfrHud(15.0, 0.0, throttle))


def a_battery_becomes_hot_and_cools_down() -> None:
    flight = copter()
    flight.wait(12)
    for faults in (16, 16, 0):
        flight.send(mav.BatteryStatus(0, 1, faults)).wait(0.5)


RC: Final = 1 << 16


def the_radio_is_reported_after_the_text_of_a_failsafe() -> None:
    flight = rover()
    flight.set(present=flight.present | RC, enabled=flight.enabled | RC, health=flight.health | RC).wait(12)
    flight.hb(armed=True, state=ACTIVE).wait(2)
    flight.stop("sys_status").wait(2)
    flight.text("Radio Failsafe").hb(state=CRITICAL).resume().wait(1)
    assert flight.codes == [2002]


def a_low_battery_recovers() -> None:
    flight = copter()
    flight.wait(12)
    flight.hb(armed=True, state=ACTIVE).text("Battery 1 is low 10.50V used 1500 mAh")
    flight.set(health=flight.health & ~BATTERY).wait(20)
    assert flight.code == 2003
    flight.set(health=flight.health | BATTERY).wait(2)
    assert flight.code == 0


def a_vehicle_behind_a_satellite_comes_into_the_reach_of_a_radio_and_leaves_it() -> None:
    satellite = mav.HighLatency2(0, 0, 0, 4, 16, 2, driver.ARDUPILOT, 20, 0, 0, 0, 209 - 256, 0, 0)
    flight = copter(streams=False)
    flight.stream("satellite", lambda: satellite._replace(timestamp=flight.boot_ms), hz=0.2)
    flight.stream("landed", lambda: mav.ExtendedSysState(0, 2)).wait(12)
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0, 0, 1.0), hz=4).wait(3)
    flight.stream("position", lambda: mav.GlobalPositionInt(flight.boot_ms, 1, 0, 300, 0, 0), hz=4).wait(3)
    assert (flight.status.in_motion, flight.status.drives_powered) == (TriState.TRUE, TriState.TRUE)
    assert flight.codes == [3000]
    flight.resume().hb(armed=True, state=ACTIVE).wait(8)
    assert flight.detail.vehicle.state == "ACTIVE"
    assert flight.codes == []
    flight.stop("heartbeat", "sys_status").wait(20)
    assert flight.detail.vehicle.state is None
    flight.send(mav.NamedValueFloat(flight.boot_ms, 1.0, b"RS_STOP")).wait(10)
    flight.stop("satellite").wait(70)
    assert flight.inhibits.keys() == {"HEARTBEAT_LATE"}  # the other streams go on
    flight.stop().wait(70)
    assert flight.inhibits.keys() == {"LINK_STALE"}


def a_disarmed_vehicle_that_turns_starts_to_move() -> None:
    flight = rover()
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0, 0, 1.0), hz=4)
    speed = 0.1
    flight.stream("position", lambda: mav.GlobalPositionInt(flight.boot_ms, 1, 1, round(speed * 100), 0, 0), hz=4)
    flight.wait(3)
    speed = 1.0
    flight.wait(3)
    speed = 0.1
    flight.wait(3)


def a_rover_becomes_faster_while_its_outputs_are_held() -> None:
    flight = rover()
    flight.stream("position", lambda: mav.GlobalPositionInt(flight.boot_ms, 1, 1, 300, 0, 0), hz=4)
    held(flight, [1500, 0, 1500], [1500, 0, 1700])
    flight.stop("vfr_hud", "outputs")
    for speed in (3.0, 9.0, 3.0):
        flight.send(mav.VfrHud(speed, 0.0, 100)).wait(0.2)


def px4_reports_and_then_counts_an_event_that_does_not_arrive() -> None:
    flight = px4()
    flight.wait(5)
    for event in report(first=1, can_arm=0, failing=(), time_ms=flight.boot_ms):
        flight.send(event)
    flight.wait(1)
    flight.send(mav.CurrentEventSequence(2, 0)).send(mav.CurrentEventSequence(3, 0))


STORIES: Final[list[Callable[[], Any]]] = [
    a_disarmed_vehicle_that_turns_starts_to_move,
    a_rover_becomes_faster_while_its_outputs_are_held,
    a_rover_turns_while_its_outputs_are_held,
    two_clocks_alternate_sample_by_sample,
    another_sender_disagrees_for_some_time,
    the_radio_is_reported_after_the_text_of_a_failsafe,
    a_low_battery_recovers,
    a_plane_in_the_air_takes_its_throttle_back,
    a_battery_becomes_hot_and_cools_down,
    the_checks_pass_after_a_reason_was_said,
    a_vehicle_behind_a_satellite_comes_into_the_reach_of_a_radio_and_leaves_it,
    px4_reports_and_then_counts_an_event_that_does_not_arrive,
    *(
        partial(a_motor_stops_turning_while_its_output_is_at_the_stop_value, make, rpm)
        for make, rpm in (
            (lambda rpm: mav.EscStatus(0, rpm, b"", b"", 0), "<4i"),
            (lambda rpm: mav.EscTelemetry1To4(b"", b"", b"", rpm, b"", b""), "<4H"),
            (lambda rpm: mav.EscTelemetry5To8(b"", b"", b"", rpm, b"", b""), "<4H"),
            (lambda rpm: mav.EscTelemetry9To12(b"", b"", b"", rpm, b"", b""), "<4H"),
        )
    ),
    parameters_arrive_while_a_motor_turns,
    a_copter_climbs_while_its_outputs_are_held_and_then_drives_them,
    a_turning_copter_says_that_its_estimate_is_wrong,
    a_plane_in_the_air_has_its_throttle_at_stop_and_lands,
    partial(
        a_quadplane_lies_on_the_ground_until_it_moves,
        lambda f, v: mav.GlobalPositionInt(f.boot_ms, 1, 1, 100 * v, 0, 0),
    ),
    partial(a_quadplane_lies_on_the_ground_until_it_moves, lambda f, v: mav.LocalPositionNed(f.boot_ms, v, 0, 0)),
    a_plane_in_the_air_closes_its_throttle,
    a_motor_is_driven_after_a_stop_was_announced,
    an_autopilot_shows_late_that_it_is_inav,
    internal_errors_end_after_they_were_announced,
    a_vehicle_without_a_global_position_starts_to_move,
    a_vehicle_stays_armed_after_it_announces_a_termination,
    px4_says_that_it_stops_while_it_is_terminated,
    the_checks_pass_after_a_stop_was_said,
    a_failsafe_is_said_between_two_heartbeats_of_the_same_time,
    a_sensor_is_faulty_at_boot_and_the_clock_is_heard_late,
    the_applet_speaks_while_a_motor_is_driven_and_falls_silent,
    a_switch_is_moved,
    a_switch_is_moved_back_and_the_text_of_its_release_is_lost,
    the_receiver_loses_its_fix_at_rest,
    a_copter_climbs_in_the_first_second_of_a_hold,
    *(partial(fly, seed) for seed in SEEDS),
]


@pytest.mark.parametrize("story", STORIES, ids=lambda story: getattr(story, "__name__", None))
def test_the_status_is_that_of_the_moment_after_every_step(story: Callable[[], Any]) -> None:
    story()  # a `Flight` compares the handle with a new status each time it looks


def test_random_flights_send_every_message_that_has_a_handler() -> None:
    assert set(MESSAGES) >= set(HANDLERS)


def test_every_edge_is_a_message_that_is_used() -> None:
    assert EDGES <= WANTED_IDS
