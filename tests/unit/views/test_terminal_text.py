from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.views.terminal.text import ASCII, Span, cells, clean, clip, encode, fill, fill_line, plain, wrap


def test_a_long_text_is_cut_and_marked() -> None:
    assert clip("PREARM_FAILING", 6) == "PREAR…"
    assert clip("PREARM_FAILING", 6, ASCII) == "PREAR~"
    assert clip("CRASH", 5) == "CRASH"
    assert clip("CRASH", 0) == ""


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


def test_wide_characters_take_two_cells() -> None:
    assert cells("漢字") == 4
    assert clip("漢字漢字", 6) == "漢字…"
    assert fill("漢字", 5) == "漢字 "


def test_a_terminal_without_utf8_gets_as_many_cells() -> None:
    assert encode("漢字 ok", ASCII) == b"???? ok"


def test_a_line_of_spans_keeps_their_styles_up_to_its_width() -> None:
    assert fill_line([Span("RC_LOST", "cause"), Span(" CRASH")], 10) == (Span("RC_LOST", "cause"), Span(" C…"))
    assert fill_line([Span("ok", "on")], 4) == (Span("ok", "on"), Span("  "))


def test_blanks_at_the_end_are_cut_without_a_mark() -> None:
    assert plain(fill_line([Span("0s"), Span("   ")], 3)) == "0s "


def test_text_is_broken_at_spaces() -> None:
    assert list(wrap("armed, not stopped, in a state", 12)) == ["armed, not", "stopped, in", "a state"]


def test_a_long_word_is_broken_anywhere() -> None:
    assert list(wrap("a GLOBAL_POSITION_INT", 9)) == ["a", "GLOBAL_PO", "SITION_IN", "T"]


@settings(deadline=None)
@given(st.text(), st.integers(0, 40))
def test_any_text_fills_exactly_the_given_cells(text: str, width: int) -> None:
    known = clean(text)
    assert cells(fill(known, width)) == width
    assert cells(plain(fill_line([Span(known), Span("x", "on")], width))) == width
    assert len(encode(fill(known, width), ASCII)) == width
    if width > 1:
        assert all(cells(line) <= width for line in wrap(known, width))
        assert "".join(wrap(known, width)).replace(" ", "") == known.replace(" ", "")
