"""The plain table: one screen of it, and a line for each change in a pipe."""

from __future__ import annotations

import io
import logging
import os
from collections.abc import Iterator

import pytest

from mav_robot_status.clock import later
from mav_robot_status.publishers.board import Board
from mav_robot_status.views.terminal import terminal_size
from mav_robot_status.views.terminal.log_lines import KEPT, LogLines
from mav_robot_status.views.terminal.plain import frame, print_changes, screen
from mav_robot_status.views.terminal.text import Signs, Span

from .fleet import CRASH, DISARMED, DRIVING, FAILED, PARKED, RADIO, START, Source, put, robots, texts


def drawn(
    board: Board, columns: int, lines: int, colours: bool = False, signs: Signs | None = None, top: int = 0
) -> str:
    size = os.terminal_size((columns, lines))
    signs = signs or Signs()
    shown = screen(Source(board), robots(board), size, signs, lines - 1, top)
    return frame(shown, [(Span("the story", "bold"),)], size, colours, signs)


def seen(board: Board, columns: int, lines: int, top: int = 0) -> list[str]:
    """The lines of a screen as text."""
    text = drawn(board, columns, lines, top=top).removeprefix("\x1b[H").removesuffix("\x1b[K\x1b[J")
    return text.split("\x1b[K\r\n")


def test_a_screen_has_counts_table_details_and_the_footer_at_its_bottom() -> None:
    board = Board()
    put(board, FAILED, system=1, errors=(RADIO,))
    put(board, PARKED, system=2, inhibits=(DISARMED,))
    lines = [line.removesuffix("\x1b[K") for line in drawn(board, 80, 24).split("\r\n")]
    assert len(lines) == 24
    assert lines[0] == "\x1b[Hudp:127.0.0.1:14550  2 robots, 1 in error, 1 can move"
    assert [line[:18].strip() for line in lines[1:4]] == [
        "state            r",
        "◆ FAULT          1",
        "▪ PARKED         2",
    ]
    assert lines[5].startswith("◆ FAULT  1.1  GROUND_ROVER")
    assert lines[-1] == "the story\x1b[K\x1b[J"


@pytest.mark.parametrize(("columns", "lines"), [(20, 5), (40, 10), (80, 24), (200, 60)])
def test_a_screen_never_scrolls(columns: int, lines: int) -> None:
    board = Board()
    for system in range(1, 30):
        put(board, FAILED, system=system, errors=(RADIO._replace(text="x" * 300),))
    shown = drawn(board, columns, lines, signs=Signs(utf8=False))
    assert shown.isascii()
    rows = shown.removeprefix("\x1b[H").removesuffix("\x1b[J").replace("\x1b[K", "").split("\r\n")
    assert len(rows) == lines
    assert all(len(row) <= columns for row in rows)


def fleet(number: int) -> Board:
    """Robots of which the last one has a trouble."""
    board = Board()
    for system in range(1, number):
        put(board, DRIVING, system=system)
    put(board, PARKED._replace(in_error=FAILED.in_error), system=number, errors=(CRASH._replace(text="Going to HOLD"),))
    return board


def test_trouble_comes_first_and_what_does_not_fit_is_a_number() -> None:
    lines = seen(fleet(30), 80, 24)
    assert lines[2].startswith("▲ CRASHED        30.1  Crashed: “Going to HOLD”.")
    rows = [line for line in lines if line.startswith(("▶ MOVING ", "▲ CRASHED        "))]
    assert f"+{30 - len(rows)} more (j, PgDn)" in lines
    assert "~" not in "".join(lines)
    later = seen(fleet(30), 80, 24, top=17)
    assert not any("more" in line for line in later)
    assert any(line.startswith("▶ MOVING         29.1") for line in later)


def test_a_terminal_of_40_by_10_has_word_name_and_cause_of_the_worst() -> None:
    text = "\n".join(seen(fleet(20), 40, 10))
    assert "▲ CRASHED  20.1" in text
    assert "Crashed: “Going to HOLD”." in text
    assert "more (j, PgDn)" in text


@pytest.mark.parametrize("width", [44, 60, 80, 120, 200])
def test_the_cause_keeps_its_first_twenty_letters(width: int) -> None:
    row = next(line for line in seen(fleet(3), width, 24) if line.startswith("▲ CRASHED "))
    assert "Crashed: “Going to H" in row


@pytest.mark.parametrize(
    ("reported", "used"), [((0, 0), (80, 24)), ((100, 0), (100, 24)), ((0, 50), (80, 50)), ((100, 50), (100, 50))]
)
def test_a_side_of_the_terminal_that_is_not_known_is_assumed(
    monkeypatch: pytest.MonkeyPatch, reported: tuple[int, int], used: tuple[int, int]
) -> None:
    for name in ("COLUMNS", "LINES"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os, "get_terminal_size", lambda descriptor=1: os.terminal_size(reported))
    assert terminal_size() == used


def test_colours_are_those_of_the_tones() -> None:
    board = Board()
    put(board, FAILED, errors=(RADIO,))
    assert "\x1b[1;37;41m◆ FAULT\x1b[0m" in drawn(board, 80, 24, colours=True)
    assert "\x1b[1" not in drawn(board, 80, 24)


def test_nobody_is_heard_yet() -> None:
    assert "No heartbeat of an autopilot yet. To find out why: doctor" in drawn(Board(), 80, 24)


# -- in a pipe ---------------------------------------------------------------------------------------------------------


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """Its ends for reading and writing."""
    reading, writing = os.pipe()
    yield reading, writing
    os.close(reading)
    os.close(writing)


def test_each_change_is_a_line_below_the_titles(pipe: tuple[int, int]) -> None:
    board = Board()
    source = Source(
        board,
        lambda: put(board, PARKED, inhibits=(DISARMED,)),
        lambda: put(board, PARKED, later(START, 0.5), inhibits=(DISARMED,)),  # no change
        lambda: put(board, FAILED, later(START, 1.5), errors=(RADIO,)),
    )
    print_changes(source, Signs(), pipe[1])
    lines = os.read(pipe[0], 65536).decode().splitlines()
    assert lines[0].startswith("time                   state            robot heard mode")
    assert [line[:43].rstrip() for line in lines[1:]] == [
        "2027-01-15T08:00:00.0Z ▪ PARKED         1.1",
        "2027-01-15T08:00:01.5Z ◆ FAULT          1.1",
    ]
    assert "“Radio Failsafe”" in lines[2]


def test_a_slow_reader_gets_the_latest_status(pipe: tuple[int, int]) -> None:
    board = Board()
    os.set_blocking(pipe[1], False)
    filled = 0
    try:
        while True:
            filled += os.write(pipe[1], b"x" * 65536)
    except BlockingIOError:
        os.set_blocking(pipe[1], True)
    source = Source(
        board,
        lambda: put(board, PARKED),
        lambda: put(board, DRIVING),
        lambda: os.read(pipe[0], filled),
        lambda: None,
    )
    print_changes(source, Signs(), pipe[1])
    lines = os.read(pipe[0], 65536).decode().splitlines()
    assert len(lines) == 2
    assert "▶ MOVING" in lines[1]


# -- the log -----------------------------------------------------------------------------------------------------------


def test_the_log_is_received_and_then_the_handlers_are_restored() -> None:
    root = logging.getLogger()
    log, before = LogLines(), root.handlers[:]
    with log.instead_of_stderr():
        logging.getLogger("mav_robot_status").warning("lost vehicle %d.%d", 1, 1)
    logging.getLogger("mav_robot_status").warning("not seen any more")
    assert root.handlers == before
    assert list(log.lines) == [("lost vehicle 1.1", True)]


def test_a_redirected_standard_error_still_has_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    root, file = logging.getLogger(), io.StringIO()
    monkeypatch.setattr(root, "handlers", [logging.StreamHandler(file)])
    with LogLines().instead_of_stderr():
        root.warning("lost vehicle 1.1")
    assert file.getvalue() == "lost vehicle 1.1\n"


def test_the_last_lines_of_the_log_are_kept_only() -> None:
    log = LogLines()
    for number in range(KEPT + 5):
        log.handle(logging.LogRecord("x", logging.INFO, "", 0, "line %d", (number,), None))
    assert [log.lines[0][0], log.lines[-1][0]] == ["line 5", f"line {KEPT + 4}"]


def test_the_lines_of_a_screen_are_spans() -> None:
    board = Board()
    put(board)
    assert texts(screen(Source(board), robots(board), os.terminal_size((80, 24)), Signs()))[2].startswith(
        "▶ MOVING         1.1 "
    )
