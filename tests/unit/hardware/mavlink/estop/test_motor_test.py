"""A motor that turns while the HEARTBEAT says disarmed is never called safe."""

from struct import pack

import pytest

from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav

from ..driver import FITTED, MOTORS, PLANE, Flight, copter, px4

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
REST = (1000, 1000, 1000, 1000, 0, 0, 0, 0)
QUADPLANE_REST = (1500, 1380, 1000, 1500, 1000, 1000, 1000, 1000)
MOTOR_TEST, ACTUATOR_TEST = 209, 310


def outputs(values: tuple[int, ...]) -> mav.ServoOutputRaw:
    return mav.ServoOutputRaw._make((*values, 0, *(0,) * 8))


class Bench:
    """A disarmed vehicle that sends its outputs twice a second."""

    def __init__(self, flight: Flight, rest: tuple[int, ...] = REST) -> None:
        self.flight, self.values = flight, rest
        flight.stream("outputs", lambda: outputs(self.values), hz=2)
        flight.wait(6)
        assert flight.status.drives_powered is FALSE

    def turn(self, channel: int, pulse: int) -> None:
        self.values = (*self.values[: channel - 1], pulse, *self.values[channel:])


def ack(command: int, result: int = 0) -> mav.CommandAck:
    return mav.CommandAck(command, result, 0, 0, 255, 190)


def check_turns(flight: Flight) -> None:
    assert flight.status.drives_powered is TRUE
    assert flight.status.motion_possible is UNKNOWN
    assert flight.status.e_stopped is not TRUE


@pytest.mark.parametrize(
    ("flight", "rest", "channel"),
    [
        (copter(), REST, 2),
        (Flight(3, PLANE, version=(4, 5, 6)), QUADPLANE_REST, 5),
        (px4(), (900,) * 8, 1),
    ],
    ids=["copter", "quadplane", "px4"],
)
def test_a_motor_output_off_its_stop_value_is_power(flight: Flight, rest: tuple[int, ...], channel: int) -> None:
    bench = Bench(flight, rest)
    bench.turn(channel, 1300)
    flight.wait(1.1)
    assert flight.vehicle.handle.evidence["drives_powered"].rule == "a motor turns while it is disarmed (motor test)"
    check_turns(flight)
    flight.wait(60)
    check_turns(flight)
    bench.values = rest
    flight.wait(2.4)
    check_turns(flight)  # for 3 s after the last output that drives it
    flight.wait(1.2)
    assert flight.status.drives_powered is FALSE
    assert flight.status.motion_possible is FALSE


def test_one_output_off_its_stop_value_is_a_doubt() -> None:
    bench = Bench(copter())
    bench.turn(1, 1100)
    bench.flight.wait(0.6)
    assert bench.flight.status.drives_powered is UNKNOWN


def test_the_pulse_of_a_test_is_not_learnt_as_a_stop_value() -> None:
    bench = Bench(copter())
    bench.turn(1, 1050)
    bench.flight.wait(30)
    check_turns(bench.flight)


def test_a_lower_output_than_the_one_heard_first_is_the_stop_value() -> None:
    """The connection begins while a test runs."""
    flight = copter()
    bench = Bench(flight, (1200, 1000, 1000, 1000, 0, 0, 0, 0))
    bench.values = REST
    flight.wait(10)
    assert flight.status.drives_powered is FALSE
    bench.turn(1, 1200)
    flight.wait(1.1)
    check_turns(flight)


def test_a_control_surface_of_a_plane_is_no_motor() -> None:
    bench = Bench(Flight(3, PLANE, version=(4, 5, 6)), (1500, 1500, 1000, 1500, 1500, 1000, 1000, 1000))
    for pulse in (1800, 1100, 1900):
        bench.turn(5, pulse)
        bench.turn(1, pulse)
        bench.flight.wait(2)
        assert bench.flight.status.drives_powered is FALSE


def test_without_outputs_the_texts_of_a_copter_tell_of_a_test() -> None:
    """ArduCopter/motor_test.cpp says both texts; its HEARTBEAT says disarmed after a disarm in the test."""
    flight = copter()
    flight.wait(5)
    flight.text("starting motor test", 6)
    assert flight.status.drives_powered is UNKNOWN
    assert flight.status.motion_possible is UNKNOWN
    flight.wait(100)
    assert flight.status.drives_powered is UNKNOWN
    flight.text("finished motor test", 6)
    flight.wait(0.1)
    assert flight.status.drives_powered is FALSE


def test_outputs_at_rest_end_the_doubt_of_a_text() -> None:
    bench = Bench(copter())
    bench.flight.text("starting motor test", 6)
    assert bench.flight.status.drives_powered is UNKNOWN
    bench.flight.wait(5)
    assert bench.flight.status.drives_powered is FALSE


@pytest.mark.parametrize(("flight", "command"), [(copter(), MOTOR_TEST), (px4(), ACTUATOR_TEST)], ids=["copter", "px4"])
def test_an_accepted_command_is_a_doubt_for_ten_seconds(flight: Flight, command: int) -> None:
    flight.wait(5)
    flight.send(ack(command, 3))  # unsupported
    assert flight.status.drives_powered is FALSE
    flight.send(ack(command))
    assert flight.status.drives_powered is UNKNOWN
    flight.wait(9.9)
    assert flight.status.drives_powered is UNKNOWN
    flight.wait(0.5)
    assert flight.status.drives_powered is FALSE


def test_an_overheard_motor_test_lasts_as_long_as_it_says() -> None:
    flight = copter()
    flight.wait(5)
    flight.send(mav.CommandLong(1, 1, 1300, 20, 2, 0, 0, MOTOR_TEST, 1, 1, 0), (255, 190))
    flight.send(ack(MOTOR_TEST))
    flight.wait(39)
    assert flight.status.drives_powered is UNKNOWN
    flight.wait(2)
    assert flight.status.drives_powered is FALSE


def test_a_stop_is_not_believed_while_a_motor_turns() -> None:
    """A stop does not end a motor test of a QuadPlane, and the test forces PREARM_CHECK healthy."""
    flight = Flight(3, PLANE, version=(4, 5, 6))
    bench = Bench(flight, QUADPLANE_REST)
    bench.turn(6, 1300)
    flight.wait(2)
    applet = mav.NamedValueFloat(0, 1.0, b"RS_STOP")
    flight.stream("applet", lambda: applet)
    flight.wait(3)
    check_turns(flight)
    assert flight.status.e_stopped is UNKNOWN
    bench.values = QUADPLANE_REST
    flight.wait(5)
    assert flight.status.e_stopped is TRUE


def test_passing_pre_arm_checks_are_no_evidence_during_a_test() -> None:
    bench = Bench(copter())
    assert bench.flight.status.e_stopped is FALSE
    bench.turn(1, 1200)
    bench.flight.wait(2)
    assert bench.flight.status.e_stopped is UNKNOWN


def test_an_arming_ends_the_doubt() -> None:
    bench = Bench(copter())
    bench.turn(1, 1200)
    bench.flight.wait(2)
    bench.flight.hb(armed=True)
    assert bench.flight.status.motion_possible is not FALSE


def test_rpm_without_outputs_is_a_doubt_once_it_cannot_coast_any_more() -> None:
    flight = copter()
    flight.wait(5)
    turning = mav.EscTelemetry1To4(bytes(8), bytes(8), bytes(8), pack("<4H", 0, 900, 0, 0), bytes(8), bytes(4))
    flight.stream("esc", lambda: turning, hz=2)
    flight.wait(3)
    assert flight.status.drives_powered is FALSE
    flight.wait(4)
    assert flight.status.drives_powered is UNKNOWN
    flight.stop("esc")
    flight.wait(3)
    assert flight.status.drives_powered is FALSE


def test_a_safety_switch_that_was_reported_long_ago_does_not_hold_a_motor() -> None:
    bench = Bench(copter())
    bench.flight.set(present=FITTED, enabled=FITTED & ~MOTORS).wait(2)
    bench.turn(2, 1300)
    bench.flight.wait(2)
    assert bench.flight.status.drives_powered is FALSE
    bench.flight.stop("sys_status").wait(6)
    check_turns(bench.flight)
