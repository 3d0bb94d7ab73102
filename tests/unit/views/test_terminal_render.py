from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mav_robot_status.clock import later, rfc3339
from mav_robot_status.interface import Inhibit, LinkState, RobotStatus, Vehicle
from mav_robot_status.publishers.board import Board, Transition
from mav_robot_status.views.terminal.keys import press
from mav_robot_status.views.terminal.render import layout, render, settled
from mav_robot_status.views.terminal.state import Logged, State, Ui
from mav_robot_status.views.terminal.table import COLUMNS, FROM
from mav_robot_status.views.terminal.text import ASCII, Line, Style, cells, plain

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
    lose,
    one,
    put,
    screen,
    texts,
)

SIZES = ((80, 24), (120, 40), (40, 12))
PANES = ("detail", "explain", "transitions", "all transitions", "help")


def fleet(count: int) -> Board:
    board = Board()
    for system in range(1, count + 1):
        put(board, system=system)
    return board


def row(state: State, name: str, width: int = 80, height: int = 24) -> str:
    return next(text for text in texts(render(state, width, height)) if text[1:].startswith(name))


def styles(lines: list[Line], text: str) -> list[Style]:
    return [span.style for line in lines for span in line if span.text.strip() == text]


# -- the table ---------------------------------------------------------------------------------------------------------


def test_the_screen_of_80_columns() -> None:
    board = Board()
    put(board, FAILED, system=1, errors=(RADIO, CRASH))
    put(board, PARKED, system=2, inhibits=(DISARMED, PREARM))
    lose(board, 3)
    log = (Logged(START.unix_us, "lost vehicle 3.1: no heartbeat for 3.5 s", serious=True),)
    assert texts(render(screen(board, log=log, ui=Ui("vehicle/2")), 80, 24)) == [
        " mav-robot-status  udp:127.0.0.1:14550    3 vehicles, 1 error, 1 lost 08:00:00Z",
        "                                drive can   in     in    link",
        " id  flight mode  mode   e-stop power move  motion error age   why",
        " 1.1 HOLD         AUTO   ? unk  ● YES ● YES ○ no   ● YES 0s    RC_LOST, CRASH",
        "▶2.1 HOLD         MANUAL ○ no   ○ no  ○ no  ○ no   ○ no  0s    PREARM_FAILING +1",
        " 3.1              ? unk  ? unk  ? unk ? unk ? unk  ? unk ✗ 5s  LINK_STALE",
        "─ 2.1 GROUND_ROVER, ARDUPILOTMEGA, ACTIVE ──────────────────────────────────────",
        " It cannot move and a person is in charge.",
        " no motion DISARMED for 12s",
        ' no motion PREARM_FAILING for 10s: "PreArm: GPS 1: Bad fix"',
        " link      CONNECTED, last heartbeat 0s ago",
        " handle    vehicle/2",
        *[""] * 10,
        " 08:00:00 lost vehicle 3.1: no heartbeat for 3.5 s",
        " j/k select  n next problem  e explain  t changes  ? help  q quit",
    ]


def test_a_wide_screen_has_the_names_of_the_fields_and_the_texts() -> None:
    board = Board()
    put(board, FAILED, errors=(RADIO,))
    lines = texts(render(screen(board), 130, 40))
    assert lines[1:4] == [
        "                           e_      drives_ motion_  in_    in_   link   messages",
        " id  flight mode    mode   stopped powered possible motion error age             error, or why it cannot move",
        "▶1.1 HOLD           AUTO   ? unk   ● YES   ● YES    ○ no   ● YES 0s          0/s RC_LOST: Radio Failsafe",
    ]


def test_a_narrow_screen_still_has_the_fields() -> None:
    board = Board()
    put(board, FAILED, errors=(RADIO,))
    put(board, STOPPED, system=2)
    assert texts(render(screen(board), 40, 12))[:4] == [
        " 2 vehicles, 1 error, 1 e-stop",
        " id  mode stop powr move motn err  age",
        "▶1.1 AUTO ?unk ●YES ●YES ○no  ●YES 0s",
        " 2.1 AUTO ●YES ○no  ○no  ○no  ○no  0s",
    ]


def test_a_narrow_screen_shows_the_keys_for_help_and_quit() -> None:
    assert texts(render(screen(fleet(2), ui=Ui(pane="help")), 40, 12))[-1] == " e explain  t changes  ? help  q quit"
    assert texts(render(screen(fleet(2)), 20, 12))[-1] == " ? help  q quit"


def test_true_false_and_unknown_differ_in_symbol_word_and_style() -> None:
    lines = render(one(status=DRIVING._replace(in_error=NOTHING.in_error)), 80, 24)
    for text, style in (("● YES", "on"), ("○ no", ""), ("? unk", "unknown")):
        assert set(styles(lines, text)) == {style}


def test_an_error_and_an_emergency_stop_have_alarming_styles() -> None:
    assert "alarm" in styles(render(one(status=FAILED), 80, 24), "● YES")
    assert "stop" in styles(render(one(status=STOPPED), 80, 24), "● YES")
    assert "1 e-stop" in texts(render(one(status=STOPPED), 80, 24))[0]


def test_without_utf8_there_are_other_symbols() -> None:
    board = Board()
    put(board, FAILED, errors=(RADIO,))
    lose(board, 2)
    lines = texts(render(screen(board, glyphs=ASCII), 80, 24))
    assert "".join(lines).isascii()
    assert lines[3] == ">1.1 HOLD         AUTO   ? unk  * YES * YES - no   * YES 0s    RC_LOST: Radio F~"
    assert " x 5s " in lines[4]


def test_control_characters_in_a_text_do_not_reach_the_terminal() -> None:
    evil = RADIO._replace(text="\x1b]0;hello\x07\x1b[2J")
    lines = render(one(status=FAILED, errors=(evil,), vehicle=Vehicle("\n", "\x9b1m", "\x1b[31m", 1, "")), 120, 24)
    assert all(plain(line).isprintable() for line in lines)


def test_errors_come_before_inhibits_and_texts_before_bare_names() -> None:
    many = row(one(status=FAILED, errors=(RADIO, CRASH), inhibits=(DISARMED, PREARM)), "1.1", 160)
    assert many.endswith("RC_LOST: Radio Failsafe, CRASH, PREARM_FAILING, DISARMED")
    assert row(one(status=PARKED, inhibits=(DISARMED, PREARM)), "1.1").endswith("PREARM_FAILING +1")
    assert row(one(status=PARKED, inhibits=(DISARMED,)), "1.1").endswith(" DISARMED")


def test_a_vehicle_without_a_heartbeat_has_a_row() -> None:
    stale = Inhibit("LINK_STALE", None, START.unix_us)
    state = one(
        status=NOTHING,
        system=7,
        component=None,
        handle="tractor",
        age=None,
        link=LinkState.NEVER_SEEN,
        inhibits=(stale,),
        vehicle=Vehicle(),
    )
    assert " never LINK_STALE" in row(state, "7 ")
    assert " link      NEVER_SEEN, no heartbeat yet" in texts(render(state, 80, 24))


def test_a_vehicle_without_ids_has_the_name_of_its_handle() -> None:
    nobody = one(status=NOTHING, system=None, component=None, handle="tractor_in_the_north", age=None)
    assert row(nobody, "tractor_in_…")


def test_the_age_of_an_old_heartbeat_fits_its_column() -> None:
    board = Board()
    for age in (5, 99, 100, 5999, 6000, 172_800, 1e9):
        lose(board, int(age) % 251, age=age)
    ages = re.findall(r"(✗ .{3}) LINK_STALE", "\n".join(texts(render(screen(board), 80, 30))))
    assert sorted(ages) == ["✗ 11…", "✗ 1h ", "✗ 1m ", "✗ 2d ", "✗ 5s ", "✗ 99m", "✗ 99s"]


@pytest.mark.parametrize("width", [*range(33, 180, 7), *FROM])
def test_titles_and_cells_are_in_the_same_columns(width: int) -> None:
    size = max(i for i, least in enumerate(FROM) if width >= least)
    widths = [c.widths[size] for c in COLUMNS if c.widths[size]]
    titles, cells_ = (plain(line) for line in render(one(inhibits=(DISARMED,)), width, 40)[2:4])
    at = 4
    for cell in widths:
        if at < width:
            assert titles[at] == cells_[at] == " "
        at += cell + 1


# -- a fleet -----------------------------------------------------------------------------------------------------------


def rows_of(state: State, width: int = 80, height: int = 24) -> list[str]:
    first = layout(state, width, height).head + 1
    return [
        text[1:].split()[0] for text in texts(render(state, width, height))[first:][: layout(state, width, height).rows]
    ]


def test_fifty_vehicles_scroll_with_the_selection() -> None:
    state = screen(fleet(50))
    assert rows_of(state) == [f"{n}.1" for n in range(1, 10)]
    assert "rows 1-9 of 50" in "".join(texts(render(state, 80, 24)))
    state = press(state, "last", 9, 9)
    assert rows_of(state) == [f"{n}.1" for n in range(42, 51)]
    assert row(state, "50.1").startswith("▶50.1")
    state = press(state, "page up", 9, 9)
    assert row(state, "41.1").startswith("▶41.1")


def test_few_vehicles_leave_more_room_for_the_details() -> None:
    assert layout(screen(fleet(2)), 80, 24) == (2, 2, 15, 2)
    assert layout(screen(fleet(50)), 80, 24) == (2, 9, 8, 2)
    assert layout(screen(fleet(50)), 40, 12) == (1, 4, 4, 0)


def test_an_explanation_gets_more_room_than_the_table() -> None:
    parts = layout(screen(fleet(50), ui=Ui(pane="explain")), 80, 24)
    assert parts.pane > 4 * parts.rows


def test_a_removed_vehicle_is_no_longer_selected() -> None:
    state = settled(screen(fleet(2), ui=Ui("nobody")), 80, 24)
    assert state.ui.handle == "vehicle/1"


@settings(deadline=None)
@given(
    st.integers(1, 200),
    st.integers(1, 60),
    st.integers(0, 60),
    st.sampled_from(PANES),
    st.integers(0, 99),
)
def test_every_screen_is_filled_exactly(width: int, height: int, count: int, pane: str, scroll: int) -> None:
    board = fleet(count)
    for system in range(1, count, 3):
        put(board, FAILED, system=system, errors=(RADIO, CRASH), inhibits=(DISARMED, PREARM))
    changes = tuple(("1.1", t) for entry in board for t in entry.transitions)
    log = (Logged(START.unix_us, "x" * 300), Logged(START.unix_us, "漢" * 300))
    state = screen(board, ui=Ui(f"vehicle/{count // 2}", pane, scroll), changes=changes, log=log)  # type: ignore[arg-type]
    lines = render(settled(state, width, height), width, height)
    assert [cells(plain(line)) for line in lines] == [width] * height


# -- the pane ----------------------------------------------------------------------------------------------------------


def test_the_advice_is_shown_before_the_first_heartbeat() -> None:
    lines = texts(render(screen(Board(), advice="To find out why: doctor udp:127.0.0.1:14550"), 80, 24))
    assert " No heartbeat of an autopilot yet." in lines
    assert " To find out why: doctor udp:127.0.0.1:14550" in lines
    assert "0 vehicles" in lines[0]


@pytest.mark.parametrize(
    ("status", "sentence"),
    [
        (DRIVING, "It can move and a program is in charge."),
        (STOPPED, "It cannot move, a program is in charge and the emergency stop is engaged."),
        (FAILED, "It can move, a program is in charge and it has an error."),
        (NOTHING, "It is unknown whether it can move and it is unknown who is in charge."),
    ],
)
def test_the_details_begin_with_the_status_as_a_sentence(status: RobotStatus, sentence: str) -> None:
    assert " " + sentence in texts(render(one(status=status), 100, 24))


def test_the_details_have_the_texts_of_all_causes() -> None:
    lines = texts(render(one(status=FAILED, errors=(RADIO, CRASH), inhibits=(PREARM,)), 80, 24))
    at = lines.index(' error     2001 RC_LOST for 3s: "Radio Failsafe"')
    assert lines[at + 1 : at + 3] == [
        " error     4001 CRASH for 3s",
        ' no motion PREARM_FAILING for 10s: "PreArm: GPS 1: Bad fix"',
    ]


def test_the_room_below_the_details_shows_the_latest_changes() -> None:
    changes = (("1.1", Transition(START.mono - 4, rfc3339(START.unix_us - 4_000_000), "in_motion", True)),)
    lines = texts(render(one()._replace(changes=changes), 80, 24))
    assert " 07:59:56.0   4s ago  in_motion       ● YES" in lines


def test_the_rates_are_listed_with_their_sum() -> None:
    state = one()
    rates = {"SYS_STATUS": 2.0, "HEARTBEAT": 1.02}
    state = state._replace(vehicles=(state.vehicles[0]._replace(rates=rates),))
    assert " rates     3 a second: HEARTBEAT 1.0, SYS_STATUS 2.0" in texts(render(state, 80, 24))
    assert "   3/s" in row(state, "1.1", 120)


def explained(width: int) -> list[str]:
    why = {"rule": "ArduPilot does not show an emergency stop", "source": None, "age": None, "value": None}
    moves = {"rule": "speed", "source": "GLOBAL_POSITION_INT: 0.02 m/s", "age": 0.41, "value": False}
    mode = {"rule": "ArduPilot's rover table", "source": "HEARTBEAT.custom_mode 4", "age": 12.0, "value": "AUTO"}
    fields = {"mode": mode, "e_stopped": why, "in_motion": moves}
    return texts(render(one()._replace(ui=Ui(pane="explain"), explanation={"fields": fields}), width, 24))


def test_an_explanation_has_value_age_rule_and_source() -> None:
    assert explained(80)[4:9] == [
        "─ 1.1 GROUND_ROVER: why each value ─────────────────────────────────────────────",
        " mode            AUTO   12.0 s  ArduPilot's rover table  [HEARTBEAT.custom_mode",
        "                                4]",
        " e_stopped       ? unk          ArduPilot does not show an emergency stop",
        " in_motion       ○ no    0.4 s  speed  [GLOBAL_POSITION_INT: 0.02 m/s]",
    ]


def test_a_narrow_screen_shows_the_rule_below_the_field() -> None:
    assert "   speed  [GLOBAL_POSITION_INT: 0.02" in explained(40)


def test_a_vehicle_without_a_heartbeat_is_not_explained() -> None:
    state = one(age=None)._replace(ui=Ui(pane="explain"))
    assert " No heartbeat yet: there is nothing to explain." in texts(render(state, 80, 24))


def test_changes_show_what_begins_and_what_ends() -> None:
    board = Board()
    put(board, PARKED, inhibits=(DISARMED,))
    put(board, FAILED, later(START, 2.0), errors=(RADIO,), vehicle=ROVER._replace(flight_mode="GUIDED"))
    changes = tuple(("1.1", t) for t in reversed(board.entries["vehicle/1"].transitions))
    state = screen(board, ui=Ui(pane="transitions"), changes=changes)._replace(now=later(START, 5.0))
    lines = texts(render(state, 80, 40))
    assert ' 08:00:02.0   3s ago  error           begins  RC_LOST: "Radio Failsafe"' in lines
    assert " 08:00:02.0   3s ago  inhibit         ends    DISARMED" in lines
    assert " 08:00:02.0   3s ago  e_stopped       ? unk   was ○ no" in lines
    assert " 08:00:00.0   5s ago  mode            MANUAL" in lines
    assert " 08:00:02.0   3s ago  flight_mode     GUIDED  was HOLD" in lines
    of_all = texts(render(state._replace(ui=Ui(pane="all transitions")), 80, 40))
    assert " 08:00:02.0   3s ago  1.1     mode            AUTO    was MANUAL" in of_all


def test_a_long_pane_is_paged() -> None:
    changes = tuple(("1.1", Transition(START.mono, rfc3339(START.unix_us), "in_motion", i % 2 == 0)) for i in range(60))
    state = one()._replace(ui=Ui("vehicle/1", "transitions"), changes=changes)
    page = layout(state, 80, 24).pane
    assert f"lines 1-{page} of 60" in texts(render(state, 80, 24))[4]
    for _ in range(9):
        state = settled(press(state, "page down", 1, page), 80, 24)
    assert f"lines {61 - page}-60 of 60" in texts(render(state, 80, 24))[4]
    state = settled(press(state, "page up", 1, page), 80, 24)
    assert state.ui.scroll == 60 - 2 * page


def test_the_help_fits_and_explains_the_symbols() -> None:
    lines = texts(render(one()._replace(ui=Ui(pane="help")), 80, 24))
    assert " values    ● YES, ○ no, ? unk: unknown, which never means no" in lines
    assert any("not a safety function" in line for line in lines)
