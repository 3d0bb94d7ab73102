"""The meaning of ArduPilot's records, one story each."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.hardware.onboard_log import ardupilot, px4
from mav_robot_status.interface import RobotMode, TriState
from tests.docs.documents import table
from tests.onboard_logs import dataflash, formats

from .logs import at

TRUE, FALSE, UNKNOWN = TriState.TRUE, TriState.FALSE, TriState.UNKNOWN
ROVER = "ArduRover V4.5.6 (3cba3e7f)"
COPTER = "ArduCopter V4.5.6 (3cba3e7f)"


def log(*records: tuple[Any, ...], banner: str = ROVER, until: float = 20.0, start: float = 1.0) -> bytes:
    """A log that begins at boot and goes on every half second."""
    life = [(start + n / 2, "POWR", 2) for n in range(int((until - start) * 2))]
    first = [(start, "MSG", banner), (start, "PARM", "LOG_DISARMED", 1.0, 0.0)]
    return dataflash(*sorted([*first, *life, *records], key=lambda one: one[0]))


def test_a_log_that_begins_at_boot_begins_disarmed_and_not_stopped() -> None:
    (said,) = at(log(), 5)
    assert (said.status.drives_powered, said.status.e_stopped) == (FALSE, FALSE)
    assert said.inhibits == {"DISARMED"}
    assert (said.detail.vehicle.type, said.detail.vehicle.firmware) == ("GROUND_ROVER", "4.5.6")


def test_a_log_that_begins_later_knows_neither() -> None:
    (said,) = at(log(start=100.0, until=110.0), 105)
    assert (said.status.drives_powered, said.status.e_stopped) == (UNKNOWN, UNKNOWN)
    assert said.inhibits == {"LOG_GAP"}


def test_an_old_firmware_is_not_stopped_after_an_arming_with_checks_only() -> None:
    before, after = at(log((5, "ARM", 1, 1, 0, 1), banner="ArduRover V4.4.0"), 4, 6)
    assert (before.status.e_stopped, after.status.e_stopped) == (UNKNOWN, FALSE)


def test_armed_and_disarmed_by_whom() -> None:
    data = log(
        (5, "ARM", 1, 1, 0, 1), (5, "MAVC", 255, 190, 400, 1.0, 0), (8, "ARM", 0, 0, 1, 1), (11, "ARM", 1, 1, 0, 2),
        (13, "ARM", 0, 0, 0, 12),
    )  # fmt: skip
    assert [said.why["armed"] for said in at(data, 6, 9, 12, 14)] == [
        "armed by ground station 255 [ARM.Method 1]",
        "disarmed by a MAVLink command, forced [ARM.Method 1]",
        "armed by a switch of the radio [ARM.Method 2]",
        "disarmed by the crash check [ARM.Method 12]",
    ]


def test_the_stop_names_who_and_how_fast_it_was() -> None:
    speed = [(3 + n / 5, "GPS", 0, 6, 0, 2446, 4.0, 0.0) for n in range(40)]
    options = ((1, "PARM", "RC7_OPTION", 31.0, 0.0), (2, "ARM", 1, 1, 0, 1))
    data = log(*options, *speed, (6, "EV", 54), (6, "AUXF", 31, 2, 1), (9, "EV", 55))
    before, stopped, released = at(data, 5.9, 6.5, 9.5)
    assert (before.status.e_stopped, before.status.motion_possible) == (FALSE, TRUE)
    assert (stopped.status.e_stopped, stopped.status.drives_powered) == (TRUE, FALSE)
    assert stopped.why["e_stopped"] == (
        "emergency stop by a switch of the radio (RC7) while it moved at 4.0 m/s [EV 54]"
    )
    assert stopped.inhibits == {"E_STOPPED"}
    assert released.status.motion_possible is TRUE


def test_before_4_1_events_say_whether_it_is_armed() -> None:
    names = ("EV", "MSG", "PARM", "POWR")
    records = [(1, "MSG", "ArduCopter V3.6.12"), (3, "EV", 10), (3.5, "EV", 15), (5, "EV", 11)]
    records += [(1 + n / 2, "POWR", 2) for n in range(10)]
    armed, disarmed = at(dataflash(*sorted(records, key=lambda one: one[0]), names=names), 4, 5.2)
    assert (armed.status.drives_powered, disarmed.status.drives_powered) == (TRUE, FALSE)


def test_the_safety_switch_holds_the_outputs() -> None:
    data = log((2, "ARM", 1, 1, 0, 1), (4.2, "STAT", 0, 0, 1, 0), until=4.0)
    (said,) = at(data, 4.5)
    assert (said.status.drives_powered, said.status.motion_possible) == (FALSE, FALSE)
    assert said.inhibits == {"SAFETY_SWITCH"}


def test_a_plane_whose_arming_is_not_in_the_log_is_armed_by_its_status() -> None:
    status = [(3 + n / 5, "STAT", 0, 1, 2, 0) for n in range(20)]
    assert at(log(*status, banner="ArduPlane V4.5.6"), 6)[0].status.drives_powered is TRUE


def test_an_arming_with_checks_ends_a_stop_whose_release_is_not_in_the_log() -> None:
    before, after = at(log((3, "EV", 54), (6, "ARM", 1, 1, 0, 1)), 5, 7)
    assert (before.status.e_stopped, after.status.e_stopped) == (TRUE, FALSE)


def test_a_log_without_records_of_arming_does_not_begin_disarmed() -> None:
    records = [(1.0, "MSG", ROVER), (1.0, "PARM", "LOG_DISARMED", 1.0, 0.0)]
    records += [(1 + n / 2, "POWR", 2) for n in range(10)]
    assert at(dataflash(*records, names=("MSG", "PARM", "POWR")), 4)[0].status.drives_powered is UNKNOWN


def test_modes_with_their_reason() -> None:
    (said,) = at(log((4, "MODE", 11, 11, 3)), 5)
    assert (said.status.mode, said.detail.vehicle.flight_mode) == (RobotMode.AUTO, "RTL")
    assert said.why["mode"] == "mode RTL, by the radio failsafe [MODE.Rsn 3]"


def test_a_mode_can_be_overridden() -> None:
    options = HardwareOptions(mode_overrides={"rover": {11: RobotMode.MANUAL}})
    (said,) = at(log((4, "MODE", 11, 11, 3)), 5, options=options)
    assert said.status.mode is RobotMode.MANUAL


def test_errors_begin_and_end_with_their_codes() -> None:
    data = log((3, "ERR", 5, 1), (5, "ERR", 5, 0), (6, "ERR", 3, 2), (7, "ERR", 12, 1), (8, "ERR", 12, 0))
    assert [said.errors for said in at(data, 4, 5.5, 6.5, 9)] == [[2001], [], [], [4001]]


def test_a_crash_ends_with_the_next_arming() -> None:
    data = log((3, "MSG", "Crash: Going to HOLD"), (9, "ARM", 1, 1, 0, 1))
    before, after = at(data, 5, 10)
    assert before.detail.errors[0].text == "Crash: Going to HOLD"
    assert after.status.in_error is FALSE


def test_reasons_against_arming_hold_35_s_and_a_refusal_10_s() -> None:
    data = log((3, "MSG", "PreArm: Compass not healthy"), (4, "MSG", "Arm: Throttle too high"), until=60)
    texts = [[one.text for one in said.detail.inhibits if one.text] for said in at(data, 5, 20, 40)]
    assert texts == [["PreArm: Compass not healthy", "Arm: Throttle too high"], ["PreArm: Compass not healthy"], []]


def test_a_compass_that_is_healthy_again_is_no_reason_any_more() -> None:
    (said,) = at(log((3, "MSG", "PreArm: Compass not healthy"), (5, "ERR", 3, 0)), 6)
    assert said.inhibits == {"DISARMED"}


def test_a_motor_that_is_driven_while_disarmed_has_power() -> None:
    outputs = [(1 + n / 10, "RCOU", 1000, 0, 1500 if n < 30 or n > 60 else 1650, 0) for n in range(90)]
    data = log((1, "PARM", "SERVO3_FUNCTION", 70.0, 0.0), *outputs)
    assert [said.status.drives_powered for said in at(data, 3, 6, 9)] == [FALSE, TRUE, FALSE]
    assert at(data, 6)[0].inhibits == set()


def test_an_armed_robot_that_is_driven_in_spite_of_a_stop_is_not_called_stopped() -> None:
    outputs = [(1 + n / 10, "RCOU", 0, 0, 1500 if n < 5 else 1800, 0) for n in range(90)]
    data = log((1, "PARM", "SERVO3_FUNCTION", 70.0, 0.0), (2, "ARM", 1, 1, 0, 1), (4, "EV", 54), *outputs)
    at_once, later = at(data, 4.2, 6)
    assert (at_once.status.e_stopped, later.status.e_stopped) == (TRUE, UNKNOWN)
    assert (at_once.status.drives_powered, later.status.drives_powered) == (FALSE, TRUE)


def test_a_motor_test_of_a_copter_lasts_from_text_to_text() -> None:
    data = log((3, "MSG", "starting motor test"), (8, "MSG", "finished motor test"), banner=COPTER)
    assert [said.status.drives_powered for said in at(data, 2, 5, 9)] == [FALSE, TRUE, FALSE]


def test_a_copter_in_the_air_moves_and_one_that_is_armed_without_speed_may_move() -> None:
    data = log((3, "ARM", 1, 1, 0, 1), (5, "EV", 28), (9, "EV", 18), banner=COPTER)
    assert [said.status.in_motion for said in at(data, 4, 6, 10)] == [UNKNOWN, TRUE, UNKNOWN]
    assert at(data, 6)[0].why["in_motion"].startswith("airborne")


def test_the_estimate_comes_before_the_gps_and_only_while_there_is_one() -> None:
    gps = [(2 + n / 5, "GPS", 0, 6, 0, 2446, 5.0, 0.0) for n in range(50)]
    estimate = [(2 + n / 5, "XKF1", 0, 0.0, 0.0, 0.0) for n in range(50)]
    status = [(2, "XKF4", 0, 831), (7, "XKF4", 0, 1)]
    still, moves = at(log(*gps, *estimate, *status), 6, 9)
    assert (still.status.in_motion, moves.status.in_motion) == (FALSE, TRUE)


def test_a_gap_makes_all_unknown_and_afterwards_nothing_counts_as_safe() -> None:
    data = log((3, "EV", 54), until=5.0) + log(start=9.0, until=12.0)[len(formats()) :]
    before, inside, after = at(data, 4, 7, 10)
    assert before.status.e_stopped is TRUE
    assert (inside.inhibits, inside.status.e_stopped, inside.status.mode) == ({"LOG_GAP"}, UNKNOWN, RobotMode.UNKNOWN)
    assert (after.status.e_stopped, after.status.drives_powered) == (UNKNOWN, UNKNOWN)


def test_what_is_armed_stays_armed_through_a_gap() -> None:
    data = log((3, "ARM", 1, 1, 0, 1), until=5.0) + log(start=9.0, until=12.0)[len(formats()) :]
    assert at(data, 10)[0].status.drives_powered is TRUE


@pytest.mark.parametrize(
    ("text", "value"), [("RC7: MotorEStop HIGH", TRUE), ("PreArm: Motors Emergency Stopped", TRUE), ("Hello", UNKNOWN)]
)
def test_without_events_texts_show_the_stop(text: str, value: TriState) -> None:
    assert at(log((4, "MSG", text), banner="ArduRover V4.2.0"), 5)[0].status.e_stopped is value


def test_the_reference_lists_every_record_that_is_read() -> None:
    def listed(heading: str, first: str) -> set[str]:
        rows = table("docs/reference/onboard-logs.md", first, heading)
        return {name.strip() for row in rows for name in row[0].replace("`", "").split(",")}

    assert listed("## ArduPilot", "record") == set(ardupilot.MEANINGS)
    assert listed("## PX4", "topic") == set(px4.MEANINGS)
