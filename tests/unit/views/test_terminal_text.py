from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.language import look
from mav_robot_status.views.terminal.text import Signs, Span, cells, clean, clock, duration, fill, wrap

from .fleet import texts


def test_a_long_text_is_cut_and_marked() -> None:
    assert fill("PREARM_FAILING", 6) == "PREAR…"
    assert fill("CRASH", 5) == "CRASH"
    assert fill("漢字漢字", 6) == "漢字… "
    assert fill("漢字", 5) == "漢字 "


@pytest.mark.parametrize(
    ("text", "seen"),
    [
        ("Radio Failsafe", "Radio Failsafe"),
        ("\x1b[2Jgone\r\n\x07", r"\u001b[2Jgone\u000d\u000a\u0007"),
        ("e\u0301te\u0301", "été"),  # NFD, as some file systems write it
        ("a\u200d\u202eb", r"a\u200d\u202eb"),  # a joiner, and a right-to-left override
    ],
)
def test_control_characters_of_a_peer_are_shown_by_their_codes(text: str, seen: str) -> None:
    assert clean(text) == seen


def test_a_terminal_without_utf8_gets_as_many_cells() -> None:
    assert Signs(utf8=False).text("漢字 “ok”") == '???? "ok"'
    assert Signs(utf8=False).of(look("e_stopped", True)).text == "# STOPPED"


def test_a_value_has_its_short_word_where_there_is_no_room() -> None:
    assert Signs().of(look("mode", "MANUAL")).text == "☺ MANUAL"
    assert Signs().of(look("mode", "MANUAL"), 7).text == "☺ MAN"


def test_lines_are_broken_at_spaces_and_keep_their_styles() -> None:
    lines = list(wrap((Span("armed, not ", "bold"), Span("stopped, in a state")), 14))
    assert texts(lines) == ["armed, not", "  stopped, in", "  a state"]
    assert lines[0][0].style == "bold"


def test_a_time_of_day_and_what_is_none() -> None:
    assert len(clock("2027-01-15T08:00:00.000Z")) == 8
    assert clock("soon") == "soon"


def test_a_duration_has_at_most_four_characters() -> None:
    assert [duration(s) for s in (5, 99, 100, 5999, 6000, 172_800)] == ["5s", "99s", "1m", "99m", "1h", "2d"]


@settings(deadline=None)
@given(st.text(), st.integers(1, 40))
def test_any_text_fills_exactly_the_given_cells(text: str, width: int) -> None:
    known = clean(text)
    assert cells(fill(known, width)) == width
    assert len(Signs(utf8=False).text(text)) == cells(known)
    if width > 4:
        assert all(cells(line) <= width for line in texts(wrap((Span(known), Span("x", "bold")), width)))
