from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.autopilots import ARDUPILOT, PX4, Autopilot
from mav_robot_status.hardware.mavlink.autopilots.firmware import Firmware
from mav_robot_status.hardware.mavlink.estop.state import (
    NOTHING,
    READY_MESSAGES,
    Stop,
    heard_sys_status,
    includes_stop,
    said,
    still_said,
)
from mav_robot_status.hardware.mavlink.heartbeat.state import HeartbeatHistory, first_heartbeat
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import TriState
from mav_robot_status.mavlink.definitions import Heartbeat, ParamValue, RcChannels, SysStatus

from ..driver import ACTIVE, FITTED, MOTORS, PREARM, STANDBY, TERMINATED, copter, px4, version_of

NOW = Instant(1000.0, 1_800_000_000_000_000)
ALL = FITTED | PREARM
READY = SysStatus._make((ALL, ALL, ALL, *[0] * 5))
NOT_READY = READY._replace(onboard_control_sensors_health=FITTED)
LAND = 9
HIGH, PREARM_TEXT = "RC7: MotorEStop HIGH", "PreArm: Motors Emergency Stopped"


def beaten(armed: bool = False) -> HeartbeatHistory:
    return first_heartbeat(Heartbeat(0, 2, 3, 0x81 if armed else 1, 3, 3), NOW)


def heard(stop: Stop, *messages: tuple[float, SysStatus], profile: Autopilot = ARDUPILOT, armed: bool = False) -> Stop:
    for seconds, status in messages:
        checked = includes_stop(profile, Family.COPTER, Firmware(4, 5), False)
        stop = heard_sys_status(stop, status, beaten(armed), profile, checked, NOW.mono + seconds)
    return stop


def test_two_ready_messages_well_after_the_disarm_show_that_nothing_is_stopped() -> None:
    assert heard(NOTHING, (2.0, READY)).ready < READY_MESSAGES
    assert heard(NOTHING, (2.0, READY), (2.5, READY)).ready == READY_MESSAGES


def test_messages_just_after_the_disarm_do_not_count() -> None:
    assert heard(NOTHING, (0.5, READY), (1.9, READY), (2.0, READY)).ready == 1


@pytest.mark.parametrize(
    "between", [NOT_READY, READY._replace(onboard_control_sensors_enabled=ALL & ~MOTORS)], ids=["not ready", "switch"]
)
def test_a_failed_check_or_an_active_safety_switch_restarts_the_count(between: SysStatus) -> None:
    assert heard(NOTHING, (3, READY), (4, between), (5, READY)).ready == 1


def test_messages_of_an_armed_vehicle_or_of_another_autopilot_do_not_count() -> None:
    assert heard(NOTHING, (3, READY), (4, READY), armed=True).ready == 0
    assert heard(NOTHING, (3, READY), (4, READY), profile=PX4).ready == 0


def test_passing_checks_end_the_stop_of_a_text() -> None:
    stop = heard(said(NOTHING, True, HIGH, NOW), (3, READY), (4, READY))
    assert still_said(stop, NOW.mono + 4) is TriState.UNKNOWN
    assert stop.ready == READY_MESSAGES


def test_checks_that_have_not_run_since_the_text_do_not_end_it() -> None:
    stop = said(NOTHING, True, HIGH, later(NOW, 10))
    stop = heard(stop, (10.1, READY), (10.6, READY), (11.1, NOT_READY))
    assert still_said(stop, NOW.mono + 12) is TriState.TRUE


def test_a_repeated_text_ends_when_the_repetition_stops() -> None:
    stop = said(NOTHING, True, PREARM_TEXT, NOW)
    assert still_said(stop, NOW.mono + 34.9) is TriState.TRUE
    assert still_said(stop, NOW.mono + 35) is TriState.UNKNOWN
    assert still_said(said(NOTHING, True, HIGH, NOW), NOW.mono + 1000) is TriState.TRUE


def test_the_opposite_text_counts_and_a_repetition_keeps_the_start_time() -> None:
    stop = said(said(NOTHING, True, HIGH, NOW), True, HIGH, later(NOW, 1))
    assert (stop.since, stop.last) == (NOW, NOW.mono + 1)
    stop = said(stop, False, "RC7: MotorEStop LOW", later(NOW, 2))
    assert (stop.said, stop.since) == (TriState.FALSE, later(NOW, 2))


def test_a_switch_used_while_disarmed_is_a_stop_even_if_fast_messages_are_still_healthy() -> None:
    flight = copter().stop("sys_status").stream("sys_status", lambda: flight.sys_status(), hz=4)
    flight.wait(10)
    assert flight.status.e_stopped is TriState.FALSE
    flight.text(HIGH, 6)
    seen = flight.wait(0.9)
    flight.set(health=FITTED)
    seen += flight.wait(10)
    assert {status.e_stopped for status in seen} == {TriState.TRUE}
    flight.set(health=ALL)
    flight.wait(1)
    assert flight.status.e_stopped is TriState.FALSE


def test_evidence_of_a_stop_ends_with_the_next_arming() -> None:
    flight = copter()
    flight.text(PREARM_TEXT, 2).hb(armed=True)
    assert flight.status.e_stopped is TriState.UNKNOWN
    flight.text("RC7: MotorEStop LOW", 6).hb(armed=False)
    flight.set(health=FITTED).wait(1)
    flight.hb(armed=True)
    assert flight.status.e_stopped is TriState.UNKNOWN


def test_a_stop_between_arming_and_the_armed_heartbeat_is_kept() -> None:
    flight = copter()
    flight.wait(10)
    flight.wait(0.5)
    flight.text(HIGH, 6).hb(armed=True)
    assert flight.status.e_stopped is TriState.TRUE


def test_the_newer_words_for_a_kill_are_a_doubt_until_the_state_shows_it() -> None:
    flight = px4().hb(armed=True, state=ACTIVE).text("Kill engaged\t", 0)
    assert (flight.status.e_stopped, flight.status.drives_powered) == (TriState.UNKNOWN, TriState.UNKNOWN)
    flight.hb(state=TERMINATED)
    assert flight.status.e_stopped is TriState.TRUE
    status = flight.text("Kill disengaged\t", 6).hb(state=ACTIVE).status
    assert status.e_stopped is TriState.FALSE


KILL, RELEASED = "Manual kill-switch engaged", "Manual kill-switch disengaged"


def test_a_kill_text_of_an_old_px4_is_a_stop_until_its_release_text_or_arming() -> None:
    flight = px4().hb(armed=True, state=ACTIVE).text(KILL, 0)
    flight.wait(60)
    assert (flight.status.e_stopped, flight.status.drives_powered) == (TriState.TRUE, TriState.FALSE)
    assert flight.text(RELEASED, 0).status.e_stopped is TriState.FALSE
    flight.text(KILL, 0).hb(armed=False, state=STANDBY).wait(2)
    assert flight.status.e_stopped is TriState.TRUE
    assert flight.hb(armed=True, state=ACTIVE).status.e_stopped is TriState.FALSE


def test_a_copter_that_lands_under_power_in_termination_is_not_stopped() -> None:
    flight = copter().hb(armed=True, state=ACTIVE)
    flight.wait(5)
    flight.text("Terminating due to fence breach", 2).wait(1)
    assert flight.status.e_stopped is TriState.TRUE
    *_, landing = flight.hb(mode=LAND).wait(2)
    assert landing.e_stopped is TriState.UNKNOWN
    assert landing.drives_powered is landing.motion_possible is TriState.TRUE
    assert landing.error_code == 1002
    *_, landing = flight.text("Terminating due to fence breach", 2).wait(1)
    assert landing.drives_powered is TriState.TRUE
    flight.hb(armed=False, state=STANDBY).wait(10)
    assert flight.status.e_stopped is TriState.TRUE


@pytest.mark.parametrize("armed", [True, False])
def test_a_px4_that_does_not_show_its_kill_is_not_reported_released_without_evidence(armed: bool) -> None:
    flight = px4().hb(armed=armed, state=ACTIVE if armed else STANDBY)
    assert flight.status.e_stopped is TriState.FALSE
    assert flight.send(version_of(1, 11, 3)).status.e_stopped is TriState.UNKNOWN
    why = flight.vehicle.handle.evidence["e_stopped"]
    assert (why.rule, why.source) == ("PX4 before 1.12 shows a kill only in texts", "AUTOPILOT_VERSION 1.11.3")
    assert flight.status.motion_possible is (TriState.TRUE if armed else TriState.FALSE)
    assert flight.text(KILL, 0).status.e_stopped is TriState.TRUE
    assert flight.text(RELEASED, 0).status.e_stopped is TriState.FALSE
    assert flight.hb(state=TERMINATED).status.e_stopped is TriState.TRUE


@pytest.mark.parametrize(("told", "expected"), [(True, TriState.FALSE), (False, TriState.UNKNOWN)])
def test_an_old_px4_released_at_arming_stays_released_if_every_stop_is_reported(told: bool, expected: TriState) -> None:
    flight = px4(options=HardwareOptions(estop_assume_visible=True)).hb(state=STANDBY)
    flight.send(version_of(1, 11, 3))
    if told:
        flight.text(KILL, 0).text(RELEASED, 0)
    assert flight.hb(armed=True, state=ACTIVE).status.e_stopped is expected
    assert flight.text(KILL, 0).status.e_stopped is TriState.TRUE


@pytest.mark.parametrize("message", [(1, 12, 0), (1, 17, 0), (2, 0, 0), (0, 0, 0)])
def test_a_px4_of_a_version_that_shows_its_kill_or_of_unknown_version_is_trusted(
    message: tuple[int, int, int],
) -> None:
    flight = px4().hb(armed=True, state=ACTIVE).send(version_of(*message))
    assert flight.status.e_stopped is TriState.FALSE


def test_a_px4_that_shows_its_stops_is_trusted() -> None:
    flight = px4().hb(armed=True, state=ACTIVE)
    flight.wait(1)
    flight.text(KILL, 0).hb(state=TERMINATED).wait(5)
    assert flight.status.e_stopped is TriState.TRUE
    assert [(error.code, error.text) for error in flight.detail.errors] == [(1001, KILL)]
    assert flight.hb(state=ACTIVE).status.e_stopped is TriState.FALSE  # the release text was lost


@pytest.mark.parametrize(
    ("text", "pulse", "expected"),
    [
        ("RC7: MotorEStop HIGH", 1000, TriState.UNKNOWN),  # the text of the release was lost
        ("RC7: MotorEStop HIGH", 1900, TriState.TRUE),
        ("RC7: MotorEStop HIGH", 0, TriState.TRUE),  # no pulse
    ],
)
def test_a_stop_by_a_switch_is_in_doubt_when_the_switch_is_in_another_position(
    text: str, pulse: int, expected: TriState
) -> None:
    flight = copter().send(ParamValue(31.0, 0, 0, b"RC7_OPTION", 2)).hb(armed=True, state=ACTIVE)
    flight.stream("channels", lambda: RcChannels(*[1900] * 18), hz=4).wait(3)
    assert flight.text(text, 6).status.e_stopped is TriState.TRUE
    flight.stream("channels", lambda: RcChannels(*[pulse] * 18), hz=4)
    assert {status.e_stopped for status in flight.wait(1.4)} == {TriState.TRUE}
    flight.wait(2)
    assert flight.status.e_stopped is expected
    assert ("STOP_UNCERTAIN" in flight.inhibits) is (expected is TriState.UNKNOWN)


@pytest.mark.parametrize("text", ["Arm: Motors Emergency Stopped", "PreArm: Motors Emergency Stopped"])
def test_a_refusal_that_arrives_while_armed_is_only_a_doubt(text: str) -> None:
    """The text waited in the autopilot's queue. The stop was released, and the vehicle armed, meanwhile."""
    flight = copter()
    flight.wait(3)
    flight.hb(armed=True, state=ACTIVE).text(text, 2)
    seen = {status.e_stopped for status in flight.wait(60)}
    assert TriState.TRUE not in seen
    assert "STOP_UNCERTAIN" in flight.inhibits


@pytest.mark.parametrize(("option", "expected"), [(165.0, TriState.UNKNOWN), (153.0, TriState.FALSE)])
def test_checks_that_ignore_a_parked_stop_switch_do_not_show_a_released_stop(option: float, expected: TriState) -> None:
    flight = copter(options=HardwareOptions(estop_assume_visible=True))
    flight.stream("system_time", flight.system_time)
    flight.send(ParamValue(option, 0, 0, b"RC8_OPTION", 4)).wait(15)
    assert flight.status.e_stopped is expected
    flight.reboot().wait(15)
    assert flight.vehicle.boots == 1
    assert flight.status.e_stopped is expected
    assert flight.hb(armed=True, state=ACTIVE).status.e_stopped is expected
