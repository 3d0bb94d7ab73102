"""The screen of `watch`, on Textual: a table, the details of the selected robot, search, sort and filters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import ClassVar, Final

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, VerticalScroll
from textual.driver import Driver
from textual.events import Click
from textual.widgets import DataTable, Footer, Input, Static

from ...language import TONES
from .columns import COLUMNS, Column, cell, columns, name_of, sort_key
from .details import changes, details, evidence, help_lines
from .log_lines import LogLines
from .robots import FILTERS, Memory, Robot, Source, counts, in_order, matches
from .text import Line, Signs, Span

TICK: Final = 0.1
"""The longest delay from a change to the screen, in seconds."""
AGES: Final = 0.5
"""Seconds between two updates of the ages."""
MOST_CHANGES: Final = 100
LOW: Final = 18
"""Below this height there is no room for the details under the table."""


def painted(lines: Iterable[Line]) -> Text:
    """Lines with their styles. Nothing in them is markup."""
    return Text("\n").join(Text.assemble(*line) for line in lines)


class Table(DataTable[Text]):
    """The robots."""

    BINDINGS: ClassVar = [
        Binding("enter", "app.zoom", "details"),
        Binding("j", "cursor_down", show=False),
        Binding("k", "cursor_up", show=False),
        Binding("space", "page_down", show=False),
        Binding("b", "page_up", show=False),
        Binding("g,home", "scroll_top", show=False),
        Binding("G,end", "scroll_bottom", show=False),
    ]


class Count(Static):
    """The number of robots that a filter takes. A click shows only these."""

    def on_click(self, event: Click) -> None:
        """Filter by it."""
        self.app.call_later(self.app.run_action, f"filter({self.name!r})")


class WatchApp(App[None]):
    """Shows a source until it ends or the user quits. The source runs in its own thread and never waits for this."""

    ENABLE_COMMAND_PALETTE = False
    CSS = """
    #counts { height: 1; } #counts Static { width: auto; height: 1; }
    #counts .on { text-style: reverse; }
    Table { height: auto; max-height: 50%; scrollbar-size: 1 1; overflow-x: hidden; }
    Table > .datatable--cursor { color: ansi_default; background: ansi_default; text-style: reverse; }
    .small Table { height: 1fr; max-height: 100%; } #more { height: 1; }
    #pane { height: 1fr; border-top: solid ansi_bright_black; scrollbar-size: 1 1; } #pane Static { height: auto; }
    #log { height: 1; } Input { height: 1; border: none; padding: 0; display: none; }
    .zoomed Table, .zoomed #more { display: none; } .small #pane { height: 3; border: none; }
    .zoomed #pane { height: 1fr; border: none; }
    .small #log { display: none; }
    """
    BINDINGS: ClassVar = [
        Binding("slash", "search", "search"),
        Binding("s", "sort", "sort"),
        Binding("r", "reverse", show=False),
        Binding("n", "problem", "next problem"),
        Binding("e", "pane('evidence')", "evidence"),
        Binding("t", "pane('changes')", "changes"),
        Binding("T", "pane('all')", show=False),
        Binding("question_mark,h", "pane('help')", "help", key_display="?"),
        Binding("escape", "table", show=False),
        Binding("enter", "zoom", show=False),
        *(Binding(one.key, f"filter({one.word!r})", show=False) for one in FILTERS),
        Binding("0", "filter('')", show=False),
        Binding("q,Q", "quit", "quit"),
        Binding("ctrl+c", "quit", show=False, priority=True),
        Binding("ctrl+z", "suspend_process", show=False),
        Binding("ctrl+l", "redraw", show=False),
    ]

    def __init__(self, source: Source, log: LogLines, signs: Signs, driver: type[Driver] | None = None) -> None:
        super().__init__(driver_class=driver, ansi_color=True)
        self.theme = "ansi-dark"  # the palette of the terminal, light or dark
        self._source, self._log_lines, self._signs = source, log, signs
        self._memory = Memory()
        self._all: list[Robot] = []
        self._shown: list[Robot] = []
        self._titles: list[tuple[str, int, str, bool]] = []
        self._cells: dict[str, list[Text]] = {}
        self._drawn: object = None
        self._chosen = ""
        """The handle of the selected robot; empty: the first, until the user selects one."""
        self._only = self._search = ""
        self._sort, self._reverse = "state", False
        self._pane = "robot"

    def compose(self) -> ComposeResult:
        """The parts, from top to bottom."""
        with Horizontal(id="counts"):
            yield Static(id="title", markup=False)
            for one in FILTERS:
                yield Count(name=one.word, markup=False)
        yield Input(placeholder="search", compact=True)
        # the tones are seen under the cursor too
        yield Table(
            cursor_type="row",
            cell_padding=0,
            cursor_foreground_priority="renderable",
            cursor_background_priority="renderable",
        )
        yield Static(id="more", markup=False)
        with VerticalScroll(id="pane", can_focus=False):
            for part in ("robot", "evidence", "changes"):
                yield Static(id=part, markup=False)
        yield Static(id="log", markup=False)
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Begin to look at the source."""
        self.query_one(Table).focus()
        self.set_interval(TICK, self.look)

    def on_resize(self) -> None:
        """The columns follow the width."""
        self.screen.set_class(self.size.height < LOW, "small")
        self._drawn = None

    # -- drawing -------------------------------------------------------------------------------------------------------

    def look(self) -> None:
        """Draw what has changed."""
        source, now = self._source, self._source.now()
        if source.wait(0.0):
            self.exit()
            return
        log = self._log_lines.lines[-1] if self._log_lines.lines else ("", False)
        table = next(iter(self.query(Table)), None)
        if table is None:  # the screen is being closed
            return
        seen = (source.version, now.mono // AGES, log, self.size, self._chosen, self._pane, table.scroll_y, table.size)
        if seen == self._drawn:
            return
        self._drawn = seen
        self._all = self._memory.robots(source.rows(), now)
        wanted = next((one.takes for one in FILTERS if one.word == self._only), lambda _: True)
        found = [robot for robot in self._all if wanted(robot) and matches(robot, self._search)]
        self._shown = in_order(found, sort_key(self._sort), self._reverse)
        self._draw_counts()
        self._draw_table()
        more = len(self._shown) - round(table.scroll_y) - (table.size.height - 1)
        self.query_one("#more", Static).update(f"+{more} more (j, PgDn)")
        self.query_one("#more").display = more > 0 and not self.screen.has_class("zoomed")
        self._draw_pane()
        text, serious = log
        self.query_one("#log", Static).update(
            Text(self._signs.text(text), TONES["warning" if serious else "calm"].terminal)
        )

    def _draw_counts(self) -> None:
        number, of_filter = counts(self._all)
        narrow = self.size.width < 70
        title = f" {number} robot{'' if number == 1 else 's'}  "
        self.query_one("#title", Static).update(
            Text(title if narrow else f" {self._source.connection} {title}", "bold")
        )
        for one, shown in zip(FILTERS, self.query(Count), strict=True):
            count = of_filter[one.word]
            mark = self._signs.symbol(one.look)
            text = f"{mark}{count}" if narrow else f"{mark} {count} {one.word}"
            style = TONES[one.look.tone].terminal if count else "dim"
            shown.update(Text.assemble((text, style), " " if narrow else "  "))
            shown.set_class(one.word == self._only, "on")

    def _draw_table(self) -> None:
        table = self.query_one(Table)
        shown = columns(self.size.width - 1, self._shown)
        rows = {r.handle: [Text.assemble(*cell(column, r, self._signs)) for column in shown] for r in self._shown}
        titles = [(column.name, column.width, self._sort, self._reverse) for column in shown]
        if list(rows) == list(self._cells) and titles == self._titles:
            for handle, cells in rows.items():
                for column, old, new in zip(shown, self._cells[handle], cells, strict=True):
                    if old != new or old.spans != new.spans:
                        table.update_cell(handle, column.name, new)
        else:
            self._rebuild(table, shown, rows)
        self._cells, self._titles = rows, titles

    def _rebuild(self, table: Table, shown: Sequence[Column], rows: Mapping[str, list[Text]]) -> None:
        """Fill the table anew; the same robot stays selected."""
        top = table.scroll_y
        with self.batch_update(), self.prevent(Table.RowHighlighted):
            table.clear(columns=True)
            arrow = "▴" if self._reverse else "▾"
            for column in shown:
                mark = arrow if column.name == self._sort else ""
                table.add_column(Text(column.title + mark), width=column.width, key=column.name)
            for handle, cells in rows.items():
                table.add_row(*cells, key=handle)
            place = list(rows).index(self._chosen) if self._chosen in rows else 0
            table.move_cursor(row=place, scroll=False)
            table.scroll_to(y=top, animate=False, force=True)
            if self._chosen:
                table.move_cursor(row=place, animate=False)

    def _draw_pane(self) -> None:
        signs, source = self._signs, self._source
        robot = self._selected()
        source.explained = "" if robot is None else robot.handle
        parts: dict[str, Iterable[Line]] = {"robot": (), "evidence": (), "changes": ()}
        if self._pane == "help":
            parts["robot"] = help_lines(signs)
        elif self._pane == "all":
            names = {one.handle: name_of(one, signs).text.strip() for one in self._all}
            parts["changes"] = changes(source.changes(list(names), MOST_CHANGES), signs, names)
        elif robot is None:
            text = "No robot here." if self._all else f"No heartbeat of an autopilot yet.\n{source.advice}"
            parts["robot"] = [(Span(line),) for line in text.splitlines()]
        else:
            found = source.explanation()
            parts["robot"] = details(robot, signs)
            parts["evidence"] = evidence(found if found and found["handle"] == robot.handle else None, signs)
            parts["changes"] = changes(source.changes([robot.handle], MOST_CHANGES), signs)
        for name, lines in parts.items():
            shown = painted(lines)
            if shown and name != "robot":
                shown = Text.assemble((f"-- {name} --\n", "dim"), shown)
            self.query_one(f"#{name}", Static).update(shown)

    def _selected(self) -> Robot | None:
        by_handle = {robot.handle: robot for robot in self._shown}
        return by_handle.get(self._chosen) or next(iter(self._shown), None)

    # -- what the user does --------------------------------------------------------------------------------------------

    def on_data_table_row_highlighted(self, event: Table.RowHighlighted) -> None:
        """The cursor was moved. Until somebody moves it, it stays on the first row."""
        handle = str(event.row_key.value or "")
        if self._chosen or (self._shown and handle != self._shown[0].handle):
            self._chosen = handle

    def on_data_table_row_selected(self, event: Table.RowSelected) -> None:
        """A row was clicked."""
        self._chosen = str(event.row_key.value or "")

    def on_data_table_header_selected(self, event: Table.HeaderSelected) -> None:
        """A title was clicked."""
        self._sort_by(str(event.column_key.value))

    def on_input_changed(self, event: Input.Changed) -> None:
        """Search while the user types."""
        self._search, self._drawn = event.value, None

    def on_input_submitted(self) -> None:
        """The search stays; the keys are those of the table again."""
        self.query_one(Table).focus()

    def action_search(self) -> None:
        """Begin to type."""
        field = self.query_one(Input)
        field.display = True
        field.focus()

    def action_filter(self, word: str) -> None:
        """Show only what a filter takes; the same filter again: all."""
        self._only, self._drawn = "" if word == self._only else word, None

    def action_sort(self) -> None:
        """Sort by the next column."""
        names = [name for name, *_ in self._titles] or [COLUMNS[0].name]
        at = names.index(self._sort) if self._sort in names else -1
        self._sort_by(names[(at + 1) % len(names)])

    def _sort_by(self, name: str) -> None:
        self._reverse = not self._reverse if name == self._sort else False
        self._sort, self._drawn = name, None

    def action_reverse(self) -> None:
        """Reverse the order."""
        self._reverse, self._drawn = not self._reverse, None

    def action_problem(self) -> None:
        """Select the next robot with a problem."""
        handles = [robot.handle for robot in self._shown]
        at = handles.index(self._chosen) if self._chosen in handles else -1
        turned = self._shown[at + 1 :] + self._shown[: at + 1]
        found = next((robot.handle for robot in turned if robot.has_problem), None)
        if found is not None:
            self.query_one(Table).move_cursor(row=handles.index(found))

    def action_pane(self, name: str) -> None:
        """Show a part of the details; the same part again: back."""
        if self._pane == name:
            self.action_table()
            return
        self._pane, self._drawn = name, None
        small = self.screen.has_class("small")
        self.screen.set_class(small or self.screen.has_class("zoomed"), "zoomed")
        pane = self.query_one("#pane", VerticalScroll)
        target = f"#{name}" if name in ("evidence", "changes") else "#robot"
        self.look()
        pane.can_focus = True
        pane.focus()
        self.call_after_refresh(pane.scroll_to_widget, self.query_one(target), top=True, animate=False)

    def action_zoom(self) -> None:
        """The details on the whole screen."""
        if self.screen.has_class("zoomed"):
            self.action_table()
        else:
            self.screen.add_class("zoomed")
            self.action_pane("whole")

    def action_table(self) -> None:
        """The table, with everything in it, and the details below it."""
        self.screen.remove_class("zoomed")
        if self._pane == "robot":
            field = self.query_one(Input)
            field.value, field.display, self._only = "", False, ""
        self._pane, self._drawn = "robot", None
        pane = self.query_one("#pane", VerticalScroll)
        pane.can_focus = False
        pane.scroll_home(animate=False)
        self.query_one(Table).focus()

    def action_redraw(self) -> None:
        """Draw the whole screen again."""
        self.refresh(repaint=True, layout=True)
