"""Totals of a flight: the time in each value, the count and time of each reason, the arm cycles."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

    from .timeline import Reason, Span, VehicleTimeline

MOST_TEXTS: Final = 20
"""Different texts listed for one reason."""


class ReasonTotal(NamedTuple):
    """One error cause or inhibit over the whole flight."""

    name: str
    code: int | None
    occurrences: int
    """The number of times it became active."""
    active: int
    """Its active time in microseconds."""
    texts: tuple[str, ...]
    """Its different texts, at most MOST_TEXTS."""


class ArmCycle(NamedTuple):
    """From arming to disarming."""

    start: int
    end: int
    armed: int
    """Microseconds with the value armed. This is less than the cycle if the link was lost."""


class Totals(NamedTuple):
    """One vehicle's flight. Times in microseconds."""

    watched: int
    """The time since the first heartbeat."""
    values: dict[str, dict[str, int]]
    """The time of each track in each value."""
    arm_cycles: tuple[ArmCycle, ...]
    errors: tuple[ReasonTotal, ...]
    inhibits: tuple[ReasonTotal, ...]
    """Errors and inhibits are in order of their active time, the longest first."""


def totals(vehicle: VehicleTimeline) -> Totals:
    """Add up a vehicle's timeline."""
    values = {name: durations(spans) for name, spans in vehicle.tracks.items()}
    return Totals(
        sum(values["link"].values()),
        values,
        arm_cycles(vehicle.tracks["armed"]),
        reason_totals(vehicle.errors),
        reason_totals(vehicle.inhibits),
    )


def durations(spans: Iterable[Span]) -> dict[str, int]:
    """The time in each value, the longest first."""
    lasted: dict[str, int] = defaultdict(int)
    for span in spans:
        lasted[span.value] += span.end - span.start
    return dict(sorted(lasted.items(), key=lambda item: -item[1]))


def arm_cycles(armed: Iterable[Span]) -> tuple[ArmCycle, ...]:
    """The cycles of the track `armed`. A lost link does not end a cycle if the vehicle is armed afterwards."""
    cycles: list[ArmCycle] = []
    flying = False
    for span in armed:
        if span.value == "TRUE":
            length = span.end - span.start
            if flying:
                cycles[-1] = cycles[-1]._replace(end=span.end, armed=cycles[-1].armed + length)
            else:
                cycles.append(ArmCycle(span.start, span.end, length))
        flying = span.value == "TRUE" or (flying and span.value == "UNKNOWN")
    return tuple(cycles)


def reason_totals(reasons: Iterable[Reason]) -> tuple[ReasonTotal, ...]:
    """Add up reasons by name. A new text does not begin a new occurrence."""
    found: dict[str, ReasonTotal] = {}
    ended: dict[str, int] = {}
    for reason in sorted(reasons, key=lambda reason: reason.start):
        name = reason.name
        before = found.get(name) or ReasonTotal(name, reason.code, 0, 0, ())
        texts = before.texts
        if reason.text is not None and reason.text not in texts and len(texts) < MOST_TEXTS:
            texts = (*texts, reason.text)
        found[name] = before._replace(
            occurrences=before.occurrences + (ended.get(name) != reason.start),
            active=before.active + reason.end - reason.start,
            texts=texts,
        )
        ended[name] = reason.end
    return tuple(sorted(found.values(), key=lambda total: -total.active))
