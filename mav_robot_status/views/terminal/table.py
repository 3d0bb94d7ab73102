"""The table: one row a vehicle. Which columns there are, and how wide, depends on the terminal's width alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple

from .state import Vehicle, duration
from .text import Line, Span, cells, clean, clip, fill, fill_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from .text import Glyphs, Style

NARROW, NORMAL, WIDE, WIDEST = range(4)
FROM: Final = (0, 70, 118, 150)
"""The widths of a terminal from which on these sizes are used."""
LONGEST_NAME: Final = 12
LEAST_WHY: Final = 6
"""Cells below which the reasons are left to the pane."""
TRI_STATES: Final = ("e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")
ALARMING: Final[dict[str, Style]] = {"e_stopped": "stop", "in_error": "alarm"}
WORDS: Final = {True: "YES", False: "no", None: "unk"}


class Column(NamedTuple):
    """One column, in each of the four sizes."""

    titles: tuple[str, str, str, str]
    """Two lines, parted by a bar."""
    widths: tuple[int, int, int, int]
    """In cells; 0: not shown."""
    cell: Callable[[Vehicle, int, Glyphs], Span]
    """Of a vehicle, in so many cells at most."""


def tri_state(field: str, value: bool | None, glyphs: Glyphs, tight: bool = False) -> Span:
    """`● YES`, `○ no` or `? unk`: told by shape, word and style."""
    symbol = {True: glyphs.yes, False: glyphs.no, None: glyphs.unknown}[value]
    style: Style = "unknown" if value is None else ALARMING.get(field, "on") if value else ""
    return Span(symbol + ("" if tight else " ") + WORDS[value], style)


def mode(value: str, glyphs: Glyphs, width: int = 6) -> Span:
    """AUTO, MANUAL (MAN where it is narrow), or unknown."""
    if value == "UNKNOWN":
        return Span(f"{glyphs.unknown}unk" if width < 5 else f"{glyphs.unknown} unk", "unknown")
    return Span(value if len(value) <= width else value[:3], "bold" if value == "AUTO" else "")


def _tri_state(field: str) -> Callable[[Vehicle, int, Glyphs], Span]:
    return lambda vehicle, width, glyphs: tri_state(field, vehicle.line[field], glyphs, width < 5)


def _text(group: str, name: str) -> Callable[[Vehicle, int, Glyphs], Span]:
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
    Column(("|mode",) * 4, (4, 6, 6, 6), lambda v, width, glyphs: mode(v.line["mode"], glyphs, width)),
    Column(("e-|stop", "|e-stop", "e_|stopped", "e_|stopped"), (4, 6, 7, 7), _tri_state("e_stopped")),
    Column(
        ("drv|powr", "drive|power", "drives_|powered", "drives_|powered"), (4, 5, 7, 7), _tri_state("drives_powered")
    ),
    Column(
        ("can|move", "can|move", "motion_|possible", "motion_|possible"), (4, 5, 8, 8), _tri_state("motion_possible")
    ),
    Column(("in|motn", "in|motion", "in_|motion", "in_|motion"), (4, 6, 6, 6), _tri_state("in_motion")),
    Column(("in|err", "in|error", "in_|error", "in_|error"), (4, 5, 5, 5), _tri_state("in_error")),
    Column(("link|age", "link|age", "link|age", "link|age"), (4, 5, 6, 6), _link),
    Column(("", "", "messages|", "messages|"), (0, 0, 8, 8), _rate),
)


class Table(NamedTuple):
    """The columns of one screen."""

    size: int
    name_width: int
    why_width: int
    """0: the reasons have no room."""
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
    """The errors, then why it cannot move: with as many texts as there is room for, or names, or the first and how
    many more."""
    causes: list[tuple[Any, Style]] = [(cause, "cause") for cause in line["errors"]]
    # those with a text say more than the others, DISARMED above all
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
