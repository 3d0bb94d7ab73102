"""Tests of the remedies: every cause has one, and none of them is dangerous."""

from __future__ import annotations

import re
import time

import pytest

from mav_robot_status.hardware.group import NOT_POSSIBLE
from mav_robot_status.hardware.mavlink.faults.causes import CAUSES
from mav_robot_status.hardware.mavlink.px4_events.ids import HEALTH_COMPONENTS
from mav_robot_status.hardware.mavlink.readiness.rule import INHIBITS
from mav_robot_status.hardware.simple_message.status import status_of, values_of
from mav_robot_status.hardware.ur.status import NOT_RUNNING, STOPS
from mav_robot_status.interface import Detail
from mav_robot_status.language import remedy
from mav_robot_status.language.remedies import REMEDIES, WHILE_ARMED, Remedy
from mav_robot_status.language.texts import TEXTS, TextRemedy, step_for
from mav_robot_status.mavlink.definitions import SENSOR_NAMES
from mav_robot_status.simple_message import StatusFrame

ROWS: tuple[Remedy | TextRemedy, ...] = (*REMEDIES.values(), *TEXTS)
UNNAMED = re.compile(r"SENSOR_\d+$")
"""A bit of the extended word of SYS_STATUS that has no name yet."""


@pytest.mark.parametrize("name", [*INHIBITS, NOT_POSSIBLE])
def test_every_inhibit_of_a_vehicle_and_of_a_group_has_a_row(name: str) -> None:
    assert name in REMEDIES


@pytest.mark.parametrize("cause", CAUSES.values(), ids=lambda cause: cause.name)
def test_every_cause_of_an_error_has_a_row(cause: object) -> None:
    name = str(getattr(cause, "name", ""))
    assert UNNAMED.match(name) or name in REMEDIES


def test_every_name_of_an_arm_has_a_row() -> None:
    names = {stop.name for stop in STOPS} | {name for name, _ in NOT_RUNNING.values()} | {"NOT_RUNNING"}
    for frame in (StatusFrame(1, 1, 7, 1, 0, 0, 0), StatusFrame(0, 0, 0, 0, 0, 0, 0)):
        assert status_of(frame)
        detail = values_of(frame, Detail(), 0, 0.0).detail
        names |= {one.name for one in detail.errors} | {one.name for one in detail.inhibits}
    assert "CONTROLLER_ERROR" in names
    assert names <= set(REMEDIES)


def test_a_sentence_ends_the_words_cannot_move() -> None:
    for name, row in REMEDIES.items():
        assert row.sentence[0].islower(), name
        assert not row.sentence.endswith("."), name


def test_a_step_is_whole_sentences_and_has_a_topic() -> None:
    for row in ROWS:
        assert row.step, row
        assert row.topic, row
        assert row.step[0].isupper()
        assert row.step.endswith(".")


def test_no_step_turns_a_check_off_or_says_that_something_is_safe() -> None:
    forbidden = r"disable|turn off|switch off|skip|ignore|ARMING_|COM_|CBRK|\bsafe\b|safely|no danger|force"
    for row in ROWS:
        assert not re.search(forbidden, row.step, re.I), row.step


def test_no_step_for_an_error_restarts_or_disarms_what_may_be_moving() -> None:
    """An error is listed while the vehicle flies."""
    errors = [cause.name for cause in CAUSES.values() if cause.name in REMEDIES]
    steps = [REMEDIES[name].step for name in errors if name != "CONFIGURATION"]
    steps += [remedy({"name": name, "text": "Main loop slow (300Hz < 400Hz)"}).step for name in WHILE_ARMED]
    for step in steps:
        first = re.search(r"Restart|[Dd]isarm", step)
        assert not first or "Land it or bring it to rest." in step[: first.start()], step


def test_what_passes_by_itself_or_is_wanted_needs_nobody() -> None:
    for name in ("DISARMED", "MODE_MANUAL", "INITIALISING", "BRAKES_ENGAGED", "BACKDRIVE"):
        assert not remedy({"name": name}).person, name
    for name in ("E_STOPPED", "SAFETY_SWITCH", "PREARM_FAILING", "LINK_STALE", "PROTECTIVE_STOP", "OF_ANOTHER"):
        assert remedy({"name": name}).person, name


@pytest.mark.parametrize("prefix", ["", "PreArm: ", "Arm: ", "Preflight Fail: "])
@pytest.mark.parametrize(
    ("text", "topic"),
    [
        ("GPS 1: Bad fix", "gps"),
        ("EKF compass variance", "compass"),
        ("Accels inconsistent", "sensors"),
        ("Battery 1 low voltage failsafe", "battery"),
        ("Need Position Estimate", "position"),
        ("Hardware safety switch", "safety-switch"),
        ("Motors Emergency Stopped", "emergency-stop"),
        ("Throttle (RC3) is not neutral", "radio"),
        ("Missing mission item: RTL", "mission"),
        ("FENCE_MARGIN too big", "surroundings"),
        ("Motors: Check MOT_PWM_MIN and MOT_PWM_MAX", "motors"),
        ("Scripting: a.lua failed to start", "configuration"),
        ("Rangefinder 1: Not Connected", "sensors"),
        ("Logging not started", "logging"),
        ("Param storage failed", "autopilot"),
        ("Board (4.1v) out of range 4.3-5.8v", "battery"),
        ("Interlock/E-Stop Conflict", "configuration"),
    ],
)
def test_the_words_of_an_autopilot_decide_the_step(prefix: str, text: str, topic: str) -> None:
    found = remedy({"name": "PREARM_FAILING", "text": prefix + text})
    assert (found.sentence, found.topic) == ("it cannot be armed", topic)
    assert found.step != REMEDIES["PREARM_FAILING"].step


@pytest.mark.parametrize("component", HEALTH_COMPONENTS)
def test_every_component_that_a_px4_names_without_its_table_has_a_step(component: str) -> None:
    assert step_for(f"{component} (11 modes)")


@pytest.mark.parametrize("bit", [name for name in SENSOR_NAMES.values() if name != "EXTENSION_USED"])
def test_a_bit_of_sys_status_that_keeps_it_from_arming_has_a_step(bit: str) -> None:
    assert step_for(f"SYS_STATUS: {bit}")


def test_a_named_cause_keeps_its_step_whatever_the_autopilot_says() -> None:
    for name, text in (("RC_LOST", "Throttle failsafe on"), ("BATTERY_CRITICAL", "GPS Glitch")):
        assert remedy({"name": name, "text": text}) == REMEDIES[name]


def test_words_that_no_row_knows_are_to_be_cleared() -> None:
    assert remedy({"name": "PREARM_FAILING", "text": "zzz"}).step == "Clear what the autopilot names."


def test_a_name_without_a_row_is_spoken() -> None:
    assert remedy({"name": "GRIPPER_JAMMED"}).sentence == "gripper jammed"
    assert remedy({"name": "SENSOR_9"}).topic == "sensors"


@pytest.mark.parametrize("piece", ["gps ", "mode ", "compass", "(1 mode", "a\n", "<"])
def test_a_long_text_of_a_peer_takes_no_time(piece: str) -> None:
    before = time.process_time()
    for _ in range(20):
        remedy({"name": "PREARM_FAILING", "text": piece * 20_000})
    assert time.process_time() - before < 2


@pytest.mark.parametrize("text", [None, "", 3, ["x"], {}])
def test_any_value_of_a_line_has_a_remedy(text: object) -> None:
    assert remedy({"name": "PREARM_FAILING", "text": text}).step
    assert remedy({"name": text, "text": text})
    assert remedy({})
