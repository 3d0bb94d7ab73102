"""Names, counts and order of robots, and the cells of their columns."""

from __future__ import annotations

import pytest

from mav_robot_status.clock import later
from mav_robot_status.interface import Inhibit, LinkState, Vehicle
from mav_robot_status.publishers.board import Board
from mav_robot_status.views.terminal.columns import COLUMNS, LEAST_WHY, cell, columns, head, sort_key
from mav_robot_status.views.terminal.details import changes, details, evidence, help_lines
from mav_robot_status.views.terminal.robots import Memory, Robot, counts, in_order, matches
from mav_robot_status.views.terminal.text import Signs, cells

from .fleet import (
    CRASH,
    DISARMED,
    DRIVING,
    FAILED,
    NOTHING,
    PARKED,
    PREARM,
    RADIO,
    ROVER,
    START,
    STOPPED,
    Source,
    lose,
    one,
    put,
    robots,
    texts,
)


def fleet() -> Board:
    """A robot in each state, the worst last."""
    board = Board()
    put(board, DRIVING, system=1)
    put(board, PARKED, system=10, inhibits=(DISARMED,))
    put(board, PARKED, system=2, inhibits=(DISARMED,))
    put(board, PARKED, system=3, inhibits=(DISARMED, PREARM))
    lose(board, 4)
    put(board, FAILED, system=5, errors=(RADIO,))
    put(board, STOPPED, system=6, inhibits=(Inhibit("E_STOPPED", None, 0),))
    return board


def names(found: list[Robot]) -> list[str]:
    return [robot.name for robot in found]


def row(robot: Robot, width: int, signs: Signs | None = None) -> str:
    shown = columns(width, [robot])
    return "".join(text for column in shown for text, _ in cell(column, robot, signs or Signs())).rstrip()


def robot_with_an_arm() -> Board:
    """A group of a rover and an arm that is stopped; and another robot, in error."""
    board = Board()
    button = Inhibit("E_STOPPED", "emergency stop", START.unix_us - 4_000_000)
    put(board, system=1, handle="base")
    put(board, STOPPED, system=None, component=None, handle="arm", inhibits=(button,), vehicle=Vehicle("UR", "UR arm"))
    put(
        board,
        STOPPED,
        component=192,
        handle="robot",
        inhibits=(button._replace(handle="arm"),),
        vehicle=Vehicle(type="GROUP"),
        members=("base", "arm"),
    )
    put(board, FAILED, system=3, errors=(CRASH,))
    return board


# -- order and counts --------------------------------------------------------------------------------------------------


def test_the_worst_comes_first_then_the_name() -> None:
    assert names(in_order(robots(fleet()))) == ["6.1", "5.1", "4.1", "3.1", "1.1", "2.1", "10.1"]


def test_a_column_gives_another_order_and_its_reverse() -> None:
    assert names(in_order(robots(fleet()), sort_key("name")))[:3] == ["1.1", "2.1", "3.1"]
    assert names(in_order(robots(fleet()), sort_key("name"), reverse=True))[0] == "10.1"
    assert names(in_order(robots(fleet()), sort_key("e_stopped"), reverse=True))[0] == "6.1"


def test_a_group_stands_with_its_members_where_the_worst_of_them_belongs() -> None:
    assert names(in_order(robots(robot_with_an_arm()))) == ["robot", "base", "arm", "3.1"]


def test_a_group_does_not_count_beside_its_members() -> None:
    number, of_filter = counts(robots(robot_with_an_arm()))
    assert number == 3
    assert of_filter == {"in error": 1, "e-stopped": 1, "not heard": 0, "can move": 2}


def test_a_search_finds_names_kinds_modes_and_reasons() -> None:
    robot = one(status=FAILED, errors=(RADIO,))
    assert all(matches(robot, text) for text in ("", "1.1", "rover", "hold", "radio fail", "rc_lost"))
    assert not matches(robot, "copter")


# -- names -------------------------------------------------------------------------------------------------------------


def test_a_robot_has_the_name_that_people_gave_it() -> None:
    board = Board()
    put(board)
    board.entries["vehicle/1"].line = {**board.entries["vehicle/1"].line, "vehicle": {"name": "Rover-A", "type": None}}
    assert names(robots(board)) == ["Rover-A"]


def test_a_robot_without_ids_has_the_name_of_its_handle() -> None:
    assert one(status=NOTHING, system=None, component=None, handle="tractor").name == "tractor"


def test_a_member_without_a_name_of_its_own_keeps_its_ids() -> None:
    board = Board()
    default = "industrial_robot_status_handle"
    put(board, PARKED, handle=default, inhibits=(DISARMED,))
    put(board, PARKED, component=192, handle="robot", members=(default,))
    assert names(robots(board)) == ["robot", "1.1"]


# -- what is known of a lost robot -------------------------------------------------------------------------------------


def test_a_lost_robot_says_what_was_last_known_of_it_and_that_it_may_move() -> None:
    board, memory = Board(), Memory()
    put(board)
    memory.robots(Source(board).rows(), START)
    lose(board, 1, later(START, 5.0))
    (robot,) = memory.robots(Source(board).rows(), later(START, 5.0))
    told = " ".join(texts(details(robot, Signs())))
    assert robot.headline.word == "LOST"
    assert "Last heard " in told
    assert ": armed, moving, AUTO. It may be moving." in told
    assert "Why this is unknown:   LINK_STALE since " in told  # it prevents no motion
    assert "cannot move" not in told


def test_what_is_gone_is_forgotten() -> None:
    board, memory = Board(), Memory()
    put(board)
    memory.robots(Source(board).rows(), START)
    assert memory.robots([], START) == []
    lose(board, 1)
    (robot,) = memory.robots(Source(board).rows(), START)
    assert not any(sentence.rest for sentence in robot.headline.sentences)


# -- columns -----------------------------------------------------------------------------------------------------------


def test_a_row_of_80_columns() -> None:
    robot = one(status=PARKED, inhibits=(DISARMED,))
    assert texts([head(columns(80, [robot]))]) == [f"{'state':<17}robot {'why':<42}heard mode"]
    assert row(robot, 80) == f"▪ PARKED         1.1   {'Parked: it is disarmed.':<42}0s    ☺ MANUAL"


def test_a_row_without_utf8_is_ascii() -> None:
    assert row(one(status=FAILED), 120, Signs(utf8=False)).startswith("! FAULT          1.1")


def test_a_wide_row_has_every_field() -> None:
    shown = row(one(status=FAILED, errors=(RADIO,)), 190)
    assert "0s    » AUTO   ↯ ON   ? unk  ● YES ▫ no   ◆ ERR 0/s   HOLD          GROUND_ROVER" in shown
    assert "“Radio Failsafe”" in shown


@pytest.mark.parametrize("width", [48, 60, 80, 100, 120, 160, 200])
def test_the_columns_fill_the_width_at_most(width: int) -> None:
    board = robot_with_an_arm()
    shown = columns(width, robots(board))
    assert sum(column.width for column in shown) <= width
    assert next(column for column in shown if column.name == "why").width >= LEAST_WHY
    for robot in robots(board):
        for column in shown:
            assert cells("".join(text for text, _ in cell(column, robot, Signs()))) == column.width


def test_every_column_can_be_sorted_with_unknown_values() -> None:
    found = robots(fleet())
    for column in COLUMNS:
        assert len(in_order(found, column.order)) == len(found)


# -- details -----------------------------------------------------------------------------------------------------------


def test_the_details_have_the_headline_its_next_step_and_all_causes() -> None:
    robot = one(status=PARKED, errors=(CRASH,), inhibits=(DISARMED, PREARM))
    robot = robot._replace(headline=robot.headline._replace(step="Look at it."))
    lines = texts(details(robot, Signs()))
    assert lines[0] == "▲ CRASHED  1.1  GROUND_ROVER, ARDUPILOTMEGA, HOLD, ACTIVE"
    assert lines[1] == "Crashed."
    assert "Next: Look at it." in lines
    assert any(line.startswith("error      4001 CRASH since ") for line in lines)
    assert any(line.endswith(": “PreArm: GPS 1: Bad fix”") for line in lines)


def test_the_rates_are_listed_with_their_sum() -> None:
    board = Board()
    put(board)
    source = Source(board, rates={"SYS_STATUS": 2.0, "HEARTBEAT": 1.02})
    (robot,) = Memory().robots(source.rows(), START)
    assert "messages   3/s: HEARTBEAT 1.0/s, SYS_STATUS 2.0/s" in texts(details(robot, Signs()))


def test_the_evidence_has_value_age_rule_and_source() -> None:
    stop = {"rule": "ArduPilot does not show an emergency stop", "source": None, "age": None, "value": None}
    moves = {"rule": "speed", "source": "GLOBAL_POSITION_INT: 0.02 m/s", "age": 0.41, "value": False}
    assert texts(evidence({"fields": {"e_stopped": stop, "in_motion": moves}}, Signs())) == [
        "e_stopped       ? unknown             ArduPilot does not show an emergency stop",
        "in_motion       ▫ still         0.4s  speed [GLOBAL_POSITION_INT: 0.02 m/s]",
    ]
    assert "nothing to explain" in texts(evidence(None, Signs()))[0]


def test_changes_show_what_begins_and_what_ends() -> None:
    board = Board()
    put(board, PARKED, inhibits=(DISARMED,))
    put(board, FAILED, later(START, 2.0), errors=(RADIO,), vehicle=ROVER._replace(flight_mode="GUIDED"))
    found = Source(board).changes(["vehicle/1"], 100)
    lines = [line[9:] for line in texts(changes(found, Signs()))]
    assert "error           begins  RC_LOST: “Radio Failsafe”" in lines
    assert "inhibit         ends    DISARMED" in lines
    assert "e_stopped       ? unknown  was ○ released" in lines
    assert "flight_mode     GUIDED  was HOLD" in lines
    assert " Rover-A      mode " in texts(changes(found, Signs(), {"vehicle/1": "Rover-A"}))[-1]


def test_a_robot_that_was_never_heard_has_a_row() -> None:
    robot = one(status=NOTHING, system=7, component=None, handle="t", age=None, link=LinkState.NEVER_SEEN)
    assert row(robot, 80).startswith("◌ NOT HEARD      7 ")
    assert "never" in row(robot, 80)


def test_control_characters_in_a_text_do_not_reach_the_terminal() -> None:
    evil = RADIO._replace(text="\x1b]0;hello\x07\x1b[2J")
    robot = one(status=FAILED, errors=(evil,), vehicle=Vehicle("\n", "\x9b1m", "\x1b[31m", 1, ""))
    assert all(line.isprintable() for line in [row(robot, 200), *texts(details(robot, Signs()))])


def test_the_help_has_the_values_of_each_field_and_the_note() -> None:
    lines = texts(help_lines(Signs()))
    assert any(line.startswith("e_stopped") and "■ STOPPED  ○ released  ? unknown" in line for line in lines)
    assert "not a safety function" in lines[-1]
