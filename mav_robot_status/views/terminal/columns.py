"""The columns of the table. Which of them are shown depends on the width of the terminal only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, Final, NamedTuple

from ...interface import STATES
from ...language import LINK, look
from .robots import Order, Robot, by_name, by_urgency
from .text import Line, Signs, Span, cells, clock, duration, fill, padded, toned


class Column(NamedTuple):
    """One column."""

    name: str
    """The field that it shows, or what it is."""
    title: str
    width: int
    """In cells, with the space after it."""
    least: int
    """The width of the terminal from which it is shown."""
    cell: Callable[[Robot, Signs], Span]
    order: Order


TITLES: Final = {
    "e_stopped": ("e-stop", 7, 70),
    "drives_powered": ("power", 7, 70),
    "motion_possible": ("can", 6, 98),
    "in_motion": ("motion", 7, 98),
    "in_error": ("error", 6, 98),
    "mode": ("mode", 9, 70),
}
"""Title, width, and the least width of the terminal. A field without a row has its name as title, from WIDEST."""
WIDEST: Final = 158
LEAST_WHY: Final = 12
"""The width below which only the details show the reasons."""
INDENT: Final = "  "
"""Before the name of a member, whose row is below that of its group."""


def name_of(robot: Robot, signs: Signs) -> Span:
    """The first cell of a row."""
    return Span((INDENT if robot.group else "") + signs.text(robot.name), "bold")


def state(robot: Robot, signs: Signs) -> Span:
    """The word of the headline, with its symbol."""
    top = robot.headline
    return toned(f"{signs.symbol(top)} {top.word}", top.tone)


def why(robot: Robot, signs: Signs) -> Span:
    """The sentences of the headline."""
    text = " ".join(sentence.plain(clock) for sentence in robot.headline.sentences)
    return Span(signs.text(text.removeprefix("Cannot move: ")))


def _heard(robot: Robot, signs: Signs) -> Span:
    """The time since it was last heard."""
    age = "never" if robot.row.age is None else duration(robot.row.age)
    return Span(age) if robot.link == "CONNECTED" else toned(age, look(LINK, robot.link).tone)


def column_of(name: str) -> Column:
    """The column of a field."""
    title, width, least = TITLES.get(name, (name, max(6, len(name)) + 1, WIDEST))
    return Column(
        name,
        title,
        width,
        least,
        lambda robot, signs: signs.of(look(name, robot.line[name]), width - 1),
        lambda robot: str(robot.line[name]),
    )


def _vehicle(name: str, title: str, width: int, least: int) -> Column:
    return Column(
        name,
        title,
        width,
        least,
        lambda robot, signs: Span(signs.text(robot.line["vehicle"].get(name) or "")),
        lambda robot: str(robot.line["vehicle"].get(name) or ""),
    )


NAME: Final = Column("name", "robot", 6, 0, name_of, by_name)
"""Its width fits the names."""
WHY: Final = Column("why", "why", 0, 0, why, by_urgency)
"""Its width is what the others leave."""
COLUMNS: Final = (
    NAME,
    Column("state", "state", 18, 0, state, by_urgency),
    _vehicle("type", "type", 16, 148),
    _vehicle("flight_mode", "flight mode", 14, 118),
    *(column_of(field.name) for field in STATES),
    Column("heard", "heard", 6, 0, _heard, lambda robot: -(robot.row.age if robot.row.age is not None else 1e9)),
    Column(
        "rate",
        "msg/s",
        6,
        108,
        lambda robot, signs: Span(f"{sum(robot.row.rates.values()):.0f}/s"),
        lambda robot: -sum(robot.row.rates.values()),
    ),
    WHY,
)
LONGEST_NAME: Final = 16


def columns(width: int, robots: Sequence[Robot]) -> list[Column]:
    """The columns for a terminal of this width and for these robots, with their widths."""
    names = max((cells(name_of(robot, Signs()).text) for robot in robots), default=0)
    shown = [column for column in COLUMNS if column.least <= width and column is not WHY]
    shown[0] = NAME._replace(width=max(NAME.width, min(LONGEST_NAME, names) + 1))
    rest = width - sum(column.width for column in shown)
    return [*shown, WHY._replace(width=rest)] if rest >= LEAST_WHY else shown


def head(shown: Sequence[Column]) -> Line:
    """The titles."""
    return tuple(Span(fill(column.title, column.width), "bold") for column in shown)


def cell(column: Column, robot: Robot, signs: Signs) -> Line:
    """One cell in exactly the width of its column, with a space at its end."""
    return padded(column.cell(robot, signs), column.width)


def sort_key(name: str) -> Any:
    """The order of a column."""
    return next(column.order for column in COLUMNS if column.name == name)
