"""The screen of `watch`, driven as a user does: keys, mouse, and what is then on it."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable

import pytest
from textual.pilot import Pilot
from textual.widgets import DataTable, Static

from mav_robot_status.clock import later
from mav_robot_status.interface import Vehicle
from mav_robot_status.publishers.board import Board
from mav_robot_status.views.terminal.app import Count, Table, WatchApp
from mav_robot_status.views.terminal.log_lines import LogLines
from mav_robot_status.views.terminal.text import Signs

from .fleet import CRASH, DISARMED, FAILED, PARKED, RADIO, START, STOPPED, Source, lose, put

User = Callable[[Pilot[None]], Awaitable[None]]


def fleet() -> Board:
    """Five robots; the worst is neither the first nor the last."""
    board = Board()
    put(board, system=1)
    put(board, PARKED, system=2, inhibits=(DISARMED,))
    put(board, STOPPED, system=3)
    put(board, FAILED, system=4, errors=(RADIO,))
    lose(board, 5)
    return board


def use(source: Source, user: User, size: tuple[int, int] = (100, 30)) -> WatchApp:
    """Start the screen, and let a user use it."""
    app = WatchApp(source, LogLines(), Signs())

    async def session() -> None:
        async with app.run_test(size=size) as pilot:
            app.look()
            await pilot.pause()
            await user(pilot)

    asyncio.run(session())
    return app


def shown(pilot: Pilot[None]) -> list[str]:
    """The names in the table, from its top."""
    table = pilot.app.query_one(Table)
    return [str(table.get_row_at(i)[1]).strip() for i in range(table.row_count)]


def selected(pilot: Pilot[None]) -> str:
    return shown(pilot)[pilot.app.query_one(Table).cursor_row]


def text_of(pilot: Pilot[None], name: str) -> str:
    return str(pilot.app.query_one(f"#{name}", Static).render())


async def press(pilot: Pilot[None], *keys: str) -> None:
    """Press keys, and wait until the screen shows their effect."""
    await pilot.press(*keys)
    assert isinstance(pilot.app, WatchApp)
    pilot.app.look()
    await pilot.pause()


def test_it_starts_at_the_top_on_the_worst_robot_and_stays_there_until_a_user_moves() -> None:
    source = Source(Board())

    async def user(pilot: Pilot[None]) -> None:
        put(source.board, system=1)
        await press(pilot)
        assert selected(pilot) == "1.1"
        put(source.board, STOPPED, system=3)
        put(source.board, FAILED, system=2, errors=(CRASH,))
        await press(pilot)
        assert shown(pilot) == ["3.1", "2.1", "1.1"]
        assert selected(pilot) == "3.1"
        assert pilot.app.query_one(Table).scroll_y == 0
        assert text_of(pilot, "robot").startswith("■ EMERGENCY STOP  3.1")
        await press(pilot, "down")
        assert selected(pilot) == "2.1"
        put(source.board, PARKED, later(START, 1.0), system=3)
        await press(pilot)
        assert shown(pilot)[0] == "2.1"  # the user's robot moved up, and is still the one
        assert selected(pilot) == "2.1"
        assert text_of(pilot, "robot").startswith("▲ CRASHED  2.1")

    use(source, user)


def test_keys_and_their_old_friends_select_robots() -> None:
    async def user(pilot: Pilot[None]) -> None:
        for key, name in (("j", "4.1"), ("k", "3.1"), ("G", "2.1"), ("g", "3.1"), ("end", "2.1"), ("home", "3.1")):
            await press(pilot, key)
            assert selected(pilot) == name, key
        await press(pilot, "n")
        assert selected(pilot) == "4.1"
        await press(pilot, "n", "n")
        assert selected(pilot) == "3.1"  # around the robots without a problem

    use(Source(fleet()), user)


def test_a_search_shows_what_matches_and_escape_shows_all() -> None:
    async def user(pilot: Pilot[None]) -> None:
        await press(pilot, "slash", *"radio")
        assert shown(pilot) == ["4.1"]
        await press(pilot, "enter", "escape")
        assert len(shown(pilot)) == 5
        await press(pilot, "slash", *"q?nothing")  # in the field these are letters
        assert shown(pilot) == []
        assert "No robot here" in text_of(pilot, "robot")

    use(Source(fleet()), user)


def test_the_counts_are_filters_for_keys_and_mouse() -> None:
    async def user(pilot: Pilot[None]) -> None:
        texts = [str(count.render()).strip() for count in pilot.app.query(Count)]
        assert texts == ["◆ 1 in error", "■ 1 e-stopped", "✗ 1 not heard", "● 2 can move"]
        for key, names in (("1", ["4.1"]), ("2", ["3.1"]), ("3", ["5.1"]), ("4", ["4.1", "1.1"])):
            await press(pilot, key)
            assert shown(pilot) == names
        await press(pilot, "4")
        assert len(shown(pilot)) == 5
        await pilot.click(pilot.app.query(Count)[2])
        await press(pilot)
        assert shown(pilot) == ["5.1"]
        await press(pilot, "0")
        assert len(shown(pilot)) == 5

    use(Source(fleet()), user)


def test_a_column_is_sorted_by_key_and_by_a_click_on_its_title() -> None:
    async def user(pilot: Pilot[None]) -> None:
        await pilot.click(Table, offset=(19, 0))
        await press(pilot)
        assert shown(pilot) == ["1.1", "2.1", "3.1", "4.1", "5.1"]
        await press(pilot, "r")
        assert shown(pilot)[0] == "5.1"
        await press(pilot, "s")
        assert shown(pilot)[0] == "3.1"  # by the cause: the worst first

    use(Source(fleet()), user)


def test_a_click_selects_a_robot() -> None:
    async def user(pilot: Pilot[None]) -> None:
        await pilot.click(Table, offset=(3, 3))
        await press(pilot)
        assert selected(pilot) == "5.1"
        assert text_of(pilot, "robot").startswith("✗ LOST  5.1")

    use(Source(fleet()), user)


def test_the_details_have_evidence_rates_and_changes() -> None:
    source = Source(fleet(), rates={"HEARTBEAT": 1.0})
    source.fields = {"e_stopped": {"rule": "a text", "source": "STATUSTEXT", "age": 0.5, "value": True}}

    async def user(pilot: Pilot[None]) -> None:
        assert source.explained == "vehicle/3"
        await press(pilot, "e")
        assert "1/s: HEARTBEAT 1.0/s" in text_of(pilot, "robot")
        assert "e_stopped       ■ STOPPED       0.5s  a text [STATUSTEXT]" in text_of(pilot, "evidence")
        assert "mode            » AUTO" in text_of(pilot, "changes")
        await press(pilot, "T")
        assert "5.1          link" in text_of(pilot, "changes")
        await press(pilot, "question_mark")
        assert "not a safety function" in text_of(pilot, "robot")
        await press(pilot, "escape")
        assert text_of(pilot, "robot").startswith("■ EMERGENCY STOP")

    use(source, user, (100, 40))


def test_a_tiny_terminal_shows_the_table_and_on_enter_the_details() -> None:
    async def user(pilot: Pilot[None]) -> None:
        pane, table = pilot.app.query_one("#pane"), pilot.app.query_one(Table)
        assert (table.size.height, pane.size.height) == (4, 3)
        assert shown(pilot)[0] == "3.1"
        assert text_of(pilot, "more") == "+2 more (j, PgDn)"
        assert text_of(pilot, "robot").startswith("■ EMERGENCY STOP  3.1")
        await press(pilot, "enter")
        assert (table.size.height, pane.size.height) == (0, 8)
        await press(pilot, "escape")
        assert table.size.height == 4
        await press(pilot, "e")
        assert pane.size.height == 8
        await press(pilot, "escape")
        assert (table.size.height, selected(pilot)) == (4, "3.1")

    use(Source(fleet()), user, (40, 10))


def test_nobody_is_heard_yet() -> None:
    async def user(pilot: Pilot[None]) -> None:
        assert "No heartbeat of an autopilot yet.\nTo find out why: doctor" in text_of(pilot, "robot")
        await press(pilot, "e", "t", "n", "enter", "escape", "s", "j")

    for size in ((80, 24), (40, 10)):
        use(Source(Board()), user, size)


@pytest.mark.parametrize("text", ["[bold red]not markup[/]", "[@click=app.quit]x[/]", "[/]", "\x1b[2J\x07"])
def test_texts_of_a_robot_are_never_markup(text: str) -> None:
    board = Board()
    vehicle = Vehicle(text, text, text, 4, text)
    put(board, FAILED, errors=(CRASH._replace(text=text),), vehicle=vehicle, handle=text, system=None)

    async def user(pilot: Pilot[None]) -> None:
        seen = "".join(c for c in text if c.isprintable())
        plain = text_of(pilot, "robot")
        assert plain.count(seen.removeprefix("[2J")) >= 5
        assert "\x1b" not in plain
        await press(pilot, "T")
        assert "\x1b" not in text_of(pilot, "changes")
        table = pilot.app.query_one(DataTable)
        assert not any("\x1b" in str(cell) for cell in table.get_row_at(0))
        await press(pilot, "slash", *"[/]", "enter", "escape")

    use(Source(board), user, (180, 40))


def test_the_end_of_the_source_and_a_key_end_the_screen() -> None:
    async def nothing(pilot: Pilot[None]) -> None: ...

    async def quit_key(pilot: Pilot[None]) -> None:
        await pilot.press("q")

    assert use(Source(Board(), lambda: None), nothing).return_code == 0
    assert use(Source(fleet()), quit_key).return_code == 0


def test_a_fleet_of_254_is_drawn_in_order() -> None:
    board = Board()
    for system in range(1, 255):
        put(board, PARKED, system=system, inhibits=(DISARMED,))

    async def user(pilot: Pilot[None]) -> None:
        assert shown(pilot)[:2] == ["1.1", "2.1"]
        await press(pilot, "end")
        assert selected(pilot) == "254.1"
        lose(board, 200, later(START, 5.0))
        await press(pilot)
        assert shown(pilot)[0] == "200.1"
        assert selected(pilot) == "254.1"

    use(Source(board), user)


@pytest.fixture(autouse=True)
def _no_colours_of_the_caller(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("NO_COLOR", "COLORTERM"):
        if name in os.environ:
            monkeypatch.delenv(name)
