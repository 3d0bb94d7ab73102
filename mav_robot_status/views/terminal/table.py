"""The table: one row for each vehicle. The columns and their widths depend on the terminal's width only."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...interface import STATES, Field, Kind
from .state import Vehicle, duration
from .text import Line, Span, cells, clean, clip, fill, fill_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from .text import Glyphs, Style

    Cell = Callable[[Vehicle, int, Glyphs], Span]

NARROW, NORMAL, WIDE, WIDEST = range(4)
FROM: Final = (0, 70, 118, 150)
"""The smallest terminal width of each size."""
LONGEST_NAME: Final = 12
LEAST_WHY: Final = 6
"""The width below which only the pane shows the reasons."""
ALARMING: Final[dict[str, Style]] = {"e_stopped": "stop", "in_error": "alarm"}
WORDS: Final = {True: "YES", False: "no", None: "unk"}


Titles = tuple[str, str, str, str]
Widths = tuple[int, int, int, int]


class Column(NamedTuple):
    """One column, in each of the four sizes."""

    titles: Titles
    """Two lines, separated by a bar."""
    widths: Widths
    """In cells; 0: the column is hidden."""
    cell: Cell
    """The content for a vehicle; the width is in cells."""


TITLES: Final[dict[str, tuple[Titles, Widths]]] = {
    "mode": (("|mode",) * 4, (4, 6, 6, 6)),
    "e_stopped": (("e-|stop", "|e-stop", "e_|stopped", "e_|stopped"), (4, 6, 7, 7)),
    "drives_powered": (("drv|powr", "drive|power", "drives_|powered", "drives_|powered"), (4, 5, 7, 7)),
    "motion_possible": (("can|move", "can|move", "motion_|possible", "motion_|possible"), (4, 5, 8, 8)),
    "in_motion": (("in|motn", "in|motion", "in_|motion", "in_|motion"), (4, 6, 6, 6)),
    "in_error": (("in|err", "in|error", "in_|error", "in_|error"), (4, 5, 5, 5)),
}
"""Titles and widths of fields whose name is a poor title."""


def shown(field: Field, value: Any, glyphs: Glyphs) -> Span:
    """The JSON value of a field, as the table shows it."""
    return mode(value, glyphs) if field.kind is Kind.MODE else tri_state(field.name, value, glyphs)


def tri_state(field: str, value: bool | None, glyphs: Glyphs, tight: bool = False) -> Span:
    """`● YES`, `○ no` or `? unk`. Symbol, word and style all differ."""
    symbol = {True: glyphs.yes, False: glyphs.no, None: glyphs.unknown}[value]
    style: Style = "unknown" if value is None else ALARMING.get(field, "on") if value else ""
    return Span(symbol + ("" if tight else " ") + WORDS[value], style)


def mode(value: str, glyphs: Glyphs, width: int = 6) -> Span:
    """AUTO, MANUAL (MAN in a narrow column), or unknown."""
    if value == "UNKNOWN":
        return Span(f"{glyphs.unknown}unk" if width < 5 else f"{glyphs.unknown} unk", "unknown")
    return Span(value if len(value) <= width else value[:3], "bold" if value == "AUTO" else "")


def _column(field: Field) -> Column:
    """The column of a field. Without a row in TITLES it shows the field's name, from size NORMAL up."""
    head, _, tail = field.name.rpartition("_")
    split = f"{head}_|{tail}" if head else f"|{tail}"
    least = max(6, len(tail), len(head) + 1)
    titles, widths = TITLES.get(field.name, (("", split, split, split), (0, least, least, least)))
    return Column(titles, widths, _mode(field) if field.kind is Kind.MODE else _tri_state(field))


def _mode(field: Field) -> Cell:
    return lambda vehicle, width, glyphs: mode(vehicle.line[field.name], glyphs, width)


def _tri_state(field: Field) -> Cell:
    return lambda vehicle, width, glyphs: tri_state(field.name, vehicle.line[field.name], glyphs, width < 5)


def _text(group: str, name: str) -> Cell:
    return lambda vehicle, width, glyphs: Span(clean(vehicle.line[group][name] or ""))


def _link(vehicle: Vehicle, width: int, glyphs: Glyphs) -> Span:
    if vehicle.age is None:
        return Span("never", "alarm")
    age = duration(vehicle.age)
    return (
        Span(age)
        if vehicle.link == "CONNECTED"
        else Span(f"{glyphs.lost}{age}" if width < 5 else f"{glyphs.lost} {age}", "alarm")
    )


def _rate(vehicle: Vehicle, width: int, glyphs: Glyphs) -> Span:
    return Span(f"{sum(vehicle.rates.values()):{width - 2}.0f}/s")


COLUMNS: Final = (
    Column(("|type",) * 4, (0, 0, 0, 14), _text("vehicle", "type")),
    Column(("|flight mode",) * 4, (0, 12, 14, 16), _text("vehicle", "flight_mode")),
    *map(_column, STATES),
    Column(("link|age", "link|age", "link|age", "link|age"), (4, 5, 6, 6), _link),
    Column(("", "", "messages|", "messages|"), (0, 0, 8, 8), _rate),
)


class Table(NamedTuple):
    """The columns of one screen."""

    size: int
    name_width: int
    why_width: int
    """0: there is no room for the reasons."""
    width: int
    glyphs: Glyphs


def table(width: int, vehicles: Sequence[Vehicle], glyphs: Glyphs) -> Table:
    """The columns for a terminal of this width and for these vehicles."""
    size = max(size for size, least in enumerate(FROM) if width >= least)
    name_width = max([3, *(min(LONGEST_NAME, cells(clean(vehicle.name))) for vehicle in vehicles)])
    rest = width - 1 - name_width - 1 - sum(c.widths[size] + 1 for c in COLUMNS if c.widths[size])
    return Table(size, name_width, rest if rest >= LEAST_WHY else 0, width, glyphs)


def head(shape: Table) -> tuple[Line, Line]:
    """The two lines of titles."""
    name = "vehicle" if shape.name_width >= 7 else "id"
    titles = [f"|{name}", *(c.titles[shape.size] for c in COLUMNS if c.widths[shape.size])]
    widths = [shape.name_width, *_widths(shape)]
    if shape.why_width:
        words = "error, or why it cannot move"
        titles.append("|" + (words if len(words) <= shape.why_width else "why"))
        widths.append(shape.why_width)
    return _titles(shape, titles, widths, 0), _titles(shape, titles, widths, 1)


def _titles(shape: Table, titles: list[str], widths: list[int], part: int) -> Line:
    words = (
        fill((title + "|").split("|")[part], width, shape.glyphs) for title, width in zip(titles, widths, strict=True)
    )
    return fill_line([Span(" " + " ".join(words), "head")], shape.width, shape.glyphs)


def _widths(shape: Table) -> list[int]:
    return [c.widths[shape.size] for c in COLUMNS if c.widths[shape.size]]


def row(shape: Table, vehicle: Vehicle, chosen: bool) -> Line:
    """One vehicle."""
    glyphs = shape.glyphs
    style: Style = "chosen" if chosen else ""
    name = fill(clean(vehicle.name), shape.name_width, glyphs)
    spans = [Span((glyphs.chosen if chosen else " ") + name, style), Span(" ")]
    for column in COLUMNS:
        width = column.widths[shape.size]
        if width:
            text, style = column.cell(vehicle, width, glyphs)
            text = clip(text, width, glyphs)
            spans += [Span(text, style), Span(" " * (width - cells(text) + 1))]
    if shape.why_width:
        spans += why(vehicle.line, shape.why_width, glyphs)
    return fill_line(spans, shape.width, glyphs)


def why(line: Any, width: int, glyphs: Glyphs) -> list[Span]:
    """The errors, then the inhibits: with texts if there is room, else names, else the first name and a count."""
    causes: list[tuple[Any, Style]] = [(cause, "cause") for cause in line["errors"]]
    # inhibits with a text first: they say more than a bare DISARMED
    causes += [(cause, "") for cause in sorted(line["inhibits"], key=lambda inhibit: inhibit["text"] is None)]
    if not causes:
        return []
    words = [_words(cause) for cause, _ in causes]
    names = [clean(cause["name"]) for cause, _ in causes]
    if len(causes) == 1:
        return [Span(clip(words[0], width, glyphs), causes[0][1])]
    for parts in (words, [words[0], *names[1:]], names):
        if cells(", ".join(parts)) <= width:
            break
    else:
        rest = f" +{len(causes) - 1}"
        return [Span(clip(names[0], width - len(rest), glyphs), causes[0][1]), Span(rest)]
    return list(_joined(parts, [style for _, style in causes]))


def _words(cause: Any) -> str:
    return clean(cause["name"]) + (f": {clean(cause['text'])}" if cause["text"] else "")


def _joined(parts: Sequence[str], styles: Sequence[Style]) -> Iterator[Span]:
    for i, (part, style) in enumerate(zip(parts, styles, strict=True)):
        yield Span(", " if i else "")
        yield Span(part, style)
