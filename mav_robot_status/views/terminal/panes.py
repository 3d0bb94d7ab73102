"""The pane below the table: the details of the selected vehicle, its explanation, the last changes, or the help."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from ...interface import STATES
from .state import duration, seconds_since
from .table import TITLES, shown
from .text import Line, Span, cells, clean, fill, wrap

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .state import Change, State
    from .text import Style

FIELDS: Final = {field.name: field for field in STATES}
LABEL: Final = 9
"""Width of the labels of the details, in cells."""
NARROW: Final = 60
"""The width below which an explanation has its own line below its field."""


def pane(state: State, width: int) -> list[Line]:
    """All lines of the selected pane."""
    return list(PANES[state.ui.pane](state, width))


def title(state: State) -> str:
    """The title of the pane."""
    chosen = state.chosen
    if state.ui.pane == "help":
        return "help"
    if chosen is None:
        return ""
    vehicle = chosen.line["vehicle"]
    name = " ".join(clean(part) for part in (chosen.name, vehicle["type"]) if part is not None)
    return {
        "detail": ", ".join([name, *(clean(vehicle[key]) for key in ("autopilot", "state") if vehicle[key])]),
        "explain": f"{name}: why each value",
        "transitions": f"{name}: last changes",
        "all transitions": "last changes of all vehicles",
    }[state.ui.pane]


def _labelled(label: str, text: str, width: int, style: Style = "") -> Iterator[Line]:
    for i, part in enumerate(wrap(text, max(10, width - LABEL - 2))):
        yield Span(" " + fill("" if i else label, LABEL) + " ", "soft"), Span(part, style)


# -- details -----------------------------------------------------------------------------------------------------------


def _detail(state: State, width: int) -> Iterator[Line]:
    vehicle = state.chosen
    if vehicle is None:
        yield ()
        yield (Span(" No heartbeat of an autopilot yet.", "bold"),)
        for part in wrap(clean(state.advice), width - 2):
            yield (Span(" " + part),)
        return
    line = vehicle.line
    for part in wrap(_verdict(line), width - 2):
        yield (Span(" " + part, "bold"),)
    for error in line["errors"]:
        yield from _labelled("error", f"{error['code']} {_cause(error, state)}", width, "cause")
    for inhibit in line["inhibits"]:
        yield from _labelled("no motion", _cause(inhibit, state), width)
    age = "no heartbeat yet" if vehicle.age is None else f"last heartbeat {duration(vehicle.age)} ago"
    yield from _labelled("link", f"{vehicle.link}, {age}", width)
    if vehicle.rates:
        each = ", ".join(f"{name} {rate:.1f}" for name, rate in sorted(vehicle.rates.items()))
        yield from _labelled("rates", f"{sum(vehicle.rates.values()):.0f} a second: {each}", width)
    yield from _labelled("handle", clean(vehicle.handle), width)


def _verdict(line: Any) -> str:
    """The status as a sentence."""
    if line["link"]["state"] != "CONNECTED":
        return "No heartbeat: its state is unknown."
    parts = [
        {True: "It can move", False: "It cannot move", None: "It is unknown whether it can move"}[
            line["motion_possible"]
        ],
        {"AUTO": "a program is in charge", "MANUAL": "a person is in charge"}.get(
            line["mode"], "it is unknown who is in charge"
        ),
    ]
    if line["e_stopped"]:
        parts.append("the emergency stop is engaged")
    if line["in_error"]:
        parts.append("it has an error")
    return ", ".join(parts[:-1]) + f" and {parts[-1]}."


def _cause(cause: Any, state: State) -> str:
    text = f': "{clean(cause["text"])}"' if cause["text"] else ""
    return f"{clean(cause['name'])} for {duration(seconds_since(cause['since'], state.now))}{text}"


# -- explanation -------------------------------------------------------------------------------------------------------


def _explain(state: State, width: int) -> Iterator[Line]:
    if state.explanation is None:
        seen = state.chosen is not None and state.chosen.age is not None
        yield (Span(" One moment ..." if seen else " No heartbeat yet: there is nothing to explain."),)
        return
    for name, field in state.explanation["fields"].items():
        value = shown(FIELDS[name], field["value"], state.glyphs)
        age = "" if field["age"] is None else f"{field['age']:.1f} s"
        source = f"  [{clean(field['source'])}]" if field["source"] else ""
        why = f"{clean(field['rule'] or 'the hardware gives no reason')}{source}"
        front = (
            Span(" " + fill(name, 16)),
            Span(fill(value.text, 7), value.style),
            Span(f"{age:>6}  ", "soft"),
        )
        if width < NARROW:
            yield front
            for part in wrap(why, width - 4):
                yield (Span("   " + part, "soft"),)
            continue
        for i, part in enumerate(wrap(why, width - 33)):
            yield (*(front if i == 0 else (Span(" " * 32),)), Span(part))


# -- changes -----------------------------------------------------------------------------------------------------------


def _transitions(state: State, width: int) -> Iterator[Line]:
    if not state.changes:
        yield (Span(" No change in the last ten minutes."),)
    yield from changes(state, state.ui.pane == "all transitions")


def changes(state: State, several: bool) -> list[Line]:
    """The changes, the latest first. `several` adds the name of each vehicle."""
    return [
        (
            Span(f" {clock(change.stamp)} {duration(state.now.mono - change.at):>4} ago  ", "soft"),
            *([Span(fill(clean(name), 8))] if several else []),
            Span(fill(change.name, 16)),
            *_value(change, state),
        )
        for name, change in state.changes
    ]


def _value(change: Change, state: State) -> Line:
    name, value = change.name, change.value
    if isinstance(value, dict):
        text = f': "{clean(value["text"])}"' if value["text"] and value["begins"] else ""
        begins = "begins  " if value["begins"] else "ends    "
        return Span(begins), Span(clean(value["name"]) + text, "cause" if name == "error" and value["begins"] else "")
    now = _word(name, value, state)
    if change.before is None:
        return (now,)
    return now, Span(" " * (7 - cells(now.text)) + f" was {_word(name, change.before, state).text}", "soft")


def _word(name: str, value: Any, state: State) -> Span:
    if name in FIELDS:
        return shown(FIELDS[name], value, state.glyphs)
    return Span(clean(value if value is not None else "none"))


def clock(stamp: str) -> str:
    """The time of day of a stamp, in UTC, to a tenth of a second."""
    return stamp[11:21]


# -- help --------------------------------------------------------------------------------------------------------------


def _title(name: str) -> str:
    """The title of a field's column in a terminal of 80 columns, or its last word if that is too long."""
    words = TITLES[name][0][1].replace("|", " ").strip() if name in TITLES else name
    return words if len(words) <= LABEL else words.rpartition(" ")[2]


HELP: Final = (
    ("keys", "Up Down j k PgUp PgDn Home End: select a vehicle;  n: next problem"),
    ("", "e: why each value;  t: its last changes;  T: changes of all;  Esc: details;  ?: this help"),
    ("", "In these panes PgUp and PgDn scroll.  q: quit;  Ctrl-L: redraw"),
    ("values", "{yes} YES, {no} no, {unknown} unk: unknown, which never means no"),
    *((_title(name), f"{name}: {field.row.meaning}") for name, field in FIELDS.items()),
    ("link age", "time since the last heartbeat; {lost}: link lost, the state is unknown"),
    ("", "Times are UTC. The status is information, not a safety function."),
)


def _help(state: State, width: int) -> Iterator[Line]:
    for label, text in HELP:
        yield from _labelled(label, text.format_map(state.glyphs._asdict()), width)


PANES: Final[dict[str, Callable[[State, int], Iterator[Line]]]] = {
    "detail": _detail,
    "explain": _explain,
    "transitions": _transitions,
    "all transitions": _transitions,
    "help": _help,
}
