"""The columns of the terminal say what the one table of values says."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.interface import STATES, Field, Kind, LinkState, RobotMode, TriState
from mav_robot_status.language import LOOKS, TONES, headline
from mav_robot_status.publishers.board import Board
from mav_robot_status.views.terminal.columns import column_of, state
from mav_robot_status.views.terminal.text import Signs

from .fleet import PARKED, put, robots


def values_of(field: Field) -> list[Any]:
    return list(RobotMode if field.kind is Kind.MODE else TriState)


@pytest.mark.parametrize("utf8", [True, False])
@pytest.mark.parametrize("field", STATES, ids=lambda field: field.name)
def test_every_value_has_the_symbol_the_word_and_the_tone_of_the_table(field: Field, utf8: bool) -> None:
    board = Board()
    for system, value in enumerate(values_of(field), 1):
        put(board, PARKED._replace(**{field.name: value}), system=system)
    shown = robots(board)
    assert len(shown) == len(LOOKS[field.name])
    for robot in shown:
        look = LOOKS[field.name][robot.line[field.name]]
        span = column_of(field.name).cell(robot, Signs(utf8))
        symbol = look.glyph if utf8 else look.ascii
        assert span.text in (f"{symbol} {look.word}", f"{symbol} {look.short}")
        assert span.style == TONES[look.tone].terminal


@pytest.mark.parametrize("link", LinkState)
def test_the_state_of_a_robot_is_its_headline(link: LinkState) -> None:
    board = Board()
    put(board, PARKED, link=link)
    (robot,) = robots(board)
    top = headline(robot.line)
    assert state(robot, Signs()) == (f"{top.state.glyph} {top.word}", TONES[top.tone].terminal)
    assert (top.word == "LOST") is (link is LinkState.LOST)
