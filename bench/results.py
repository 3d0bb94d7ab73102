"""The results of a run as values: samples, their medians, and whether the targets are met."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

OURS: Final = "ours"
PYMAVLINK: Final = "pymavlink"
FIRST_MACHINE, SECOND_MACHINE = 7.3, 17.5
"""The machines for which absolute limits were set: microseconds in which pymavlink parses a frame there."""


class Sample(NamedTuple):
    """One measured value of one round."""

    setup: str
    """The setup, in words: a row of the table."""
    metric: str
    """The measured quantity with its unit."""
    who: str
    value: float
    note: str = ""
    """A remark that limits the value, such as "the sender was at its limit"."""


class Skip(NamedTuple):
    """A measurement that was not possible."""

    setup: str
    who: str
    why: str


class Target(NamedTuple):
    """The target of one setup: a factor of the value of another program, or an absolute value."""

    setup: str
    metric: str
    words: str
    at_most: float | None = None
    at_least: float | None = None
    peer: str | None = None
    """None: the limit is absolute."""
    who: str = OURS
    machine: float | None = None
    """Of an absolute limit that depends on the machine: the machine for which it was set, such as FIRST_MACHINE."""

    def scaled(self, parse_us: float | None) -> Target:
        """The target for a machine on which pymavlink parses a frame in `parse_us` microseconds."""
        if self.machine is None or parse_us is None:
            return self
        factor = parse_us / self.machine
        return self._replace(
            at_most=None if self.at_most is None else self.at_most * factor,
            at_least=None if self.at_least is None else self.at_least / factor,
        )


Key = tuple[str, str]


def collect(
    case: str,
    title: str,
    rounds: list[list[Sample | Skip]],
    targets: Iterable[Target],
    parse_us: float | None = None,
) -> dict[str, Any]:
    """The result of one case, ready for JSON. `parse_us`: microseconds in which pymavlink parses a frame here."""
    rows: dict[Key, dict[str, dict[int, float]]] = {}
    notes: dict[str, None] = {}
    for number, found in enumerate(rounds):
        for item in found:
            if isinstance(item, Skip):
                notes[f"{item.who}, {item.setup}: {item.why}" if item.setup else f"{item.who}: {item.why}"] = None
                continue
            rows.setdefault((item.setup, item.metric), {}).setdefault(item.who, {})[number] = item.value
            if item.note:
                notes[f"{item.who}, {item.setup}: {item.note}"] = None
    return {
        "case": case,
        "title": title,
        "rows": [_row(key, values) for key, values in rows.items()],
        "targets": [_judged(target.scaled(parse_us), rows) for target in targets],
        "notes": list(notes),
    }


def _row(key: Key, values: dict[str, dict[int, float]]) -> dict[str, Any]:
    return {"setup": key[0], "metric": key[1], "values": {who: list(v.values()) for who, v in values.items()}}


def _judged(target: Target, rows: dict[Key, dict[str, dict[int, float]]]) -> dict[str, Any]:
    """A target with its value, the median over the rounds; the value is None if the run has nothing to compare."""
    row = rows.get((target.setup, target.metric), {})
    mine, theirs = row.get(target.who, {}), row.get(target.peer or "", {})
    if target.peer is not None:
        values = [mine[number] / theirs[number] for number in mine if theirs.get(number)]
    else:
        values = list(mine.values())
    value = median(values) if values else None
    met = None
    if value is not None:
        met = (target.at_most is None or value <= target.at_most) and (
            target.at_least is None or value >= target.at_least
        )
    return {**target._asdict(), "value": value, "met": met}
