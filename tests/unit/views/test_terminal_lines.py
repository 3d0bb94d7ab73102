"""The parts of `watch` beside `render`: lines without a screen, colours, and the log strip."""

from __future__ import annotations

import io
import logging
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.gateway.background import Row
from mav_robot_status.publishers.board import Board, Transition
from mav_robot_status.views.terminal import paint
from mav_robot_status.views.terminal.render import render
from mav_robot_status.views.terminal.show import show_lines
from mav_robot_status.views.terminal.strip import KEPT, Strip
from mav_robot_status.views.terminal.text import ASCII, UNICODE, Glyphs, Span, plain

from .fleet import DISARMED, DRIVING, FAILED, PARKED, RADIO, START, one, put


class Source:
    """A source whose `wait` runs the next step of the test."""

    connection = "udp:127.0.0.1:14550"
    advice = ""
    explained = ""

    def __init__(self, board: Board, *steps: Callable[[], object]) -> None:
        self._board = board
        self._steps = list(steps)

    def now(self) -> Instant:
        return START

    def wait(self, seconds: float) -> bool:
        if self._steps:
            self._steps.pop(0)()
        return not self._steps

    def explanation(self) -> Mapping[str, Any] | None:
        return None

    @property
    def version(self) -> int:
        return self._board.version

    def rows(self) -> list[Row]:
        return [Row(e.line, e.stamp, e.version, e.heartbeat_age, {}) for e in self._board]

    def changes(self, handles: Sequence[str], most: int) -> Sequence[tuple[str, Transition]]:
        return []


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    reading, writing = os.pipe()
    yield reading, writing
    for descriptor in (reading, writing):
        try:
            os.close(descriptor)
        except OSError:
            assert descriptor == reading  # a test may have closed it


def printed(pipe: tuple[int, int], source: Source, glyphs: Glyphs = UNICODE) -> list[str]:
    show_lines(source, pipe[1], glyphs)
    return os.read(pipe[0], 65536).decode().splitlines()


def test_without_a_screen_each_change_is_a_line_below_the_titles(pipe: tuple[int, int]) -> None:
    board = Board()
    source = Source(
        board,
        lambda: put(board, PARKED, inhibits=(DISARMED,)),
        lambda: put(board, PARKED, later(START, 0.5), inhibits=(DISARMED,)),  # no change
        lambda: put(board, FAILED, later(START, 1.5), errors=(RADIO,)),
    )
    assert printed(pipe, source) == [
        "                                                          drive can   in     in    link",
        "time                   vehicle flight mode  mode   e-stop power move  motion error age   "
        "error, or why it cannot move",
        "2027-01-15T08:00:00.0Z 1.1     HOLD         MANUAL ○ no   ○ no  ○ no  ○ no   ○ no  0s    DISARMED",
        "2027-01-15T08:00:01.5Z 1.1     HOLD         AUTO   ? unk  ● YES ● YES ○ no   ● YES 0s    "
        "RC_LOST: Radio Failsafe",
    ]


def test_lines_without_utf8_have_ascii_symbols(pipe: tuple[int, int]) -> None:
    board = Board()
    lines = printed(pipe, Source(board, lambda: put(board, DRIVING)), ASCII)
    assert lines[-1].endswith("HOLD         AUTO   - no   * YES * YES * YES  - no  0s")


def test_a_slow_reader_gets_the_latest_status(pipe: tuple[int, int]) -> None:
    board = Board()
    os.set_blocking(pipe[1], False)
    filled = 0
    while True:
        try:
            filled += os.write(pipe[1], b"x" * 65536)
        except BlockingIOError:
            break
    source = Source(
        board, lambda: put(board, PARKED), lambda: put(board, FAILED), lambda: os.read(pipe[0], filled), lambda: None
    )
    lines = printed(pipe, source)
    assert len(lines) == 3
    assert "AUTO   ? unk" in lines[2]


def test_a_closed_reader_ends_it_without_a_change(pipe: tuple[int, int]) -> None:
    os.close(pipe[0])
    with pytest.raises(BrokenPipeError):
        show_lines(Source(Board(), lambda: None), pipe[1], UNICODE)


# -- colours -----------------------------------------------------------------------------------------------------------

LINE = (Span("● YES", "alarm"), Span(" "), Span("? unk", "unknown"))


@pytest.fixture
def colourful(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NO_COLOR", "COLORTERM"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")


@pytest.mark.usefixtures("colourful")
def test_rich_gives_the_styles_their_colours() -> None:
    assert paint.painter()(LINE) == "\x1b[1;37;41m● YES\x1b[0m \x1b[35m? unk\x1b[0m"


@pytest.mark.usefixtures("colourful")
def test_no_color_leaves_bold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NO_COLOR", "1")
    assert paint.painter()(LINE) == "\x1b[1m● YES\x1b[0m ? unk"


@pytest.mark.usefixtures("colourful")
def test_without_rich_the_same_is_plain_text(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in [name for name in sys.modules if name.partition(".")[0] == "rich"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "rich", None)
    painted = paint.painter()
    assert [painted(line) for line in render(one(), 80, 24)] == [plain(line) for line in render(one(), 80, 24)]


# -- the log -----------------------------------------------------------------------------------------------------------


def test_the_strip_receives_the_log_and_then_restores_the_handlers() -> None:
    root = logging.getLogger()
    strip, before = Strip(), root.handlers[:]
    with strip.instead_of_stderr():
        logging.getLogger("mav_robot_status").warning("lost vehicle %d.%d", 1, 1)
    logging.getLogger("mav_robot_status").warning("not seen any more")
    assert root.handlers == before
    assert [(line.text, line.serious) for line in strip.lines] == [("lost vehicle 1.1", True)]


def test_a_redirected_standard_error_still_has_the_log(monkeypatch: pytest.MonkeyPatch) -> None:
    root, file = logging.getLogger(), io.StringIO()
    monkeypatch.setattr(root, "handlers", [logging.StreamHandler(file)])
    with Strip().instead_of_stderr():
        root.warning("lost vehicle 1.1")
    assert file.getvalue() == "lost vehicle 1.1\n"


def test_the_strip_keeps_the_last_lines_only() -> None:
    strip = Strip()
    for number in range(KEPT + 5):
        strip.handle(logging.LogRecord("x", logging.INFO, "", 0, "line %d", (number,), None))
    assert strip.count == KEPT + 5
    assert [strip.lines[0].text, strip.lines[-1].text] == ["line 5", f"line {KEPT + 4}"]
