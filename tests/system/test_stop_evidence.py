"""Evidence of an emergency stop and its end, with the installed command. Worst is a live vehicle called stopped."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests import pymavlink_dialect as mav

from .flight_log import ACTIVE, FITTED, MOTORS, PLANE, PREARM, PX4, QUAD, ROVER, STANDBY, SUB, FlightLog
from .gateway_process import Gateway
from .wire import Wire

STOPPED, UNCERTAIN, LIVE = (True, False, False), (None, None, None), (False, True, True)
UNTOLD = (None, True, True)
IDLE, FLYING = (1000,) * 4, (1632,) * 4
HIGH, LOW = 2, 0
SWITCH_ON = FITTED & ~MOTORS | PREARM


@pytest.fixture
def log(tmp_path: Path) -> Callable[..., FlightLog]:
    return lambda *arguments: FlightLog(tmp_path / "flight.tlog", *arguments)


def said(flight: FlightLog) -> FlightLog:
    """An armed vehicle says that it is stopped."""
    return flight.run(2, armed=True, state=ACTIVE).text("RC7: MotorEStop HIGH").run(3)


# -- what was only said ends with signs of power -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "signs",
    [
        {"throttle": 60, "speed": 5.0},
        {"outputs": (1500, 0, 1800)},
        {"rpm": 5000, "outputs": (1500, 0, 1800)},
        {"throttle": 60, "speed": 5.0, "outputs": (1500, 0, 1800), "rpm": 5000},
    ],
    ids=["motion under power", "a driven motor", "rpm and outputs", "all"],
)
def test_a_stop_whose_release_was_lost_ends_when_the_vehicle_has_power(
    log: Callable[..., FlightLog], signs: dict[str, object]
) -> None:
    flight = said(log(ROVER))
    began = flight.now
    seen = flight.run(15, **signs).replayed()
    assert seen.stop(began - 0.5) == STOPPED
    assert seen.stops(began + 8, began + 14) <= {UNCERTAIN, LIVE}


def test_a_stop_that_the_outputs_show_as_well_does_not_end(log: Callable[..., FlightLog]) -> None:
    flight = log(QUAD).run(10, outputs=IDLE, throttle=0).run(5, armed=True, state=ACTIVE, outputs=FLYING, throttle=40)
    flight.text("RC7: MotorEStop HIGH")
    began = flight.now
    seen = flight.run(10, outputs=IDLE, throttle=100, climb=-9.0, speed=3.0).replayed()
    assert seen.stops(began + 1.5, began + 9) == {STOPPED}


# -- a link loss -------------------------------------------------------------------------------------------------------


def test_after_a_link_loss_a_stop_is_unknown_until_it_is_said_again(log: Callable[..., FlightLog]) -> None:
    flight = said(log(ROVER)).silence(8)
    back = flight.now
    flight.run(10).text("RC7: MotorEStop HIGH")
    again = flight.now
    seen = flight.run(2).replayed()
    assert seen.stops(back + 0.1, again - 0.1) == {UNCERTAIN}
    assert seen.stop(again + 1) == STOPPED


def test_after_a_link_loss_a_release_is_unknown(log: Callable[..., FlightLog]) -> None:
    flight = said(log(ROVER)).text("RC7: MotorEStop LOW").run(2)
    lost = flight.now
    seen = flight.silence(8).run(5).replayed()
    assert seen.stop(lost - 0.5) == LIVE
    assert seen.stop(lost + 10) == UNTOLD


# -- PX4 ---------------------------------------------------------------------------------------------------------------


def test_a_px4_that_shows_a_kill_in_its_state_is_not_believed_on_its_words(log: Callable[..., FlightLog]) -> None:
    flight = log(QUAD, PX4).version(1, 14, 3).run(5, armed=True, state=ACTIVE).version(1, 14, 3)
    flight.text("Manual kill-switch engaged")
    began = flight.now
    seen = flight.run(40).replayed()
    assert seen.stops(began + 1.1, began + 39) == {LIVE}


# -- commands ----------------------------------------------------------------------------------------------------------


def test_a_release_whose_answer_was_lost_does_not_leave_a_stop(log: Callable[..., FlightLog]) -> None:
    flight = log(ROVER).run(3, armed=True, state=ACTIVE).stop_command(HIGH).ack().run(3)
    began = flight.stop_command(LOW).now
    seen = flight.run(30).replayed()
    assert seen.stop(began - 0.5) == STOPPED
    assert seen.stops(began + 0.1, began + 29) == {UNCERTAIN}


def test_an_answer_that_may_belong_to_another_function_proves_nothing(log: Callable[..., FlightLog]) -> None:
    flight = log(ROVER).run(3, armed=True, state=ACTIVE).stop_command(HIGH)
    other = mav.MAVLink_command_long_message(1, 1, 218, 0, 9, HIGH, 0, 0, 0, 0, 0)
    began = flight.add(other, (255, 190)).ack().now
    seen = flight.run(10).replayed()
    assert True not in {stop[0] for stop in seen.stops(began, began + 9)}


@pytest.mark.parametrize("stranger", [True, False], ids=["of a stranger", "on the vehicle's own way"])
def test_a_command_counts_only_if_it_was_delivered(
    gateway: Callable[..., Gateway], wire: Callable[..., Wire], stranger: bool
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address)
    rover.beat(armed=True)
    rover.beating()
    gate.wait_for(lambda status: status["drives_powered"] is True)
    sender = wire(gate.address, system=255, component=190) if stranger else rover
    source = mav.MAVLink(None, srcSystem=255, srcComponent=190)
    command = mav.MAVLink_command_long_message(1, 1, 218, 0, 31, HIGH, 0, 0, 0, 0, 0)
    sender.send(command.pack(source))
    gate.wait_for_lines(3, after=time.monotonic())
    rover.send(mav.MAVLink_command_ack_message(218, 0, 0, 0, 255, 190))
    sent = time.monotonic()
    if stranger:
        gate.wait_for_lines(30, after=sent)
        assert {line.status["e_stopped"] for line in gate.lines} == {None}
    else:
        gate.wait_for(lambda status: status["e_stopped"] is True, after=sent)


# -- the safety switch -------------------------------------------------------------------------------------------------


def test_a_safety_switch_shown_before_the_arming_is_no_stop(log: Callable[..., FlightLog]) -> None:
    flight = log(ROVER).set(sys_status_period=4.0, enabled=SWITCH_ON).run(9)
    armed = flight.now
    seen = flight.run(7, enabled=FITTED | PREARM, armed=True, state=ACTIVE).replayed()
    assert seen.stop(armed - 0.5) == STOPPED
    assert STOPPED not in seen.stops(armed + 0.1, armed + 6.5)
    assert seen.stop(armed + 0.5) == UNCERTAIN
    assert seen.stop(armed + 6) == UNTOLD


def test_a_safety_switch_shown_after_the_arming_is_a_stop(log: Callable[..., FlightLog]) -> None:
    flight = log(ROVER).run(5).run(3, armed=True, state=ACTIVE)
    began = flight.now
    seen = flight.run(5, enabled=SWITCH_ON).replayed()
    assert seen.stops(began + 0.5, began + 4.9) == {STOPPED}


# -- the outputs -------------------------------------------------------------------------------------------------------


def test_a_falling_copter_is_never_called_powered_again(log: Callable[..., FlightLog]) -> None:
    flight = log(QUAD).run(10, outputs=IDLE, throttle=0).run(5, armed=True, state=ACTIVE, outputs=FLYING, throttle=40)
    began = flight.now
    flight.run(2, outputs=IDLE, throttle=100, climb=-5.0).run(2, climb=3.0).run(4, throttle=0, climb=0.0)
    released = flight.now
    seen = flight.run(3, outputs=FLYING, throttle=40).replayed()
    assert seen.stop(began - 0.5) == LIVE
    assert seen.stop(began + 1.5) == STOPPED
    assert seen.stops(began + 1.5, released - 0.1) == {STOPPED, UNCERTAIN}
    assert seen.stop(released + 2) == LIVE


def flown_plane(log: Callable[..., FlightLog]) -> FlightLog:
    """A plane that has taken off, and cruises."""
    plane = log(PLANE).run(10, outputs=(1500, 1500, 1000, 1500), throttle=0)
    plane.run(5, armed=True, state=ACTIVE, outputs=(1500, 1450, 2000, 1500), throttle=100, speed=15.0, climb=3.0)
    return plane.run(5, outputs=(1500, 1500, 1540, 1500), throttle=54, speed=22.0, climb=0.0)


def test_the_throttle_channel_shows_the_stop_of_a_plane_until_a_motor_is_driven(log: Callable[..., FlightLog]) -> None:
    plane = flown_plane(log)
    began = plane.now
    plane.run(3, outputs=(1500, 1400, 1000, 1500), throttle=100, speed=16.0, climb=-4.0)
    pulled = plane.now
    plane.run(5, throttle=0, speed=14.0)
    released = plane.now
    seen = plane.run(3, outputs=(1500, 1500, 1540, 1500), throttle=54).replayed()
    assert seen.stop(began - 0.5) == LIVE
    assert seen.stop(began + 2.4) == STOPPED
    assert seen.stops(pulled + 0.6, released - 0.1) == {UNCERTAIN}
    assert seen.stop(released + 2) == LIVE


def test_a_plane_on_its_lift_motors_is_not_called_stopped(log: Callable[..., FlightLog]) -> None:
    plane = flown_plane(log)
    began = plane.now
    seen = plane.run(
        10, outputs=(1500, 1500, 1000, 1500, 1700, 1700, 1700, 1700), vtol_state=3, speed=2.0, throttle=50
    ).replayed()
    assert True not in {stop[0] for stop in seen.stops(began, began + 9)}


def test_a_plane_that_keeps_flying_is_not_called_stopped(log: Callable[..., FlightLog]) -> None:
    plane = flown_plane(log)
    began = plane.now
    seen = plane.run(10, outputs=(1500, 1500, 1000, 1500), throttle=54, speed=22.0, climb=0.0).replayed()
    assert True not in {stop[0] for stop in seen.stops(began, began + 9)}


def test_the_default_channels_of_a_sub_show_that_it_is_driven(log: Callable[..., FlightLog]) -> None:
    sub = log(SUB).run(10, outputs=(1500,) * 6, throttle=50)
    sub.run(3, armed=True, state=ACTIVE, outputs=(1600, 1400, 1600, 1400, 1500, 1500))
    assert sub.replayed().stop(sub.now - 0.5) == LIVE


# -- texts, versions and switches --------------------------------------------------------------------------------------


def test_a_text_without_the_number_of_the_channel_counts_and_old_checks_do_not_end_it(
    log: Callable[..., FlightLog],
) -> None:
    flight = log(QUAD).run(1).version(4, 2, 2).run(9).run(3, armed=True, state=ACTIVE).text("MotorEStop HIGH")
    began = flight.now
    flight.run(3).run(20, armed=False, state=STANDBY).text("MotorEStop LOW")
    released = flight.now
    seen = flight.run(2).replayed()
    assert seen.stop(5)[0] is None
    assert seen.stops(began + 0.1, released - 0.1) == {STOPPED}
    assert seen.stop(released + 1)[0] is False


@pytest.mark.parametrize(
    ("sign", "expected"),
    [("4.5.6", False), ("4.2.2", None), ("none", None), ("mission state", False)],
)
def test_passing_checks_of_a_copter_count_if_its_firmware_includes_the_stop(
    log: Callable[..., FlightLog], sign: str, expected: bool | None
) -> None:
    flight = log(QUAD).run(1)
    if sign == "mission state":
        flight.add(mav.MAVLink_mission_current_message(0, 0, 1, 0))
    elif sign != "none":
        flight.version(*map(int, sign.split(".")))
    assert flight.run(9).replayed().stop(9.5)[0] is expected


def test_a_switch_in_its_stop_position_forbids_false(log: Callable[..., FlightLog]) -> None:
    flight = log(ROVER).run(1).option(6, 31).run(9, rc=(1500, 1500, 1500, 1500, 1000, 1000))
    moved = flight.now
    seen = flight.run(5, rc=(1500, 1500, 1500, 1500, 1000, 2000)).replayed()
    assert seen.stop(moved - 0.1)[0] is False
    assert {stop[0] for stop in seen.stops(moved + 0.6, moved + 4.9)} == {None}


# -- the applet --------------------------------------------------------------------------------------------------------


def test_the_word_of_the_applet_stands_above_texts_checks_and_outputs(log: Callable[..., FlightLog]) -> None:
    flight = log(ROVER).run(10, applet=0.0).run(3, armed=True, state=ACTIVE)
    began = flight.now
    flight.text("RC7: MotorEStop LOW").run(5, applet=1.0)
    switched = flight.now
    flight.run(3, applet=2.0)
    released = flight.now
    flight.text("RC7: MotorEStop HIGH").run(3, applet=0.0)
    silent = flight.now
    seen = flight.run(8, applet=None).replayed()
    assert seen.stop(2)[0] is False
    assert seen.stop(began - 0.5) == LIVE
    assert seen.stops(began + 0.1, switched - 0.1) == {STOPPED}
    assert seen.stop(switched + 1) == STOPPED
    assert seen.stop(released + 1) == LIVE
    assert seen.stop(silent + 7) == UNTOLD
    assert "the applet is silent" in seen.log


def test_an_applet_that_falls_silent_during_a_stop_leaves_it_unknown(log: Callable[..., FlightLog]) -> None:
    flight = log(ROVER).run(5, applet=1.0, armed=True, state=ACTIVE)
    silent = flight.now
    seen = flight.run(10, applet=None).replayed()
    assert seen.stops(silent + 3, silent + 9) == {UNCERTAIN}


def test_a_motor_that_is_driven_contradicts_the_applet(log: Callable[..., FlightLog]) -> None:
    flight = log(QUAD).run(10, outputs=IDLE, throttle=0, applet=0.0)
    flight.run(3, armed=True, state=ACTIVE, outputs=FLYING, throttle=40)
    began = flight.now
    seen = flight.run(5, applet=1.0).replayed()
    assert seen.stop(began + 0.4) == STOPPED
    assert seen.stops(began + 1.6, began + 4.9) == {UNCERTAIN}


@pytest.mark.parametrize("word", [4.0, -1.0, 0.5, float("nan"), float("inf")])
def test_a_word_of_the_applet_without_a_meaning_is_ignored(log: Callable[..., FlightLog], word: float) -> None:
    flight = log(ROVER).run(3, armed=True, state=ACTIVE, applet=1.0).run(2, applet=word)
    assert flight.replayed().stop(4.5) == STOPPED


def test_another_components_word_is_ignored(log: Callable[..., FlightLog]) -> None:
    flight = log(ROVER).run(3, armed=True, state=ACTIVE)
    flight.add(mav.MAVLink_named_value_float_message(0, b"RS_STOP", 1.0), (1, 154)).run(2)
    assert flight.replayed().stop(4.5) == UNTOLD


@pytest.mark.parametrize(("word", "expected"), [(0.0, LIVE), (1.0, UNTOLD), (2.0, STOPPED), (3.0, STOPPED)])
def test_a_sub_drives_on_in_an_emergency_stop(
    log: Callable[..., FlightLog], word: float, expected: tuple[object, ...]
) -> None:
    flight = log(SUB).run(5, armed=True, state=ACTIVE, applet=word)
    assert flight.replayed().stop(4.5) == expected
