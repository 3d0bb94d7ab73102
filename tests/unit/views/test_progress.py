from __future__ import annotations

import io

from mav_robot_status.views.progress import ERASE, WIDTH, ProgressLine


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_without_a_terminal_nothing_is_written() -> None:
    stream = io.StringIO()
    line = ProgressLine(stream, "reading a.tlog")
    line(0.5)
    line.close()
    assert stream.getvalue() == ""


def test_the_bar_grows_and_is_removed() -> None:
    terminal = Terminal()
    line = ProgressLine(terminal, "reading a.tlog")
    line(0.5)
    assert terminal.getvalue() == f"reading a.tlog  [{'#' * (WIDTH // 2):<{WIDTH}}]  50 %{ERASE}\r"
    line.close()
    assert terminal.getvalue().endswith(f"\r{ERASE}")


def test_the_bar_is_drawn_once_for_each_per_cent() -> None:
    terminal = Terminal()
    line = ProgressLine(terminal, "")
    for step in range(10_001):
        line(step / 10_000)
    assert terminal.getvalue().count("%") == 101


def test_control_characters_in_a_name_are_shown_by_their_codes() -> None:
    terminal = Terminal()
    ProgressLine(terminal, "a\033[2J\n.tlog")(0.0)
    assert terminal.getvalue().startswith(r"a\u001b[2J\u000a.tlog")
