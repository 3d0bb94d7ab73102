"""The whole screen as lines: a pure function of a state and the size of the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ...clock import rfc3339
from . import table
from .panes import changes, clock, pane, title
from .text import Line, Span, cells, clean, clip, fill, fill_line

if TYPE_CHECKING:
    from .state import State
    from .text import Style

PROGRAM: Final = "mav-robot-status"
KEYS: Final = (("e", "explain"), ("t", "changes"), ("?", "help"), ("q", "quit"))
KEYS_OF_SEVERAL: Final = (("j/k", "select"), ("n", "next problem"))
SMALL: Final = 16
"""The height below which the log is hidden and the titles have one line."""
MOST_DETAILS: Final = 9
"""Lines reserved for the details below a long table."""

LEAST_CONNECTION: Final = 12
"""Cells below which the connection is not shown."""
LEAST_TITLE: Final = 24
"""Cells that the rule reserves for the title of the pane."""


class Layout(NamedTuple):
    """The number of lines of each part."""

    head: int
    rows: int
    pane: int
    log: int


def layout(state: State, width: int, height: int) -> Layout:
    """The parts. Three more lines have the status, the rule above the pane, and the keys."""
    small = height < SMALL
    head = 1 if small else 2
    log = 0 if small else 2 if height < 32 else 4
    room = max(0, height - 3 - head - log)
    vehicles = len(state.vehicles)
    if state.ui.pane == "detail":
        rows = min(vehicles, max(room - MOST_DETAILS, (room + 1) // 2))
    else:
        rows = min(vehicles, max(1, room // 5))
    return Layout(head, rows, room - rows, log)


def settled(state: State, width: int, height: int) -> State:
    """The state with an existing vehicle selected and the scroll position within the pane."""
    chosen = state.chosen
    parts = layout(state, width, height)
    most = max(0, len(pane(state, width)) - parts.pane) if state.ui.scroll else 0
    handle = "" if chosen is None else chosen.handle
    return state._replace(ui=state.ui._replace(handle=handle, scroll=min(state.ui.scroll, most)))


def render(state: State, width: int, height: int) -> list[Line]:
    """Exactly `height` lines of exactly `width` cells."""
    parts = layout(state, width, height)
    shape = table.table(width, state.vehicles, state.glyphs)
    top = min(max(0, state.place - parts.rows // 2), len(state.vehicles) - parts.rows)
    lines = [_first(state, width), *table.head(shape)[-parts.head :]]
    for index in range(top, top + parts.rows):
        lines.append(table.row(shape, state.vehicles[index], index == state.place))
    below = pane(state, width)
    seen = below[state.ui.scroll :][: parts.pane]
    lines.append(_rule(state, width, top, parts, len(below)))
    if state.ui.pane == "detail" and len(seen) < parts.pane:  # the last changes fill the rest
        seen = [*seen, (), *changes(state, several=False)][: parts.pane]
    lines += [fill_line(line, width, state.glyphs) for line in seen]
    lines += [fill_line((), width)] * (parts.pane - len(seen))
    lines += _log(state, width, parts.log)
    lines.append(_keys(state, width))
    return [*lines, *[fill_line((), width)] * (height - len(lines))][:height]


def _first(state: State, width: int) -> Line:
    """The first line: the connection, the number of vehicles and problems, and the time."""
    time = f" {clock(rfc3339(state.now.unix_us))[:8]}Z "
    counts = _counts(state)
    room = width - sum(cells(span.text) for span in counts) - len(time)
    if room <= 0:
        return fill_line([Span(" "), *counts], width, state.glyphs)
    connection = clean(f" {state.connection} ")
    named = f" {PROGRAM} {connection}"
    words = named if cells(named) <= room else connection if room >= LEAST_CONNECTION else ""
    left = fill(words, room, state.glyphs)
    return fill_line([Span(left, "bold"), *counts, Span(time, "soft")], width, state.glyphs)


def _counts(state: State) -> list[Span]:
    lines = [vehicle.line for vehicle in state.vehicles]
    found: list[tuple[int, str, Style]] = [
        (sum(bool(line["in_error"]) for line in lines), "error", "alarm"),
        (sum(bool(line["e_stopped"]) for line in lines), "e-stop", "stop"),
        (sum(vehicle.link != "CONNECTED" for vehicle in state.vehicles), "lost", "alarm"),
    ]
    spans = [Span(f"{len(lines)} vehicle{'' if len(lines) == 1 else 's'}")]
    for count, words, style in found:
        if count:
            spans += [Span(", "), Span(f"{count} {words}", style)]
    return spans


def _rule(state: State, width: int, top: int, parts: Layout, lines: int) -> Line:
    """The line between table and pane. It shows which part of each is visible."""
    rule = state.glyphs.rule
    words = title(state)
    where = []
    if parts.rows < len(state.vehicles):
        where.append(f"rows {top + 1}-{top + parts.rows} of {len(state.vehicles)}")
    if lines > parts.pane > 0:
        where.append(f"lines {state.ui.scroll + 1}-{min(lines, state.ui.scroll + parts.pane)} of {lines}")
    while where and width - cells(", ".join(where)) < LEAST_TITLE:
        where.pop()
    right = f" {', '.join(where)} {rule}" if where else ""
    left = clip(f"{rule} {words} " if words else "", max(0, width - cells(right)), state.glyphs)
    return fill_line(
        [Span(left, "head"), Span(rule * (width - cells(left) - cells(right)), "soft"), Span(right, "soft")],
        width,
        state.glyphs,
    )


def _log(state: State, width: int, height: int) -> list[Line]:
    last = state.log[-height:] if height else ()
    lines = [
        fill_line(
            [
                Span(f" {clock(rfc3339(logged.unix_us))[:8]} ", "soft"),
                Span(clean(logged.text), "warning" if logged.serious else "soft"),
            ],
            width,
            state.glyphs,
        )
        for logged in last
    ]
    return [fill_line((), width)] * (height - len(lines)) + lines


def _keys(state: State, width: int) -> Line:
    keys = [*(KEYS_OF_SEVERAL if len(state.vehicles) > 1 else ()), *KEYS]
    if state.ui.pane != "detail":
        keys.insert(0, ("Esc", "details"))
    while sum(len(key) + len(words) + 3 for key, words in keys) > width + 1 and len(keys) > 1:
        del keys[0]  # help and quit come last, and stay
    spans = []
    for key, words in keys:
        spans += [Span(" " + key, "bold"), Span(f" {words} ", "soft")]
    return fill_line(spans, width, state.glyphs)
