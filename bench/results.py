"""What a run gives: samples, medians of them, and whether targets are met. All values; nothing here measures."""

from __future__ import annotations

from statistics import median
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

OURS: Final = "ours"
PYMAVLINK: Final = "pymavlink"


class Sample(NamedTuple):
    """One measured value of one round."""

    setup: str
    """What was done, in words; the rows of the table."""
    metric: str
    """What was measured, with its unit."""
    who: str
    value: float
    note: str = ""
    """What has to be known to believe it, as "the sender was at its limit"."""


class Skip(NamedTuple):
    """Something that could not be measured."""

    setup: str
    who: str
    why: str


class Target(NamedTuple):
    """What is to be reached in one setup: a factor of a peer's value, or an absolute one."""

    setup: str
    metric: str
    words: str
    at_most: float | None = None
    at_least: float | None = None
    peer: str | None = None
    """None: the limit is absolute."""
    who: str = OURS


Key = tuple[str, str]


def collect(case: str, title: str, rounds: list[list[Sample | Skip]], targets: Iterable[Target]) -> dict[str, Any]:
    """The result of one case, ready for JSON."""
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
        "targets": [_judged(target, rows) for target in targets],
        "notes": list(notes),
    }


def _row(key: Key, values: dict[str, dict[int, float]]) -> dict[str, Any]:
    return {"setup": key[0], "metric": key[1], "values": {who: list(v.values()) for who, v in values.items()}}


def _judged(target: Target, rows: dict[Key, dict[str, dict[int, float]]]) -> dict[str, Any]:
    """The value that the target limits, the median over the rounds; None where there is nothing to compare."""
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
