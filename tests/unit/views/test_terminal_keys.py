from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.publishers.board import Board
from mav_robot_status.views.terminal.keys import ACTIONS, Keyboard, press
from mav_robot_status.views.terminal.state import State, Ui

from .fleet import FAILED, STOPPED, lose, put, screen


def typed(data: bytes) -> list[str]:
    keyboard = Keyboard()
    return keyboard.feed(data) + keyboard.flush()


def test_keys_have_actions() -> None:
    assert typed(b"jke\x1b[A\x1bOB?q") == ["down", "up", "explain", "up", "down", "help", "end"]


def test_a_key_without_an_action_is_ignored() -> None:
    assert typed(b"xe\x1b[1;5Aj\x1b[999zk\xc3\xa4") == ["explain", "down", "up"]


def test_a_sequence_may_arrive_in_pieces() -> None:
    keyboard = Keyboard()
    assert [keyboard.feed(bytes([byte])) for byte in b"\x1b[6~"] == [[], [], [], ["page down"]]


def test_an_escape_without_further_bytes_is_the_escape_key() -> None:
    keyboard = Keyboard()
    assert keyboard.feed(b"\x1b") == []
    assert keyboard.waiting
    assert keyboard.flush() == ["back"]
    assert keyboard.flush() == []


@settings(deadline=None)
@given(st.binary())
def test_any_input_gives_known_actions_only(data: bytes) -> None:
    assert set(typed(data)) <= set(ACTIONS.values())


def fleet(count: int = 5, chosen: int = 1) -> State:
    board = Board()
    for system in range(1, count + 1):
        put(board, system=system)
    return screen(board, ui=Ui(f"vehicle/{chosen}"))


@pytest.mark.parametrize(
    ("action", "chosen"),
    [("down", 4), ("up", 2), ("first", 1), ("last", 5), ("page down", 5), ("page up", 1), ("redraw", 3)],
)
def test_keys_select_a_vehicle_and_stop_at_the_ends(action: str, chosen: int) -> None:
    assert press(fleet(chosen=3), action, rows=3, page=5).ui.handle == f"vehicle/{chosen}"


def test_n_cycles_through_the_vehicles_with_a_problem() -> None:
    board = Board()
    for system in range(1, 7):
        put(board, system=system)
    put(board, FAILED, system=2)
    put(board, STOPPED, system=4)
    lose(board, 5)
    state = screen(board, ui=Ui("vehicle/1"))
    visited = []
    for _ in range(4):
        state = press(state, "problem", 3, 5)
        visited.append(state.ui.handle)
    assert visited == ["vehicle/2", "vehicle/4", "vehicle/5", "vehicle/2"]
    assert press(fleet(chosen=3), "problem", 3, 5).ui.handle == "vehicle/3"


def test_a_pane_opens_with_its_key_and_closes_with_the_same_key_or_escape() -> None:
    state = press(fleet(), "explain", 3, 5)
    assert state.ui.pane == "explain"
    assert press(state, "transitions", 3, 5).ui.pane == "transitions"
    assert press(state, "explain", 3, 5).ui.pane == "detail"
    assert press(state, "back", 3, 5).ui.pane == "detail"


def test_the_pane_of_another_vehicle_starts_at_the_top() -> None:
    state = fleet()._replace(ui=Ui("vehicle/1", "transitions", scroll=7))
    assert press(state, "down", 3, 5).ui.scroll == 0
    state = fleet()._replace(ui=Ui("vehicle/1", "all transitions", scroll=7))
    assert press(state, "down", 3, 5).ui.scroll == 7


def test_without_vehicles_keys_change_nothing() -> None:
    for action in set(ACTIONS.values()):
        assert press(screen(Board()), action, 0, 5).ui.handle == ""
