"""The columns of the table. Which of them are shown depends on the width of the terminal only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from ...interface import STATES
from ...language import LINK, ROBOT_STATES, look
from .robots import Order, Robot, by_name, by_urgency
from .text import Line, Signs, Span, cells, clock, duration, fill, padded, toned


class Column(NamedTuple):
    """One column."""

    name: str
    """The field that it shows, or what it is."""
    title: str
    width: int
    """In cells, with the space after it."""
    keep: int
    """When the terminal is narrow, columns with a small number are left out first."""
    cell: Callable[[Robot, Signs], Span]
    order: Order


TITLES: Final = {
    "mode": ("mode", 9, 7),
    "drives_powered": ("power", 7, 6),
    "e_stopped": ("e-stop", 7, 5),
    "motion_possible": ("can", 6, 4),
    "in_motion": ("motion", 7, 4),
    "in_error": ("error", 6, 4),
}
"""Title, width, and how long it is kept. A field without a row has its name as title, and goes first."""
ENOUGH: Final = 40
"""Cells of `why` from which there is room for another column."""
LEAST_WHY: Final = 21
"""Cells of `why` from which there is room for the column `heard`: twenty letters and a space."""
ALWAYS: Final = 9
INDENT: Final = "  "
"""Before the name of a member, whose row is below that of its group."""


def name_of(robot: Robot, signs: Signs) -> Span:
    """The name of the robot."""
    return Span((INDENT if robot.group else "") + signs.text(robot.name), "bold")


def state(robot: Robot, signs: Signs) -> Span:
    """The first cell of a row: the word of the headline, with its symbol."""
    top = robot.headline
    return toned(f"{signs.symbol(top.state)} {top.word}", top.tone)


def why(robot: Robot, signs: Signs) -> Span:
    """The sentences of the headline."""
    return Span(signs.text(" ".join(sentence.plain(clock) for sentence in robot.headline.sentences)))


def _heard(robot: Robot, signs: Signs) -> Span:
    """The time since it was last heard."""
    age = "never" if robot.row.age is None else duration(robot.row.age)
    return Span(age) if robot.link == "CONNECTED" else toned(age, look(LINK, robot.link).tone)


def column_of(name: str) -> Column:
    """The column of a field."""
    title, width, keep = TITLES.get(name, (name, max(6, len(name)) + 1, 0))
    return Column(
        name,
        title,
        width,
        keep,
        lambda robot, signs: signs.of(look(name, robot.line[name]), width - 1),
        lambda robot: str(robot.line[name]),
    )


def _vehicle(name: str, title: str, width: int, keep: int) -> Column:
    return Column(
        name,
        title,
        width,
        keep,
        lambda robot, signs: Span(signs.text(robot.line["vehicle"].get(name) or "")),
        lambda robot: str(robot.line["vehicle"].get(name) or ""),
    )


STATE: Final = Column("state", "state", 17, ALWAYS, state, by_urgency)
"""Its width fits the words."""
NAME: Final = Column("name", "robot", 6, ALWAYS, name_of, by_name)
"""Its width fits the names."""
WHY: Final = Column("why", "why", LEAST_WHY, ALWAYS, why, by_urgency)
"""Its width is what the others leave."""
HEARD: Final = Column(
    "heard", "heard", 6, 8, _heard, lambda robot: -(robot.row.age if robot.row.age is not None else 1e9)
)
COLUMNS: Final = (
    STATE,
    NAME,
    WHY,
    HEARD,
    *sorted((column_of(field.name) for field in STATES), key=lambda column: -column.keep),
    Column(
        "rate",
        "msg/s",
        6,
        3,
        lambda robot, signs: Span(f"{sum(robot.row.rates.values()):.0f}/s"),
        lambda robot: -sum(robot.row.rates.values()),
    ),
    _vehicle("flight_mode", "flight mode", 14, 2),
    _vehicle("type", "type", 16, 1),
)
LONGEST_NAME: Final = 16
LONGEST_WORD: Final = max(len(one.word) for one in ROBOT_STATES)
NARROW: Final = 60
"""The width below which the first column is as wide as the words in it."""


def columns(width: int, robots: Sequence[Robot]) -> list[Column]:
    """The columns for a terminal of this width and for these robots, with their widths."""
    words = max(len(robot.headline.word) for robot in robots) if robots and width < NARROW else LONGEST_WORD
    names = max((cells(name_of(robot, Signs()).text) for robot in robots), default=0)
    widths = {"state": max(len("state"), words + 2) + 1, "name": max(NAME.width, min(LONGEST_NAME, names) + 1)}
    shown = [column._replace(width=widths.get(column.name, column.width)) for column in COLUMNS]
    for going in sorted(shown, key=lambda column: column.keep):
        rest = width - sum(column.width for column in shown if column.name != WHY.name)
        if going.keep == ALWAYS or rest >= (LEAST_WHY if going.name == HEARD.name else ENOUGH):
            break
        shown.remove(going)
    rest = width - sum(column.width for column in shown if column.name != WHY.name)
    return [column._replace(width=max(0, rest)) if column.name == WHY.name else column for column in shown]


def head(shown: Sequence[Column]) -> Line:
    """The titles."""
    return tuple(Span(fill(column.title, column.width), "bold") for column in shown)


def cell(column: Column, robot: Robot, signs: Signs) -> Line:
    """One cell in exactly the width of its column, with a space at its end."""
    return padded(column.cell(robot, signs), column.width)


def sort_key(name: str) -> Any:
    """The order of a column."""
    return next(column.order for column in COLUMNS if column.name == name)
