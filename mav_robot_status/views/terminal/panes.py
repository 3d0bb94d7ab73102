"""What stands below the table: the details of the chosen vehicle, its explanation, the last changes, or the help."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from .state import duration, seconds_since
from .table import TRI_STATES, mode, tri_state
from .text import Line, Span, cells, clean, fill, wrap

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from .state import Change, State
    from .text import Style

LABEL: Final = 9
"""Cells of the words in front of the details."""
NARROW: Final = 60
"""The width below which explanations stand below their fields."""


def pane(state: State, width: int) -> list[Line]:
    """All lines of the pane that the person has chosen."""
    return list(PANES[state.ui.pane](state, width))


def title(state: State) -> str:
    """What the pane is about."""
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
        yield (Span(" No autopilot is heard yet.", "bold"),)
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
    age = "never heard" if vehicle.age is None else f"last heartbeat {duration(vehicle.age)} ago"
    yield from _labelled("link", f"{vehicle.link}, {age}", width)
    if vehicle.rates:
        each = ", ".join(f"{name} {rate:.1f}" for name, rate in sorted(vehicle.rates.items()))
        yield from _labelled("rates", f"{sum(vehicle.rates.values()):.0f} a second: {each}", width)
    yield from _labelled("handle", clean(vehicle.handle), width)


def _verdict(line: Any) -> str:
    """The status as a sentence."""
    if line["link"]["state"] != "CONNECTED":
        return "No heartbeat comes: nothing is known of it."
    parts = [
        {True: "It can move", False: "It cannot move", None: "Whether it can move is not known"}[
            line["motion_possible"]
        ],
        {"AUTO": "a program is in charge", "MANUAL": "a person is in charge"}.get(
            line["mode"], "who is in charge is not known"
        ),
    ]
    if line["e_stopped"]:
        parts.append("an emergency stop is engaged")
    if line["in_error"]:
        parts.append("something is wrong")
    return ", ".join(parts[:-1]) + f" and {parts[-1]}."


def _cause(cause: Any, state: State) -> str:
    said = f': "{clean(cause["text"])}"' if cause["text"] else ""
    return f"{clean(cause['name'])} for {duration(seconds_since(cause['since'], state.now))}{said}"


# -- explanation -------------------------------------------------------------------------------------------------------


def _explain(state: State, width: int) -> Iterator[Line]:
    if state.explanation is None:
        heard = state.chosen is not None and state.chosen.age is not None
        yield (Span(" One moment ..." if heard else " It was never heard, so there is nothing to explain."),)
        return
    for name, field in state.explanation["fields"].items():
        value = mode(field["value"], state.glyphs) if name == "mode" else tri_state(name, field["value"], state.glyphs)
        age = "" if field["age"] is None else f"{field['age']:.1f} s"
        source = f"  [{clean(field['source'])}]" if field["source"] else ""
        why = f"{clean(field['rule'] or 'the hardware does not tell')}{source}"
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
        yield (Span(" Nothing has changed within the last ten minutes."),)
    yield from changes(state, state.ui.pane == "all transitions")


def changes(state: State, several: bool) -> list[Line]:
    """The changes, the latest first; with the names of the vehicles if they are of several."""
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
        said = f': "{clean(value["text"])}"' if value["text"] and value["begins"] else ""
        begins = "begins  " if value["begins"] else "ends    "
        return Span(begins), Span(clean(value["name"]) + said, "cause" if name == "error" and value["begins"] else "")
    now = _word(name, value, state)
    if change.before is None:
        return (now,)
    return now, Span(" " * (7 - cells(now.text)) + f" was {_word(name, change.before, state).text}", "soft")


def _word(name: str, value: Any, state: State) -> Span:
    if name == "mode":
        return mode(value, state.glyphs)
    if name in TRI_STATES:
        return tri_state(name, value, state.glyphs)
    return Span(clean(value if value is not None else "none"))


def clock(stamp: str) -> str:
    """The time of day of a stamp, in UTC, to a tenth of a second."""
    return stamp[11:21]


# -- help --------------------------------------------------------------------------------------------------------------

HELP: Final = (
    ("keys", "up down j k PgUp PgDn Home End: choose a vehicle;  n: the next one with something wrong"),
    ("", "e: why each value;  t: its last changes;  T: those of all;  Esc: details;  ?: this help"),
    ("", "In these, PgUp and PgDn turn their pages.  q: end;  Ctrl-L: draw anew"),
    ("values", "{yes} YES, {no} no, {unknown} unk: the vehicle does not tell; that never means no"),
    ("mode", "AUTO: a program decides the next motion, MANUAL: a person's sticks do"),
    ("e-stop", "e_stopped: an emergency stop is engaged and must be released first"),
    ("power", "drives_powered: armed, and nothing blocks the actuators"),
    ("can move", "motion_possible: a motion command would be carried out"),
    ("in motion", "in_motion: it moves or turns, or it is airborne"),
    ("in error", "in_error: at least one cause is active; the last column names it"),
    ("link age", "since the last heartbeat; {lost}: the link is lost, so nothing is known"),
    ("", "Times are UTC. The status informs. It is no safety function."),
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
