"""The details of one robot: its headline, reasons, link and message rates, the evidence of each field, its changes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final

from ...interface import STATES
from ...json_object import JsonMapping
from ...language import LINK, LOOKS, ROBOT_STATES, TONES, look
from .columns import state
from .robots import Change, Robot
from .text import Line, Signs, Span, clock, duration, fill, padded, toned

LABEL: Final = 10
"""Width of the labels, in cells."""


def details(robot: Robot, signs: Signs) -> Iterator[Line]:
    """Everything but the evidence and the changes. A line may be longer than the terminal is wide."""
    line, vehicle, top = robot.line, robot.line["vehicle"], robot.headline
    kind = (vehicle["type"], vehicle["autopilot"], vehicle.get("firmware"), vehicle["flight_mode"], vehicle["state"])
    words = ", ".join(signs.text(part) for part in kind if part)
    yield state(robot, signs), Span("  "), Span(signs.text(robot.name), "bold"), Span("  " + words, "dim")
    for sentence in top.sentences:
        yield (Span(signs.text(sentence.plain(clock))),)
    if top.step:
        yield Span("Next: ", "bold"), Span(signs.text(top.step))
    for error in line["errors"]:
        yield _labelled("error", f"{error['code']} {_cause(error, signs)}", TONES["alarm"].terminal)
    if line["inhibits"]:  # a lost link prevents no motion
        yield (Span(f"Why {'it cannot move' if line['motion_possible'] is False else 'this is unknown'}:", "bold"),)
    for inhibit in line["inhibits"]:
        yield (Span(f"  {_cause(inhibit, signs)}"),)
    if blocked := vehicle.get("modes_blocked"):
        yield _labelled("cannot arm", f"in {', '.join(map(signs.text, blocked))}")
    age = "never heard" if robot.row.age is None else f"heard {duration(robot.row.age)} ago"
    yield (Span(fill("link", LABEL) + " ", "dim"), signs.of(look(LINK, robot.link)), Span(f", {age}"))
    if rates := robot.row.rates:
        each = ", ".join(f"{name} {rate:.1f}/s" for name, rate in sorted(rates.items()))
        yield _labelled("messages", f"{sum(rates.values()):.0f}/s: {each}")
    if members := line.get("members"):
        yield _labelled("members", ", ".join(map(signs.text, members)))
    yield _labelled("handle", signs.text(robot.handle))


def evidence(explanation: JsonMapping | None, signs: Signs) -> Iterator[Line]:
    """Each field with its value, the age of the message that decided, the rule, and that message."""
    if explanation is None:
        yield (Span("Not heard: there is nothing to explain.", "dim"),)
        return
    for name, field in explanation["fields"].items():
        age = "" if field["age"] is None else f"{field['age']:.1f}s"
        source = f" [{signs.text(field['source'])}]" if field["source"] else ""
        yield (
            Span(fill(name, 16)),
            *padded(signs.of(look(name, field["value"])), 14),
            Span(f"{age:>6}  ", "dim"),
            Span(signs.text(field["rule"] or "no reason is given")),
            Span(source, "dim"),
        )


def changes(found: Iterable[tuple[str, Change]], signs: Signs, names: Mapping[str, str] | None = None) -> list[Line]:
    """The changes, the latest first. `names`, by handle, adds the name of each robot."""
    lines = [
        (
            Span(f"{clock(change.stamp)} ", "dim"),
            *(() if names is None else (Span(fill(signs.text(names.get(handle, handle)), 12) + " ", "bold"),)),
            Span(fill(change.name, 16)),
            *_change(change, signs),
        )
        for handle, change in found
    ]
    return lines or [(Span("No change in the last ten minutes.", "dim"),)]


def _change(change: Change, signs: Signs) -> Line:
    name, value = change.name, change.value
    if isinstance(value, dict):
        begins, text = value["begins"], value["text"]
        said = f": “{text}”" if text and begins else ""
        member = f"{value['handle']}: " if value.get("handle") else ""
        style = TONES["alarm"].terminal if name == "error" and begins else ""
        return Span("begins  " if begins else "ends    "), Span(signs.text(f"{member}{value['name']}{said}"), style)
    now = _word(name, value, signs)
    if change.before is None:
        return (now,)
    return now, Span("  was ", "dim"), Span(_word(name, change.before, signs).text, "dim")


def _word(name: str, value: object, signs: Signs) -> Span:
    return signs.of(look(name, value)) if name in LOOKS else Span(signs.text("none" if value is None else value))


def _cause(cause: JsonMapping, signs: Signs) -> str:
    text = f": “{cause['text']}”" if cause["text"] else ""
    member = f"{cause['handle']}: " if cause.get("handle") else ""
    return signs.text(f"{member}{cause['name']} since {clock(cause['since'])}{text}")


def _labelled(label: str, text: str, style: str = "") -> Line:
    return Span(fill(label, LABEL) + " ", "dim"), Span(text, style)


KEYS: Final = (
    ("Up Down j k", "select a robot; PgUp PgDn Home End, or the mouse"),
    ("n", "the next robot that needs a look"),
    ("Enter", "the details on the whole screen; again, or Esc: back"),
    ("e t", "the evidence of each field; the last changes"),
    ("T", "the last changes of all robots"),
    ("/", "search in names, kinds, modes and reasons; Esc: all again"),
    ("s r", "sort by the next column, or click its title; reverse the order"),
    ("1 2 3 4", "only robots in error, e-stopped, not heard, that can move; 0: all"),
    ("q", "quit"),
)
"""The keys of the screen, and what they do."""


def help_lines(signs: Signs) -> Iterator[Line]:
    """The keys, every value of each field, and what the colours mean."""
    for keys, effect in KEYS:
        yield Span(fill(keys, 12) + " ", "bold"), Span(effect)
    for one in ROBOT_STATES:
        yield toned(fill(f"{signs.symbol(one)} {one.word}", 17), one.tone), Span(one.meaning, "dim")
    for field in STATES:
        values: Sequence[Span] = [signs.of(one) for one in LOOKS[field.name].values()]
        spaced = [part for value in values for part in (value, Span("  "))]
        yield Span(fill(field.name, 16) + " ", "bold"), *spaced, Span(field.row.meaning, "dim")
    for tone, colours in TONES.items():
        yield toned(fill(tone, 16), tone), Span(f" {colours.meaning}")
    yield (Span("Times are those of this computer. The status is information, not a safety function.", "dim"),)
