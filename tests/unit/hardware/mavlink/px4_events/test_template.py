"""Templates of messages: arguments, units, markup, and any other text."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.hardware.mavlink.px4_events.template import MOST_TEXT, compiled, filled


@pytest.mark.parametrize(
    ("source", "values", "text"),
    [
        ("No arguments", (), "No arguments"),
        ("Compass {1} uncalibrated", (2,), "Compass 2 uncalibrated"),
        ("{2} before {1}", (1, 2), "2 before 1"),
        ("Wind {1:.1m/s}", (12.345,), "Wind 12.3 m/s"),
        ("Up {1m_v}, wide {1m}, hot {1:C}", (3.5,), "Up 3.5 m, wide 3.5 m, hot 3.5 °C"),
        ("Limit {1:.0}", (2.6,), "Limit 3"),
        ("Exactly {1:.1}", (5,), "Exactly 5"),
        ("Not known: {1:.1m}", (None,), "Not known: ?"),
        ("Not a number: {1:.1}", (math.nan,), "Not a number: nan"),
        ("Cause {1:.1m}", ("Sticks lost",), "Cause Sticks lost"),
        ("There is no {3}", (1, 2), "There is no {3}"),
        ("Escaped \\{1} \\< 5", (1,), "Escaped {1} < 5"),
        ("Set <param>COM_X</param>.", (), "Set COM_X."),
        ("See <a>https://px4.io</a>.", (), "See https://px4.io."),
        ('See <a href="https://px4.io">the page</a>.', (), "See the page (https://px4.io)."),
        ('For <profile name="dev">{1} engineers</profile> only', (2,), "For 2 engineers only"),
        ('Not for <profile name="!dev">engineers</profile>', (), "Not for"),
        ("Hidden <blink>words</blink>.", (), "Hidden ."),
        ("Not closed <param>X", (), "Not closed <param>X"),
        ("One\nline\t\x1b[31m", (), "One line [31m"),
    ],
)
def test_a_template_is_filled(source: str, values: tuple[int | float | str | None, ...], text: str) -> None:
    assert filled(compiled(source, len(values)), values) == text


def test_a_long_text_is_cut() -> None:
    assert filled(compiled("x" * 5000, 0), ()) == "x" * (MOST_TEXT - 3) + "..."


@given(st.text(st.sampled_from('{}<>:.1m/sC\\"= apframnoile'), max_size=300), st.floats())
def test_any_text_is_a_template(source: str, value: float) -> None:
    text = filled(compiled(source, 1), (value,))
    assert len(text) <= MOST_TEXT
    assert text.isprintable()
