"""Shows what a source knows: on a screen with keys, or, where there is none, as one line for each change."""

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
"""Seconds from a change to the screen, at most."""
AGES: Final = 0.5
"""Seconds until what only grows older is drawn anew."""
MOST_CHANGES: Final = 500
"""Changes that the pane has, of however many vehicles."""
LINE_WIDTH: Final = 1000
"""Cells that a line may take where there is no screen: at most 4000 bytes."""
LINE_NAME: Final = 7
"""Cells of the ids there: `255.255`."""


class Row(Protocol):
    """What the source knows of one vehicle."""

    @property
    def line(self) -> Mapping[str, Any]:
        """Its status: the members of a native JSON line."""

    @property
    def stamp(self) -> str:
        """When it was so, RFC 3339."""

    @property
    def version(self) -> int:
        """Another number for every change."""

    @property
    def age(self) -> float | None:
        """Seconds since the last heartbeat; None if there was none."""

    @property
    def rates(self) -> Mapping[str, float]:
        """Hz of the messages that its status is made of, by name."""


class Source(Protocol):
    """Where the statuses come from."""

    connection: str
    """Where MAVLink comes from, as the person wrote it."""
    advice: str
    """What to do if no vehicle is heard."""
    explained: str
    """The handle that is to be explained from now on; empty: none."""

    @property
    def version(self) -> int:
        """Another number for every change of any vehicle."""

    def now(self) -> Instant:
        """The present."""

    def wait(self, seconds: float) -> bool:
        """Whether it ends within so many seconds."""

    def rows(self) -> Sequence[Row]:
        """The vehicles, in the order of the table."""

    def changes(self, handles: Sequence[str], most: int) -> Sequence[tuple[str, Change]]:
        """The latest changes of these vehicles, the latest first, each with the handle."""

    def explanation(self) -> Mapping[str, Any] | None:
        """The latest explanation of what is to be explained."""


def show(source: Source) -> None:
    """Show it until it ends, or the person ends it (a key, or a signal as KeyboardInterrupt)."""
    glyphs = UNICODE if locale.nl_langinfo(locale.CODESET).upper().replace("-", "") == "UTF8" else ASCII
    if is_screen():
        strip = Strip()
        with strip.instead_of_stderr(), Screen() as screen:
            _Show(source, screen, strip, glyphs).run()
    else:
        known = sys.stdout.encoding.upper().startswith("UTF")
        show_lines(source, sys.stdout.fileno(), glyphs if known else ASCII)


class _Show:
    """The loop: keys change the state, and what has changed is drawn."""

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
        """Until the source ends, the person does, or the terminal is gone."""
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
        """Draw, if anything may have changed."""
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
    """One row of the table for each change of a vehicle, with the time; the titles come first.

    A reader that is too slow is not waited for: when it reads again it gets the latest. Raises BrokenPipeError once
    nobody reads.
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
    """Whether a line can be written without waiting (a pipe that takes anything takes 4096 bytes)."""
    events = reader.poll(0)
    if events and events[0][1] & (select.POLLERR | select.POLLHUP | select.POLLNVAL):
        raise BrokenPipeError("the reader of the table has gone")
    return bool(events)
