"""The effect of each message on the state, seen in the status or in the state itself."""

from __future__ import annotations

import math
from struct import pack
from typing import Any

import pytest

from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.mavlink.state import VehicleState
from mav_robot_status.interface import RobotMode, TriState
from mav_robot_status.mavlink import definitions as mav

from .driver import (
    ACTIVE,
    AHRS,
    ARDUPILOT,
    CRITICAL,
    EMERGENCY,
    FENCE,
    FITTED,
    GPS,
    GYRO,
    MOTORS,
    PLANE,
    PREARM,
    PX4,
    ROVER,
    STANDBY,
    SUB,
    Flight,
    copter,
    px4,
    rover,
)

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN


def state_of(flight: Flight) -> VehicleState:
    state = flight.vehicle.state
    assert state is not None
    return state


def here(flight: Flight, *velocity: float, lat: int = 1) -> mav.GlobalPositionInt:
    vx, vy, vz = (round(v * 100) for v in velocity)
    return mav.GlobalPositionInt(flight.boot_ms, lat, 0, vx, vy, vz)


def local(flight: Flight, *velocity: float) -> mav.LocalPositionNed:
    return mav.LocalPositionNed(flight.boot_ms, *velocity)


def hud(ground: float, climb: float) -> mav.VfrHud:
    return mav.VfrHud(ground, climb, 0)


def moving(flight: Flight, message: Any, seconds: float = 2.0) -> TriState:
    """in_motion after some time of this message."""
    flight.stream("motion", message, hz=5).wait(seconds)
    return flight.status.in_motion


# -- heartbeats, reboots, identity -------------------------------------------------------------------------------------


def test_latches_survive_a_short_loss_and_not_a_long_one() -> None:
    flight = copter().text("Crash: Disarming: AngErr=42", 0)
    flight.stop().wait(20)
    assert flight.codes == []
    assert flight.resume().look().codes == [4001]
    flight.stop().wait(31)
    assert flight.resume().look().codes == []


def test_another_autopilot_with_the_same_ids_starts_with_a_new_state() -> None:
    flight = copter().text("Crash: Disarming: AngErr=42", 0)
    flight.hb(vehicle_type=ROVER)
    assert (flight.codes, flight.detail.vehicle.type) == ([], "GROUND_ROVER")
    assert flight.vehicle.boots == 0


def test_two_alternating_autopilots_with_the_same_ids_are_a_conflict_until_one_is_silent() -> None:
    flight = copter().stop("sys_status")
    flight.stream("other", lambda: flight.heartbeat()._replace(type=ROVER))
    flight.wait(1)
    assert {status.error_code for status in flight.wait(20)} == {9002}
    flight.stop("other").wait(12)
    assert flight.codes == []


def test_two_alternating_boot_clocks_from_one_router_are_a_conflict_and_not_reboots_while_armed() -> None:
    flight = copter().set(armed=True)
    still = mav.Attitude(0, 0.0, 0.0, 0.0)
    flight.stream("attitude", lambda: still._replace(time_boot_ms=flight.boot_ms + 900_000), hz=2)
    flight.stream("attitude of the other", lambda: still._replace(time_boot_ms=flight.boot_ms), hz=2)
    doubled = flight.stream("system_time of the other", flight.system_time, hz=2)
    doubled.wait(5)
    assert flight.codes == [9002]
    doubled.stop("attitude of the other", "system_time of the other").wait(12)
    assert 9002 not in flight.codes


@pytest.mark.parametrize(("autopilot", "state", "reboots"), [(3, 1, 1), (3, 0, 1), (PX4, 0, 0), (3, 2, 0), (0, 0, 1)])
def test_a_boot_state_after_standby_is_a_reboot_except_uninit_on_px4(autopilot: int, state: int, reboots: int) -> None:
    flight = Flight(autopilot).hb(state=STANDBY)
    flight.wait(2)
    flight.hb(state=state).wait(3)
    assert flight.vehicle.boots == reboots


def test_mode_initialising_after_another_mode_is_a_reboot() -> None:
    flight = Flight(vehicle_type=PLANE).hb(mode=10)
    flight.wait(2)
    flight.hb(mode=16, state=2).wait(3)
    assert flight.vehicle.boots == 1
    assert {"INITIALISING"} <= flight.inhibits.keys()


def test_a_reboot_long_after_an_armed_heartbeat_is_not_an_error() -> None:
    flight = copter().hb(armed=True, state=ACTIVE)
    flight.stop("heartbeat").wait(60)
    flight.hb(armed=False, state=1)
    assert (flight.vehicle.boots, flight.codes) == (1, [])


def test_a_heartbeat_alone_shows_a_reboot_while_armed() -> None:
    flight = copter().hb(armed=True, state=ACTIVE)
    flight.wait(5)
    flight.hb(armed=False, state=1)
    assert flight.codes == [5004]


def test_a_crash_text_just_before_the_first_armed_heartbeat_is_kept() -> None:
    flight = copter()
    flight.wait(1.5)
    flight.text("Crash: Disarming: AngErr=42", 0).hb(armed=True)
    assert flight.codes == [4001]


# -- SYS_STATUS --------------------------------------------------------------------------------------------------------


def test_zero_sensor_masks_are_ignored() -> None:
    flight = px4().set(present=0, enabled=0, health=0)
    flight.wait(3)
    assert flight.status.in_error is UNKNOWN
    assert "SYS_STATUS_MISSING" in flight.inhibits


def test_internal_errors_count_on_ardupilot_only() -> None:
    for vehicle, codes in ((copter, [5001]), (px4, [])):
        flight = vehicle().set(internal_errors=0x10000)
        flight.wait(2)
        assert flight.codes == codes


def test_an_internal_error_text_ends_when_the_counters_return_to_zero() -> None:
    flight = copter().set(internal_errors=1)
    flight.text("PreArm: Internal errors 0x1 l:1 x", 2).wait(2)
    assert flight.codes == [5001]
    flight.set(internal_errors=0).wait(2)
    assert flight.codes == []


def test_a_fence_breach_ends_when_the_bit_is_healthy_again() -> None:
    flight = copter().hb(armed=True, state=ACTIVE)
    flight.set(present=flight.present | FENCE, enabled=flight.enabled | FENCE).wait(15)
    assert flight.codes == [3020]
    flight.text("Circle fence breached", 5)
    assert flight.codes == [2009, 3020]
    flight.set(health=flight.health | FENCE).wait(2)
    assert flight.codes == []


def test_sensors_in_the_ignore_option_are_ignored() -> None:
    flight = copter(options=HardwareOptions(ignore_sensors=frozenset({"3D_GYRO"}))).set(health=FITTED & ~GYRO)
    flight.wait(20)
    assert flight.codes == []


def test_an_unhealthy_gps_is_an_error_only_while_armed() -> None:
    flight = copter().set(health=(FITTED & ~GPS) | PREARM)
    flight.wait(20)
    assert flight.codes == []
    assert flight.hb(armed=True, state=ACTIVE).codes == [3005]


def test_ardupilot_texts_counters_and_stops_do_not_apply_to_inav() -> None:
    flight = copter().set(present=FITTED & ~MOTORS, enabled=FITTED & ~MOTORS, internal_errors=7)
    flight.wait(20)
    flight.text("Radio Failsafe", 4).text("PreArm: Motors Emergency Stopped", 2)
    assert flight.codes == []
    assert flight.status.e_stopped is UNKNOWN


# -- speed -------------------------------------------------------------------------------------------------------------


def test_any_velocity_message_shows_motion_or_standstill() -> None:
    for message in (lambda f: here(f, 1, 0, 0), lambda f: local(f, 1, 0, 0), lambda f: hud(1, 0)):
        flight = rover().hb(armed=True, state=ACTIVE)
        assert moving(flight, lambda f=flight, m=message: m(f)) is TRUE
    for message in (lambda f: here(f, 0, 0, 0), lambda f: local(f, 0, 0, 0), lambda f: hud(0, 0)):
        flight = rover().hb(armed=True, state=ACTIVE)
        assert moving(flight, lambda f=flight, m=message: m(f)) is FALSE


def test_a_vertical_speed_is_motion_for_a_copter_and_not_for_a_rover() -> None:
    for vehicle, expected in ((copter, TRUE), (rover, FALSE)):
        flight = vehicle().hb(armed=True, state=ACTIVE)
        assert moving(flight, lambda f=flight: local(f, 0, 0, -1)) is expected
        flight = vehicle().hb(armed=True, state=ACTIVE)
        assert moving(flight, lambda: hud(0, 1)) is expected


def test_a_zero_velocity_is_not_an_estimate_with_an_unhealthy_ahrs_or_without_a_position() -> None:
    flight = rover().set(health=FITTED & ~AHRS | PREARM).hb(armed=True, state=ACTIVE)
    assert moving(flight, lambda: here(flight, 0, 0, 0)) is UNKNOWN
    assert moving(flight, lambda: hud(0, 0.3)) is UNKNOWN
    flight = rover().hb(armed=True, state=ACTIVE)
    assert moving(flight, lambda: here(flight, 0, 0, 0, lat=0)) is UNKNOWN
    assert moving(flight, lambda: here(flight, 1, 0, 0, lat=0)) is TRUE


def test_a_zero_velocity_from_px4_is_an_estimate() -> None:
    flight = px4().send(mav.ExtendedSysState(0, 1))
    assert moving(flight, lambda: local(flight, 0, 0, 0)) is FALSE


AIDED, CONSTANT = 0x33F, 0xA7  # EKF_STATUS_FLAGS as recorded: with GPS, and without any position


def estimating(flight: Flight, flags: int) -> Flight:
    return flight.stream("estimator", lambda: mav.EkfStatusReport(flags), hz=2)


def test_a_sub_without_a_position_is_not_reported_stationary() -> None:
    # recorded from a real rover: armed, steered for two minutes, the estimate never above 0.14 m/s
    for flags, expected in ((AIDED, FALSE), (CONSTANT, UNKNOWN)):
        flight = estimating(Flight(ARDUPILOT, SUB).hb(armed=True, state=ACTIVE), flags)
        assert moving(flight, lambda f=flight: here(f, 0.1, 0, 0.02)) is expected


def test_without_a_position_only_a_climb_is_motion() -> None:
    for vehicle_type, expected in ((SUB, TRUE), (ROVER, UNKNOWN)):
        flight = estimating(Flight(ARDUPILOT, vehicle_type).hb(armed=True, state=ACTIVE), CONSTANT)
        assert moving(flight, lambda f=flight: here(f, 0.6, 0, -0.4)) is expected
        assert moving(flight, lambda f=flight: hud(0.6, 0.4)) is expected


def test_a_rover_that_loses_its_position_while_driving_is_not_reported_stationary() -> None:
    flight = estimating(rover().hb(armed=True, state=ACTIVE), AIDED)
    assert moving(flight, lambda: here(flight, 1, 0, 0)) is TRUE
    estimating(flight, CONSTANT)
    assert moving(flight, lambda: here(flight, 0.05, 0, 0), 5) is UNKNOWN
    flight.stop("estimator")
    assert moving(flight, lambda: here(flight, 0.05, 0, 0), 15) is FALSE


def test_a_low_speed_without_a_position_is_not_an_estimate_unless_the_estimator_confirms_it() -> None:
    flight = rover().hb(armed=True, state=ACTIVE)
    assert moving(flight, lambda: here(flight, 0.05, 0, 0, lat=0)) is UNKNOWN
    estimating(flight, AIDED & ~0x10)
    assert moving(flight, lambda: here(flight, 0.05, 0, 0, lat=0)) is FALSE


def test_the_ground_speed_of_px4_without_a_position_shows_motion_only() -> None:
    for speed, expected in ((0.05, UNKNOWN), (1.0, TRUE)):
        flight = Flight(PX4, ROVER).hb(armed=True, state=ACTIVE)
        assert moving(flight, lambda speed=speed: hud(speed, 0)) is expected


def test_a_zero_ground_speed_is_not_an_estimate_for_a_ground_vehicle_without_gps() -> None:
    for bits, expected in ((FITTED & ~GPS, UNKNOWN), (FITTED, FALSE)):
        flight = Flight(0, ROVER).set(present=bits, enabled=bits, health=bits).hb(armed=True, state=ACTIVE)
        assert moving(flight, lambda: hud(0, 0)) is expected


def test_the_speed_of_a_disarmed_ardupilot_with_an_unhealthy_ahrs_is_ignored() -> None:
    flight = rover().set(health=FITTED & ~AHRS | PREARM)
    assert moving(flight, lambda: here(flight, 5, 0, 0)) is UNKNOWN


def test_a_zero_velocity_is_not_an_estimate_for_inav_without_gps() -> None:
    for bits, expected in ((FITTED & ~MOTORS & ~GPS, UNKNOWN), (FITTED & ~MOTORS, FALSE)):
        flight = Flight(vehicle_type=PLANE).set(present=bits, enabled=bits, health=bits)
        assert moving(flight, lambda: hud(0, 0)) is expected


def test_a_climb_without_a_speed_is_not_rest_of_an_inav_rover_without_gps() -> None:
    bits = FITTED & ~MOTORS & ~GPS
    flight = Flight(vehicle_type=ROVER).set(present=bits, enabled=bits, health=bits)
    assert moving(flight, lambda: here(flight, 0, 0, 2)) is UNKNOWN


def test_a_zero_velocity_is_not_an_estimate_while_sys_status_is_old() -> None:
    flight = rover().hb(armed=True, state=ACTIVE)
    assert moving(flight, lambda: here(flight, 0, 0, 0)) is FALSE
    flight.stop("sys_status").wait(8)
    assert flight.status.in_motion is UNKNOWN


def test_a_disarmed_aircraft_at_rest_is_stationary() -> None:
    flight = px4()
    assert moving(flight, lambda: local(flight, 0, 0, 0)) is FALSE


def test_non_finite_numbers_are_not_a_speed() -> None:
    flight = px4()
    assert moving(flight, lambda: local(flight, math.nan, 0, 0)) is UNKNOWN
    assert moving(flight, lambda: local(flight, math.inf, 0, 0)) is UNKNOWN
    assert moving(flight, lambda: hud(math.nan, 0)) is UNKNOWN


def test_the_global_position_takes_precedence_over_the_local_one_and_both_over_the_hud() -> None:
    flight = rover().hb(armed=True, state=ACTIVE)
    flight.stream("global", lambda: here(flight, 0.01, 0, 0), hz=5)
    flight.stream("local", lambda: local(flight, 5, 0, 0), hz=5).stream("hud", lambda: hud(9, 0), hz=5).wait(3)
    assert flight.status.in_motion is FALSE
    flight.stop("global").wait(4)
    assert flight.status.in_motion is TRUE


@pytest.mark.parametrize(("vehicle_type", "expected"), [(ROVER, TRUE), (11, FALSE)])
def test_a_boat_that_only_rolls_is_not_in_motion(vehicle_type: int, expected: TriState) -> None:
    flight = Flight(vehicle_type=vehicle_type).hb(armed=True, state=ACTIVE)
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0.5, math.nan, 0.0), hz=5)
    assert moving(flight, lambda: here(flight, 0.01, 0, 0)) is expected


def test_an_armed_vehicle_in_the_air_is_in_motion_unless_an_option_says_otherwise() -> None:
    for armed, hover, expected in ((True, True, TRUE), (False, True, FALSE), (True, False, FALSE)):
        flight = px4(options=HardwareOptions(hover_is_motion=hover)).hb(armed=armed, state=ACTIVE)
        flight.stream("landed", lambda: mav.ExtendedSysState(0, 2))
        assert moving(flight, lambda f=flight: local(f, 0, 0, 0), 3) is expected


def test_the_landed_state_of_a_rover_is_ignored() -> None:
    flight = Flight(PX4, ROVER).hb(armed=True, state=ACTIVE)
    flight.stream("landed", lambda: mav.ExtendedSysState(0, 2))
    assert moving(flight, lambda: local(flight, 0, 0, 0), 3) is FALSE


def test_an_armed_aircraft_with_an_unknown_landed_state_is_not_reported_stationary() -> None:
    flight = px4().hb(armed=True, state=ACTIVE)
    assert moving(flight, lambda: local(flight, 0, 0, 0), 3) is UNKNOWN
    flight = copter().hb(armed=True, state=STANDBY)
    assert moving(flight, lambda: local(flight, 0, 0, 0), 3) is FALSE


def test_a_speed_between_the_thresholds_is_valid_but_changes_nothing() -> None:
    flight = px4()
    flight.stream("landed", lambda: mav.ExtendedSysState(0, 1))
    assert moving(flight, lambda: local(flight, 0.4, 0, 0)) is UNKNOWN
    flight.stop("motion").wait(4)
    assert flight.status.in_motion is FALSE


# -- outputs -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        (b"SERVO3_FUNCTION", 33.0, {3: 33}),
        (b"SERVO16_FUNCTION", 70.0, {16: 70}),
        (b"SERVO33_FUNCTION", 33.0, {}),
        (b"SERVO0_FUNCTION", 33.0, {}),
        (b"SERVO3_FUNCTION", math.nan, {}),
        (b"SERVO_FUNCTION", 1.0, {}),
        (b"SERVOX_FUNCTION", 1.0, {}),
        (b"SERVO3_MIN", 1000.0, {}),
        (b"", 1.0, {}),
    ],
)
def test_the_output_functions_come_from_the_parameters(name: bytes, value: float, expected: dict[int, int]) -> None:
    flight = copter().send(mav.ParamValue(value, 0, 0, name, 2))
    assert state_of(flight).watch.functions == expected


@pytest.mark.parametrize(
    "telemetry",
    [
        mav.EscTelemetry1To4(b"", b"", b"", pack("<4H", 0, 0, 900, 0), b"", b""),
        mav.EscTelemetry9To12(b"", b"", b"", pack("<4H", 1, 0, 0, 0), b"", b""),
        mav.EscStatus(0, pack("<4i", 0, -900, 0, 0), b"", b"", 0),
    ],
)
def test_a_turning_motor_is_not_stopped(telemetry: Any) -> None:
    flight = copter().hb(armed=True, state=ACTIVE).send(telemetry)
    assert flight.status.e_stopped is FALSE
    flight.wait(3)
    assert flight.status.e_stopped is UNKNOWN


def test_motors_at_rest_are_not_evidence() -> None:
    flight = copter().hb(armed=True, state=ACTIVE)
    flight.send(mav.EscTelemetry1To4(b"", b"", b"", bytes(8), b"", b""))
    assert flight.status.e_stopped is UNKNOWN


def test_outputs_are_not_monitored_if_disabled_by_option() -> None:
    flight = copter(options=HardwareOptions(watch_outputs=False))
    flight.send(mav.ServoOutputRaw._make((*[1000] * 8, 0, *[0] * 8)))
    assert state_of(flight).watch.values == ()


# -- modes -------------------------------------------------------------------------------------------------------------


def test_available_modes_gives_names_and_current_mode_gives_the_standard_mode() -> None:
    flight = Flight(autopilot=0).hb(mode=3, flags=0x51)
    assert (flight.status.mode, flight.detail.vehicle.flight_mode) == (RobotMode.MANUAL, "CMODE(3)")
    flight.send(mav.AvailableModes(3, 0, 8, 3, 6, b"Autopilot"))
    assert (flight.status.mode, flight.detail.vehicle.flight_mode) == (RobotMode.AUTO, "Autopilot")
    flight.send(mav.CurrentMode(3, 3, 4))
    assert flight.status.mode is RobotMode.MANUAL
    assert flight.wait(6)[-1].mode is RobotMode.AUTO


# -- texts and events --------------------------------------------------------------------------------------------------


def test_an_arming_refusal_ends_when_the_checks_pass() -> None:
    flight = copter().set(health=FITTED)
    flight.text("PreArm: Compass not calibrated", 2).wait(2)
    assert flight.inhibits["PREARM_FAILING"] == "PreArm: Compass not calibrated"
    flight.set(health=FITTED | PREARM).wait(2)
    assert "PREARM_FAILING" not in flight.inhibits
    flight.set(health=FITTED).wait(2)
    assert flight.inhibits["PREARM_FAILING"] is None


def test_a_repeated_event_counts_once() -> None:
    flight = px4().hb(armed=True, state=ACTIVE)
    event = mav.Event(1, 0, 9, 0, 0, 0x42, b"")
    flight.send(event).wait(9)
    flight.send(event).wait(2)
    assert flight.codes == []


def test_events_of_other_autopilots_are_ignored() -> None:
    assert copter().hb(armed=True, state=ACTIVE).event(0x42).codes == []


def test_an_emergency_has_the_code_of_its_cause_or_else_4000() -> None:
    flight = copter().hb(armed=True, state=EMERGENCY)
    assert flight.codes == [4000]
    assert flight.text("Crash detected", 0).codes == [4001]


def test_failsafe_states_have_the_time_of_their_start() -> None:
    flight = copter().hb(armed=True, state=CRITICAL)
    since = flight.detail.errors[0].since_us
    flight.wait(5)
    assert flight.detail.errors[0].since_us == since


@pytest.mark.parametrize(("receiver", "first"), [(True, TriState.FALSE), (False, TriState.UNKNOWN)])
def test_a_new_estimate_needs_no_slow_second_if_the_receiver_is_stationary(receiver: bool, first: TriState) -> None:
    flight = copter()
    still = mav.GpsRawInt(*[0] * len(mav.GpsRawInt._fields))._replace(fix_type=3)
    if receiver:
        flight.stream("gps", lambda: still, hz=5)
    flight.wait(2.0)
    assert flight.status.in_motion is first
    flight.stream("global", lambda: here(flight, 0.05, 0.0, 0.0), hz=5)
    flight.wait(0.5)
    assert flight.status.in_motion is first
    flight.wait(1.0)
    assert flight.status.in_motion is TriState.FALSE
