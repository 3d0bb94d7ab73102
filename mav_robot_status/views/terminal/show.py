"""Shows a source: on a screen with keys, or without a terminal as one line for each change."""

from __future__ import annotations

import locale
import os
import select
import sys
from typing import TYPE_CHECKING, Any, Final, Protocol

from . import keys, table
from .paint import painter
from .render import layout, render, settled
from .state import State, Ui, Vehicle
from .strip import Strip
from .text import ASCII, UNICODE, encode, plain
from .tty import Screen, is_screen

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ...clock import Instant
    from .state import Change
    from .text import Glyphs

TICK: Final = 0.1
"""The longest delay from a change to the screen, in seconds."""
AGES: Final = 0.5
"""Seconds between two updates of the ages."""
MOST_CHANGES: Final = 500
"""The limit on changes in the pane, over all vehicles."""
LINE_WIDTH: Final = 1000
"""The width of a line without a screen, in cells. It takes at most 4000 bytes."""
LINE_NAME: Final = 7
"""The width of the ids in such a line: `255.255`."""


class Row(Protocol):
    """One vehicle of a source."""

    @property
    def line(self) -> Mapping[str, Any]:
        """Its status: the members of a native JSON line."""

    @property
    def stamp(self) -> str:
        """The time of the status, RFC 3339."""

    @property
    def version(self) -> int:
        """A number that differs after every change."""

    @property
    def age(self) -> float | None:
        """Seconds since the last heartbeat; None if there was none."""

    @property
    def rates(self) -> Mapping[str, float]:
        """The rate (Hz) of each message that its status depends on, by name."""


class Source(Protocol):
    """The source of the statuses."""

    connection: str
    """The MAVLink connection, as on the command line."""
    advice: str
    """A remedy, shown until the first heartbeat."""
    explained: str
    """The handle to explain; empty: none."""

    @property
    def version(self) -> int:
        """A number that differs after every change of any vehicle."""

    def now(self) -> Instant:
        """The current time."""

    def wait(self, seconds: float) -> bool:
        """Wait; return whether the source ends within these seconds."""

    def rows(self) -> Sequence[Row]:
        """The vehicles, in the order of the table."""

    def changes(self, handles: Sequence[str], most: int) -> Sequence[tuple[str, Change]]:
        """The changes of these vehicles, each with its handle, the latest first."""

    def explanation(self) -> Mapping[str, Any] | None:
        """The latest explanation of the handle `explained`."""


def show(source: Source) -> None:
    """Show a source until it ends or the user quits (by a key, or by a signal as KeyboardInterrupt)."""
    glyphs = UNICODE if locale.nl_langinfo(locale.CODESET).upper().replace("-", "") == "UTF8" else ASCII
    if is_screen():
        strip = Strip()
        with strip.instead_of_stderr(), Screen() as screen:
            _Show(source, screen, strip, glyphs).run()
    else:
        known = sys.stdout.encoding.upper().startswith("UTF")
        show_lines(source, sys.stdout.fileno(), glyphs if known else ASCII)


class _Show:
    """The loop: it applies keys to the state and draws changes."""

    def __init__(self, source: Source, screen: Screen, strip: Strip, glyphs: Glyphs) -> None:
        self._source = source
        self._screen = screen
        self._strip = strip
        self._glyphs = glyphs
        self._paint = painter()
        self._keyboard = keys.Keyboard()
        self._ui = Ui()
        self._drawn: object = None

    def run(self) -> None:
        """Run until the source ends, the user quits, or the terminal is closed."""
        while not self._source.wait(0.0):
            self._draw()
            typed = self._screen.wait(TICK)
            if typed is None:
                return
            pressed = self._keyboard.feed(typed) if typed else self._keyboard.flush()
            if "end" in pressed:
                return
            for action in pressed:
                self._press(action)

    def _press(self, action: str) -> None:
        if action == "redraw":
            self._screen.forget()
            self._drawn = None
            return
        size = self._screen.size()
        state = self._state()
        parts = layout(state, *size)
        state = settled(keys.press(state, action, parts.rows, parts.pane), *size)
        self._ui = state.ui
        self._source.explained = state.ui.handle if state.ui.pane == "explain" else ""

    def _draw(self) -> None:
        """Draw the screen if anything may have changed."""
        size = self._screen.size()
        now = self._source.now()
        seen = (size, self._ui, self._strip.count, self._source.version, now.mono // AGES)
        if seen == self._drawn:
            return
        state = settled(self._state(), *size)
        self._ui = state.ui
        lines = [encode(self._paint(line), self._glyphs) for line in render(state, *size)]
        if self._screen.show(lines):
            self._drawn = seen

    def _state(self) -> State:
        source, ui = self._source, self._ui
        vehicles = tuple(Vehicle(row.line, row.age, row.rates) for row in source.rows())
        state = State(
            source.connection,
            source.now(),
            vehicles,
            ui,
            log=self._strip.lines,
            advice=source.advice,
            glyphs=self._glyphs,
        )
        chosen = state.chosen
        if chosen is None:
            return state
        if ui.pane == "explain":
            found = source.explanation()
            return state._replace(explanation=found if found and found["handle"] == chosen.handle else None)
        names = {vehicle.handle: vehicle.name for vehicle in vehicles}
        of = list(names) if ui.pane == "all transitions" else [chosen.handle]
        changes = source.changes(of, MOST_CHANGES)
        return state._replace(changes=tuple((names[handle], change) for handle, change in changes))


def show_lines(source: Source, descriptor: int, glyphs: Glyphs) -> None:
    """Print the titles, then one row of the table with the time for each change of a vehicle.

    This never waits for a slow reader, which gets the latest status when it reads again. Raises BrokenPipeError after
    the reader has closed its end.
    """
    shape = table.table(LINE_WIDTH, [], glyphs)._replace(size=table.NORMAL, name_width=LINE_NAME)
    above, titles = table.head(shape)
    waiting = [("", above), ("time", titles)]
    versions: dict[str, int] = {}
    reader = select.poll()
    reader.register(descriptor, select.POLLOUT)
    ended = False
    while not ended:
        ended = source.wait(TICK)
        for row in source.rows():
            vehicle = Vehicle(row.line, row.age)
            if versions.get(vehicle.handle) == row.version or not _has_room(reader):
                continue
            versions[vehicle.handle] = row.version
            waiting.append((row.stamp[:21] + "Z", table.row(shape, vehicle, False)))
            for time, line in waiting:
                os.write(descriptor, encode(f"{time:<22}{plain(line)}".rstrip() + "\n", glyphs))
            waiting = []
        _has_room(reader)


def _has_room(reader: select.poll) -> bool:
    """Whether a write of one line does not block. A writable pipe has room for 4096 bytes."""
    events = reader.poll(0)
    if events and events[0][1] & (select.POLLERR | select.POLLHUP | select.POLLNVAL):
        raise BrokenPipeError("the reader of the table has closed its end")
    return bool(events)
