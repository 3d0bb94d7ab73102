from __future__ import annotations

import pytest

from mav_robot_status.hardware.ur.dashboard import MOST_LINE, QUESTION, Dashboard


def heard(*pieces: bytes) -> Dashboard:
    dashboard = Dashboard()
    for piece in pieces:
        dashboard.feed(piece, 10.0)
    return dashboard


def test_it_asks_once_a_second() -> None:
    dashboard = Dashboard()
    asked = [dashboard.ask(at / 10) for at in range(25)]
    assert [bool(question) for question in asked].count(True) == 3
    assert asked[0] == QUESTION == b"get operational mode\n"


@pytest.mark.parametrize("word", ["MANUAL", "AUTOMATIC"])
def test_an_answer_counts_for_three_seconds(word: str) -> None:
    dashboard = heard(b"Connected: Universal Robots Dashboard Server\n", word.encode() + b"\n")
    assert dashboard.mode(13.0) == word
    assert dashboard.mode(13.1) is None


@pytest.mark.parametrize(
    "line", [b"NONE\n", b"could not understand: 'get operational mode'\n", b"\xff\xfe\n", b"MANUAL"]
)
def test_everything_else_is_no_mode(line: bytes) -> None:
    assert heard(line).mode(10.0) is None


def test_none_ends_a_mode() -> None:
    assert heard(b"MANUAL\nNONE\n").mode(10.0) is None


def test_a_line_may_come_in_pieces() -> None:
    assert heard(b"AUTO", b"MATIC\r\n").mode(10.0) == "AUTOMATIC"


def test_a_line_without_an_end_does_not_grow() -> None:
    dashboard = heard(*[b"x" * 5000] * 20)
    assert len(dashboard._rest) <= MOST_LINE
    dashboard.feed(b"\nMANUAL\n", 11.0)
    assert dashboard.mode(11.0) == "MANUAL"
