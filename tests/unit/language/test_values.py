"""Tests of the table of looks."""

from __future__ import annotations

from typing import get_args

import pytest

from mav_robot_status.interface import STATES, Kind, LinkState, RobotMode
from mav_robot_status.language import LINK, LOOKS, TONES, Tone, look
from mav_robot_status.language.values import UNKNOWN

BACKGROUND = {"light": "#ffffff", "dark": "#14181d"}


def luminance(colour: str) -> float:
    """The relative luminance of WCAG 2."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def test_every_value_of_every_field_has_a_look() -> None:
    values = {Kind.MODE: {mode.name for mode in RobotMode}, Kind.TRI_STATE: {True, False, None}}
    for field in STATES:
        assert set(LOOKS[field.name]) == values[field.kind], field.name
    assert set(LOOKS[LINK]) == {state.value for state in LinkState}


@pytest.mark.parametrize("part", ["word", "shape", "glyph", "ascii", "bar"])
def test_no_two_values_of_a_field_look_the_same(part: str) -> None:
    for name, looks in LOOKS.items():
        found = [getattr(one, part) for one in looks.values()]
        assert len(set(found)) == len(found), (name, found)


def test_a_glyph_is_one_cell_and_a_short_word_five_letters_at_most() -> None:
    for one in (one for looks in LOOKS.values() for one in looks.values()):
        assert len(one.glyph) == len(one.ascii) == 1
        assert one.ascii.isascii()
        assert len(one.short or one.word) <= 8
        assert not one.short or len(one.short) <= 5


def test_every_tone_is_in_the_table_and_has_a_contrast_of_4_5() -> None:
    assert set(TONES) == set(get_args(Tone))
    for tone in TONES.values():
        assert contrast(tone.light, BACKGROUND["light"]) >= 4.5
        assert contrast(tone.dark, BACKGROUND["dark"]) >= 4.5


@pytest.mark.parametrize("value", ["yes", 1, 0, 2.5, [], {}, "LOST"])
def test_a_value_that_the_table_lacks_is_unknown(value: object) -> None:
    assert look("motion_possible", value) is UNKNOWN
