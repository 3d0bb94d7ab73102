"""Tests of the table of states."""

from __future__ import annotations

import re

import pytest

from mav_robot_status.language import ROBOT_STATES, TONES, state_of, troubles
from mav_robot_status.language.shapes import SHAPES, drawing, sprite
from mav_robot_status.language.states import few_words

from .test_headline import LIVE, LOST, STAMP, error, line


@pytest.mark.parametrize("part", ["word", "shape", "glyph", "ascii", "meaning"])
def test_no_two_states_share_a_sign_or_a_word(part: str) -> None:
    found = [getattr(state, part) for state in ROBOT_STATES]
    assert len(set(found)) == len(found)


def test_a_sign_is_one_cell_and_no_tick_and_no_minus() -> None:
    for state in ROBOT_STATES:
        assert len(state.glyph) == len(state.ascii) == 1
        assert state.ascii.isascii()
        assert state.glyph not in "✓✔-–−▬"
        assert state.ascii not in "-_v"
        assert state.tone in TONES


def test_the_worst_comes_first_with_the_severities_of_mavlink() -> None:
    severities = [state.severity for state in ROBOT_STATES]
    assert severities == sorted(severities)
    assert [state.rank for state in ROBOT_STATES] == list(range(len(ROBOT_STATES)))
    assert (severities[0], severities[-1]) == (2, 6)


def test_every_shape_is_drawn_and_no_two_drawings_are_the_same() -> None:
    assert {state.shape for state in ROBOT_STATES} <= set(SHAPES)
    assert len(set(SHAPES.values())) == len(SHAPES)
    assert re.findall(r'<symbol id="(\w+)"', sprite()) == list(SHAPES)
    assert drawing("stop").startswith('<svg class="shape"')


def test_a_stop_that_is_also_a_crash_is_both_the_worst_first() -> None:
    stopped = line(e_stopped=True, **error("CRASH", "Crash: Going to HOLD"))
    assert [(one.state.word, one.why) for one in troubles(stopped)] == [
        ("EMERGENCY STOP", "engaged"),
        ("CRASHED", "Going to HOLD"),
    ]
    assert state_of(stopped).word == "EMERGENCY STOP"


def test_a_live_robot_without_trouble_is_armed_and_never_calm() -> None:
    assert troubles(line(**LIVE)) == []
    assert state_of(line(**LIVE)).tone == "active"
    unsure = line(**{**LIVE, "drives_powered": None, "motion_possible": None})
    assert state_of(unsure).word == "UNKNOWN"
    assert [one.state.word for one in troubles(line(**LOST))] == ["LOST"]


def test_the_cause_in_a_few_words() -> None:
    def said(name: str, text: str | None = None) -> str:
        return few_words({"name": name, "text": text, "since": STAMP}, line(system=1))

    assert said("BATTERY_LOW", "Battery 1 is low 10.2V") == "battery low"
    assert said("RC_LOST") == "RC lost"
    assert said("SENSOR_GPS") == "GPS receiver is not healthy"
    assert said("PREARM_FAILING", "PreArm: GPS 1: Bad fix") == "GPS 1: Bad fix"
    assert said("SYSTEM_ID_CONFLICT") == "two autopilots use system id 1"
