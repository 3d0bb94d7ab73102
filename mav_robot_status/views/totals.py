"""Totals of a flight: the time in each value, the count and time of each reason, the arm cycles."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, NamedTuple

from ..interface import LinkState
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
    handle: str | None = None
    """The member of a group that reports it; None for a single robot."""

    @property
    def title(self) -> str:
        """As that of a `Reason`."""
        return self.name if self.handle is None else f"{self.handle}: {self.name}"


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
    not_ready: tuple[ReasonTotal, ...]
    """Why members of a group could not work, in the same order."""
    linked: int
    """The time in which the link was connected."""
    linked_values: dict[str, dict[str, int]]
    """The time of each track in each value while the link was connected."""


def totals(vehicle: VehicleTimeline) -> Totals:
    """Add up a vehicle's timeline."""
    values = {name: durations(spans) for name, spans in vehicle.tracks.items()}
    linked = [span for span in vehicle.tracks["link"] if span.value == LinkState.CONNECTED.value]
    return Totals(
        sum(values["link"].values()),
        values,
        arm_cycles(vehicle.tracks["armed"]),
        reason_totals(vehicle.errors),
        reason_totals(vehicle.inhibits),
        reason_totals(vehicle.not_ready),
        sum(span.end - span.start for span in linked),
        {name: durations(within(spans, linked)) for name, spans in vehicle.tracks.items()},
    )


def durations(spans: Iterable[Span]) -> dict[str, int]:
    """The time in each value, the longest first."""
    lasted: dict[str, int] = defaultdict(int)
    for span in spans:
        lasted[span.value] += span.end - span.start
    return dict(sorted(lasted.items(), key=lambda item: -item[1]))


def within(spans: Iterable[Span], others: Sequence[Span]) -> Iterator[Span]:
    """The parts of spans inside others. Both are in order of time, without overlaps."""
    first = 0
    for span in spans:
        while first < len(others) and others[first].end <= span.start:
            first += 1
        for other in others[first:]:
            if other.start >= span.end:
                break
            yield span._replace(start=max(span.start, other.start), end=min(span.end, other.end))


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
    """Add up reasons by title. A new text does not begin a new occurrence, and texts at the same time count once."""
    found: dict[str, ReasonTotal] = {}
    ended: dict[str, int] = {}
    for reason in sorted(reasons, key=lambda reason: reason.start):
        title = reason.title
        before = found.get(title) or ReasonTotal(reason.name, reason.code, 0, 0, (), reason.handle)
        texts = before.texts
        if reason.text is not None and reason.text not in texts and len(texts) < MOST_TEXTS:
            texts = (*texts, reason.text)
        end = ended.get(title, -1)
        found[title] = before._replace(
            occurrences=before.occurrences + (end < reason.start),
            active=before.active + max(0, reason.end - max(reason.start, end)),
            texts=texts,
        )
        ended[title] = max(reason.end, end)
    return tuple(sorted(found.values(), key=lambda total: -total.active))
