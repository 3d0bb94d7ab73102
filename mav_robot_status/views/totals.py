"""What a flight adds up to: how long each value lasted, how often and how long each reason was active, arm cycles."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

    from .timeline import Reason, Span, VehicleTimeline

MOST_TEXTS: Final = 20
"""Different texts that are listed of one reason."""


class ReasonTotal(NamedTuple):
    """One error cause or inhibit over the whole flight."""

    name: str
    code: int | None
    occurrences: int
    """How often it became active."""
    active: int
    """Microseconds, without its interruptions."""
    texts: tuple[str, ...]
    """The different texts with it, the first MOST_TEXTS."""


class ArmCycle(NamedTuple):
    """From arming to disarming."""

    start: int
    end: int
    armed: int
    """Microseconds in which it was known to be armed: less than the whole if the link was lost meanwhile."""


class Totals(NamedTuple):
    """One vehicle's flight. Times in microseconds."""

    watched: int
    """Since the vehicle was first heard."""
    values: dict[str, dict[str, int]]
    """How long each track had each value."""
    arm_cycles: tuple[ArmCycle, ...]
    errors: tuple[ReasonTotal, ...]
    inhibits: tuple[ReasonTotal, ...]
    """Those that lasted longest first."""


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
    """How long each value lasted, the longest first."""
    lasted: dict[str, int] = defaultdict(int)
    for span in spans:
        lasted[span.value] += span.end - span.start
    return dict(sorted(lasted.items(), key=lambda item: -item[1]))


def arm_cycles(armed: Iterable[Span]) -> tuple[ArmCycle, ...]:
    """The cycles of the track `armed`. One goes on through a lost link if the vehicle is found armed again."""
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
    """Add up reasons by name. One that goes on with another text is still the same."""
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
