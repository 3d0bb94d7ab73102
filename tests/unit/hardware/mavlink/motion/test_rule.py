"""Sequences in which messages about motion contradict one another, or say less than they seem to."""

from __future__ import annotations

import pytest

from mav_robot_status.interface import TriState
from mav_robot_status.mavlink import definitions as mav

from ..driver import (
    ACTIVE,
    AHRS,
    ARDUPILOT,
    PLANE,
    PREARM,
    PX4,
    QUAD,
    QUADPLANE,
    ROVER,
    STANDBY,
    SUB,
    Flight,
    copter,
    rover,
)

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
IN_AIR, ON_GROUND = 2, 1
HELICOPTER, MULTICOPTER = 4, 3
HEALTHY, NO_ATTITUDE = 0x33F, 0x400


class Air:
    """A vehicle that reports to be in the air: its speed, rotation and throttle."""

    def __init__(
        self,
        vehicle_type: int,
        throttle: int,
        landed_state: int = IN_AIR,
        vtol_state: int = 0,
        autopilot: int = ARDUPILOT,
    ) -> None:
        self.speed, self.rate, self.throttle, self.landed_state = 0, 0.0, throttle, landed_state
        self.flight = flight = Flight(autopilot, vehicle_type)
        flight.stream("position", lambda: mav.GlobalPositionInt(flight.boot_ms, 1, 1, self.speed, 0, 0), hz=4)
        flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0, 0, self.rate), hz=4)
        flight.stream("hud", lambda: mav.VfrHud(self.speed / 100, 0.0, self.throttle), hz=2)
        flight.stream("landed", lambda: mav.ExtendedSysState(vtol_state, self.landed_state), hz=2)
        flight.wait(15)
        flight.hb(armed=True, state=ACTIVE).wait(5)

    @property
    def in_motion(self) -> TriState:
        self.flight.wait(5)
        return self.flight.status.in_motion


@pytest.mark.parametrize(("vehicle_type", "throttle"), [(PLANE, 0), (HELICOPTER, 0), (QUADPLANE, 0), (QUAD, 5)])
def test_in_the_air_but_still_and_hardly_with_throttle_is_unknown(vehicle_type: int, throttle: int) -> None:
    assert Air(vehicle_type, throttle).in_motion is UNKNOWN


@pytest.mark.parametrize(("vehicle_type", "vtol_state"), [(QUAD, 0), (QUADPLANE, MULTICOPTER)])
def test_a_multicopter_that_stands_still_without_thrust_lies_on_the_ground(vehicle_type: int, vtol_state: int) -> None:
    air = Air(vehicle_type, throttle=0, vtol_state=vtol_state)
    assert air.in_motion is FALSE
    air.throttle = 55
    assert air.in_motion is FALSE, "it has not moved since"
    air.speed = 100
    assert air.in_motion is TRUE
    air.speed = 0
    assert air.in_motion is TRUE, "this may be a hover"


def test_thrust_of_another_autopilot_than_ardupilot_is_not_known() -> None:
    air = Air(QUAD, throttle=0, autopilot=PX4)
    assert air.in_motion is UNKNOWN
    air.throttle = 55
    assert air.in_motion is TRUE


def test_what_moved_unseen_may_hover() -> None:
    air = Air(QUAD, throttle=0)
    assert air.in_motion is FALSE
    air.flight.stop("position", "hud").wait(4)
    air.throttle = 55
    air.flight.stream("position", lambda: mav.GlobalPositionInt(air.flight.boot_ms, 1, 1, air.speed, 0, 0), hz=4)
    assert air.in_motion is TRUE


def test_an_aircraft_that_drops_is_in_motion() -> None:
    air = Air(QUAD, throttle=0)
    air.speed = 16  # slow, at the top of its path
    assert air.in_motion is UNKNOWN
    air.speed = 500
    assert air.in_motion is TRUE


def test_a_still_hover_is_in_motion() -> None:
    assert Air(QUAD, throttle=35).in_motion is TRUE
    assert Air(QUAD, throttle=10).in_motion is TRUE


def test_a_glide_without_throttle_is_in_motion() -> None:
    air = Air(PLANE, throttle=0)
    air.speed = 1500
    assert air.in_motion is TRUE


def test_a_tumble_without_throttle_is_in_motion() -> None:
    air = Air(QUAD, throttle=0)
    air.rate = 1.0
    assert air.in_motion is TRUE


def test_in_the_air_without_a_fresh_throttle_is_in_motion() -> None:
    air = Air(PLANE, throttle=0)
    air.flight.stop("hud")
    assert air.in_motion is TRUE


def test_in_the_air_without_a_fresh_speed_is_in_motion() -> None:
    air = Air(QUAD, throttle=0)
    air.flight.stop("position", "hud").stream("hud", lambda: mav.VfrHud(float("nan"), 0.0, 0), hz=2)
    assert air.in_motion is TRUE


def test_a_still_aircraft_on_the_ground_is_not_in_motion() -> None:
    assert Air(QUAD, throttle=0, landed_state=ON_GROUND).in_motion is FALSE


def turning(vehicle_type: int, rate: float, armed: bool = True) -> Flight:
    """A vehicle of which only ATTITUDE tells something about motion."""
    flight = Flight(ARDUPILOT, vehicle_type)
    flight.set(health=flight.health | AHRS)
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0, 0, rate), hz=4)
    flight.wait(15)
    flight.hb(armed=armed, state=ACTIVE if armed else STANDBY).wait(3)
    return flight


@pytest.mark.parametrize("vehicle_type", [SUB, ROVER, QUAD])
@pytest.mark.parametrize("rate", [0.3, -0.3])
def test_rotation_alone_shows_motion(vehicle_type: int, rate: float) -> None:
    flight = turning(vehicle_type, rate)
    assert flight.status.in_motion is TRUE
    assert flight.vehicle.handle.evidence["in_motion"].source == "ATTITUDE: 0.30 rad/s"


@pytest.mark.parametrize("rate", [0.0, 0.05, 0.12])
def test_no_rotation_never_shows_rest(rate: float) -> None:
    assert turning(SUB, rate).status.in_motion is UNKNOWN


def test_rotation_shows_motion_only_while_it_is_reported() -> None:
    flight = turning(SUB, 0.3).stop("attitude")
    flight.wait(5)
    assert flight.status.in_motion is UNKNOWN
    flight = turning(SUB, 0.3).stop("attitude")
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0, 0, 0.0), hz=4)
    flight.wait(2)
    assert flight.status.in_motion is UNKNOWN


def runaway() -> Flight:
    """A disarmed copter at rest whose estimate climbs and turns."""
    flight = copter()
    flight.stream("position", lambda: mav.GlobalPositionInt(flight.boot_ms, 1, 1, 0, 0, 1400), hz=4)
    flight.stream("attitude", lambda: mav.Attitude(flight.boot_ms, 0, 0, 0.5), hz=4)
    flight.wait(15)
    return flight


@pytest.mark.parametrize("check", ["PreArm", "Arm"])
@pytest.mark.parametrize("words", ["EKF attitude is bad", "AHRS: not healthy", "AHRS not healthy"])
def test_an_estimator_that_calls_itself_wrong_in_a_text_shows_no_motion(check: str, words: str) -> None:
    flight = runaway()
    assert flight.status.in_motion is TRUE
    flight.set(health=flight.health & ~PREARM).text(f"{check}: {words}", 2).wait(1)
    assert {status.in_motion for status in flight.wait(30)} == {UNKNOWN}
    flight.wait(10)  # it is repeated every 30 s while it is so
    assert flight.status.in_motion is TRUE


def test_passed_checks_end_what_the_estimator_said_of_itself() -> None:
    flight = runaway().text("PreArm: EKF attitude is bad", 2)
    flight.wait(3)
    assert flight.status.in_motion is TRUE


def test_an_estimator_without_an_attitude_shows_no_motion() -> None:
    flight = runaway()
    flight.stream("estimator", lambda: mav.EkfStatusReport(NO_ATTITUDE)).wait(2)
    assert flight.status.in_motion is UNKNOWN
    flight.stop("estimator").stream("estimator", lambda: mav.EkfStatusReport(HEALTHY)).wait(2)
    assert flight.status.in_motion is TRUE


def test_an_armed_vehicle_moves_whatever_its_estimator_says_of_itself() -> None:
    flight = runaway().text("PreArm: EKF attitude is bad", 2).hb(armed=True, state=ACTIVE)
    flight.wait(3)
    assert flight.status.in_motion is TRUE


def test_zeros_of_an_unknown_autopilot_do_not_show_rest() -> None:
    flight = Flight(0, ROVER)
    flight.set(present=0, enabled=0, health=0).stream("hud", lambda: mav.VfrHud(0.0, 0.0, 0), hz=4)
    flight.wait(5)
    flight.hb(armed=True, state=ACTIVE)
    assert {status.in_motion for status in flight.wait(60)} == {UNKNOWN}


def test_zeros_of_a_known_autopilot_show_rest() -> None:
    flight = rover()
    flight.stream("hud", lambda: mav.VfrHud(0.0, 0.0, 0), hz=4).wait(20)
    assert flight.status.in_motion is FALSE


def settling(speed: int, receiver: int, armed: bool = False) -> Flight:
    """A rover whose estimate of `speed` cm/s decides nothing, beside a GPS receiver that reads `receiver` cm/s."""
    flight = rover()
    flight.set(health=flight.health | AHRS)
    flight.wait(15)
    flight.stream("position", lambda: mav.GlobalPositionInt(flight.boot_ms, 1, 1, speed, 0, 0), hz=4)
    flight.stream("receiver", lambda: mav.GpsRawInt(receiver, 6), hz=4)
    flight.hb(armed=armed, state=ACTIVE if armed else STANDBY).wait(5)
    return flight


def test_a_receiver_that_stands_still_decides_for_a_disarmed_vehicle_whose_estimate_does_not() -> None:
    assert settling(45, receiver=1).status.in_motion is FALSE
    assert settling(45, receiver=45).status.in_motion is UNKNOWN
    assert settling(25, receiver=1, armed=True).status.in_motion is UNKNOWN


def test_a_receiver_that_stands_still_leaves_an_estimate_that_moves_in_doubt() -> None:
    assert settling(60, receiver=1).status.in_motion is UNKNOWN
