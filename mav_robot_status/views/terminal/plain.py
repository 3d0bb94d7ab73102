"""The table without Textual: drawn again and again on a terminal, or one line for each change in a pipe.

It scrolls with the keys of `less`.
"""

from __future__ import annotations

import os
import re
import select
import termios
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import groupby
from typing import Final

from . import terminal_size
from .columns import Column, cell, columns, head
from .details import details
from .robots import Memory, Robot, Source, counts, in_order
from .text import CUT, Line, Signs, Span, wrap

PERIOD: Final = 0.25
"""Seconds between two drawings."""
WIDE: Final = 240
"""The width of a line in a pipe, in cells. It takes less than the 4096 bytes for which a writable pipe has room."""
PALETTE: Final = ("black", "red", "green", "yellow", "blue", "magenta", "cyan", "white")
CODES: Final = {"bold": 1, "dim": 2} | {name: 30 + i for i, name in enumerate(PALETTE)}
MOST_KEYS: Final = 64
GROUNDS: Final = {f"on {name}": 40 + i for i, name in enumerate(PALETTE)}


UTF8: Final = Signs()
NARROW: Final = 70
KEYS: Final = {"j": 1, "\x1b[B": 1, "k": -1, "\x1b[A": -1}
"""By how many rows a key scrolls."""
PAGES: Final = {" ": 1, "\x1b[6~": 1, "b": -1, "\x1b[5~": -1, "G": 10**6, "g": -(10**6)}
"""By how many pages."""


def page_of(robots: int, room: int) -> int:
    """How many rows of robots there are among `room` lines. The details of the first one keep a few."""
    rest = room - 2 - (6 if room >= 12 else 4 if room >= 8 else 0)
    return max(1, robots if robots <= rest else rest - 1)


def screen(
    source: Source, robots: list[Robot], size: os.terminal_size, signs: Signs, room: int = 10**6, top: int = 0
) -> Iterator[Line]:
    """The lines of one screen: the counts, the rows from `top` on, the details of as many of these robots as fit."""
    number, of_filter = counts(robots)
    told = "".join(f", {count} {word}" for word, count in of_filter.items() if count)
    where = "" if size.columns < NARROW else f"{source.connection}  "
    yield (Span(f"{where}{number} robot{'' if number == 1 else 's'}{told}"[: size.columns], "bold"),)
    ordered = in_order(robots)
    shown = columns(size.columns, ordered)
    yield head(shown)
    seen = ordered[top : top + page_of(len(robots), room)]
    yield from (_row(shown, robot, signs) for robot in seen)
    if more := len(ordered) - top - len(seen):
        yield (Span(f"+{more} more (j, PgDn)", "bold"),)
    if not robots:
        yield (Span(f"No heartbeat of an autopilot yet. {source.advice}"),)
    for robot in seen:
        yield () if room >= 12 else (Span("-" * size.columns, "dim"),)
        yield from details(robot, signs)


def _row(shown: Sequence[Column], robot: Robot, signs: Signs) -> Line:
    return tuple(span for column in shown for span in cell(column, robot, signs))


def frame(lines: Iterator[Line], last: list[Line], size: os.terminal_size, colours: bool, signs: Signs = UTF8) -> str:
    """The lines as one text for the terminal, cut to its size. The `last` ones stand at its bottom."""
    room = size.lines - len(last)
    body: list[Line] = []
    for line in lines:
        body += wrap(line, size.columns)
        if len(body) >= room:
            break
    body = body[:room] + [()] * (room - len(body)) + [next(wrap(line, size.columns)) for line in last]
    text = "\x1b[H" + "\x1b[K\r\n".join(_painted(line, colours) for line in body) + "\x1b[K\x1b[J"
    return text if signs.utf8 else text.replace(CUT, ".")


def _painted(line: Line, colours: bool) -> str:
    runs = [(style, "".join(span.text for span in run)) for style, run in groupby(line, key=lambda span: span.style)]
    return "".join(f"\x1b[{_sgr(style)}m{text}\x1b[0m" if style and colours else text for style, text in runs)


def _sgr(style: str) -> str:
    words, _, ground = style.partition("on ")
    codes = [CODES[word] for word in words.split()] + ([GROUNDS[f"on {ground}"]] if ground else [])
    return ";".join(map(str, codes))


def redraw(source: Source, signs: Signs, footer: Callable[[], Sequence[str]]) -> None:
    """Draw the table, and below it the lines of `footer`, until the source ends or `q` is pressed.

    A signal raises KeyboardInterrupt.
    """
    reader = _reader()
    memory, colours, drawn, top = Memory(), "NO_COLOR" not in os.environ, "", 0
    _write("\n" * (terminal_size().lines - 1))  # what was on the screen can be scrolled back to
    try:
        with _keys() as typed:
            while not source.wait(PERIOD):
                size, pressed = terminal_size(), typed()
                if pressed in ("q", "Q"):
                    return
                robots = memory.robots(source.rows(), source.now())
                last: list[Line] = [(Span(signs.text(text), "bold"),) for text in footer()]
                room = size.lines - len(last)
                page = page_of(len(robots), room)
                top = max(0, min(top + KEYS.get(pressed, 0) + page * PAGES.get(pressed, 0), len(robots) - page))
                text = frame(screen(source, robots, size, signs, room, top), last, size, colours, signs)
                if text != drawn and _has_room(reader):
                    _write(text)
                    drawn = text
    except KeyboardInterrupt:
        # a terminal that nobody reads is full: without room the closing lines of the log would wait for a reader
        termios.tcflush(1, termios.TCOFLUSH)
        raise
    finally:
        if _has_room(reader):
            _write("\n")


@contextmanager
def _keys(descriptor: int = 0) -> Iterator[Callable[[], str]]:
    """Takes keys one by one, without their echo; what it gives returns the pressed key, or an empty text."""
    before = termios.tcgetattr(descriptor)
    now = termios.tcgetattr(descriptor)
    now[3] &= ~(termios.ICANON | termios.ECHO)
    termios.tcsetattr(descriptor, termios.TCSANOW, now)
    asked = select.poll()
    asked.register(descriptor, select.POLLIN)
    typed: list[str] = []

    def key() -> str:
        if asked.poll(0):
            typed.extend(_split(os.read(descriptor, 256).decode("ascii", "replace")))
        return typed.pop(0) if typed else ""

    try:
        yield key
    finally:
        termios.tcsetattr(descriptor, termios.TCSANOW, before)


def _split(text: str) -> list[str]:
    """Each key of what was typed; an arrow is several characters."""
    return re.findall(r"\x1b\[[0-9;]*[A-Za-z~]|.", text, re.DOTALL)[:MOST_KEYS]


def print_changes(source: Source, signs: Signs, descriptor: int = 1) -> None:
    """Write a line for each change of a robot. It waits for no slow reader, which later gets the latest status.

    Raises BrokenPipeError after the reader has closed its end.
    """
    memory, versions, reader, ended = Memory(), dict[str, int](), _reader(descriptor), False
    shown = sorted(columns(WIDE, []), key=lambda column: column.name == "why")  # at the end, where it has room
    waiting = f"{'time':<23}" + "".join(span.text for span in head(shown)).rstrip() + "\n"
    while not ended:
        ended = source.wait(PERIOD)
        for robot in memory.robots(source.rows(), source.now()):
            if versions.get(robot.handle) != robot.row.version and _has_room(reader):
                versions[robot.handle] = robot.row.version
                text = "".join(span.text for span in _row(shown, robot, signs)).rstrip()
                text = text if signs.utf8 else text.replace(CUT, ".")
                _write(waiting + f"{robot.row.stamp[:21]}Z {text}\n", descriptor)
                waiting = ""
        _has_room(reader)


def _reader(descriptor: int = 1) -> select.poll:
    reader = select.poll()
    reader.register(descriptor, select.POLLOUT)
    return reader


def _has_room(reader: select.poll) -> bool:
    """Whether a write of one line does not block."""
    events = reader.poll(0)
    if events and events[0][1] & (select.POLLERR | select.POLLHUP | select.POLLNVAL):
        raise BrokenPipeError("the reader of the table has closed its end")
    return bool(events)


def _write(text: str, descriptor: int = 1) -> None:
    data = text.encode()
    while data:
        data = data[os.write(descriptor, data) :]
