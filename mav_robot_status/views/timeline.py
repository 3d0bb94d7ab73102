"""A flight as intervals: what each handle said, from when to when. Fed with handles and instants, or values alone.

Times inside a timeline are whole microseconds since the log's first record, on a clock that never steps. Where the
log's clock was set a new segment begins: nothing goes on across it, and each segment has its own place in UTC.
"""

from __future__ import annotations

import bisect
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final, NamedTuple

from ..interface import LinkState, RobotMode, RobotStatus, TriState

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from ..clock import Instant
    from ..interface import Detail, Evidence, IndustrialRobotStatusHandle

FIELDS: Final = RobotStatus._fields[:-1]
TRACKS: Final = ("link", "flight_mode", "armed", *FIELDS)
"""What is followed of each vehicle, one value at a time."""
NO_NAME: Final = ""
"""The flight mode where there is none, or none is known."""


class Span(NamedTuple):
    """A value that one track had for a while."""

    start: int
    end: int
    value: str
    """A state's name, or a flight mode's; see TRACKS."""
    rule: str | None = None
    """Why it began, where the hardware tells: the rule that decided, and what it read."""
    source: str | None = None


class Reason(NamedTuple):
    """An error cause or an inhibit with one text; when its text changes, another one goes on."""

    start: int
    end: int
    name: str
    code: int | None
    """The number of an error cause; None for an inhibit."""
    text: str | None


class Segment(NamedTuple):
    """A stretch of the log in which its clock was not set."""

    start: int
    end: int
    unix_us: int
    """UTC at `start`, microseconds since 1970."""


@dataclass
class VehicleTimeline:
    """What was known of one vehicle."""

    handle: str
    system: int | None = None
    component: int | None = None
    autopilot: str | None = None
    type: str | None = None
    tracks: dict[str, list[Span]] = field(default_factory=lambda: {name: [] for name in TRACKS})
    """In time, without overlaps; a value that lasts is one span. Gaps: before the vehicle was heard."""
    errors: list[Reason] = field(default_factory=list)
    inhibits: list[Reason] = field(default_factory=list)
    """By their ends; those of one name do not overlap."""


@dataclass
class Timeline:
    """What was known of the vehicles of one log."""

    name: str
    segments: list[Segment] = field(default_factory=list)
    vehicles: list[VehicleTimeline] = field(default_factory=list)

    @property
    def end(self) -> int:
        """How long the log is."""
        return self.segments[-1].end if self.segments else 0

    def unix_us(self, start: int, at: int) -> int:
        """UTC of `at`, the end of something that began at `start`: both are of one segment."""
        index = bisect.bisect_right(self.segments, start, key=lambda segment: segment.start) - 1
        segment = self.segments[max(0, index)]
        return segment.unix_us + at - segment.start


class TimelineBuilder:
    """Makes a timeline: `begin`, `look` at what is so whenever it may have changed, `end`."""

    def __init__(self, name: str) -> None:
        self.timeline = Timeline(name)
        self._origin = 0.0
        self._watches: dict[str, _Watch] = {}

    def begin(self, now: Instant) -> None:
        """The log begins, or its clock was set: what was known before ends here."""
        if not self.timeline.segments:
            self._origin = now.mono
        else:
            self.end(now)
        at = self._elapsed(now)
        self.timeline.segments.append(Segment(at, at, now.unix_us))

    def look(self, handles: Iterable[IndustrialRobotStatusHandle], now: Instant) -> None:
        """Take what the handles say at `now`."""
        for handle in handles:
            watch = self._watches.get(handle.name)
            if watch is None:
                watch = self._watches[handle.name] = _Watch(VehicleTimeline(handle.name))
                self.timeline.vehicles.append(watch.vehicle)
            watch.look(handle, self._elapsed(now))

    def end(self, now: Instant) -> None:
        """The log, or a segment of it, ends."""
        at = self._elapsed(now)
        self.timeline.segments[-1] = self.timeline.segments[-1]._replace(end=at)
        for watch in self._watches.values():
            watch.end(at)

    def _elapsed(self, now: Instant) -> int:
        return round((now.mono - self._origin) * 1e6)


class _Watch:
    """What goes on of one vehicle."""

    def __init__(self, vehicle: VehicleTimeline) -> None:
        self.vehicle = vehicle
        self._seen: tuple[RobotStatus, Detail] | None = None
        self._values: dict[str, Span] = {}
        self._errors: dict[str, Reason] = {}
        self._inhibits: dict[str, Reason] = {}

    def look(self, handle: IndustrialRobotStatusHandle, at: int) -> None:
        status, detail = handle.status, handle.detail
        if self._seen is not None and self._seen[0] is status and self._seen[1] is detail:
            return
        self._seen = status, detail
        vehicle = self.vehicle
        vehicle.system, vehicle.component = detail.system, detail.component
        vehicle.autopilot = detail.vehicle.autopilot or vehicle.autopilot
        vehicle.type = detail.vehicle.type or vehicle.type
        for name, value in values_of(status, detail).items():
            self._value(name, value, handle.evidence, at)
        errors = [Reason(at, at, error.name, error.code, error.text) for error in detail.errors]
        inhibits = [Reason(at, at, inhibit.name, None, inhibit.text) for inhibit in detail.inhibits]
        _follow(self._errors, vehicle.errors, errors, at)
        _follow(self._inhibits, vehicle.inhibits, inhibits, at)

    def end(self, at: int) -> None:
        for name, span in self._values.items():
            _close(self.vehicle.tracks[name], span, at)
        _follow(self._errors, self.vehicle.errors, (), at)
        _follow(self._inhibits, self.vehicle.inhibits, (), at)
        self._seen = None
        self._values = {}

    def _value(self, name: str, value: str, evidence: Mapping[str, Evidence], at: int) -> None:
        open_span = self._values.get(name)
        if open_span is not None and open_span.value == value:
            return
        if open_span is not None:
            _close(self.vehicle.tracks[name], open_span, at)
        why = evidence.get(name)
        self._values[name] = Span(at, at, value, *((why.rule, why.source) if why else (None, None)))


def values_of(status: RobotStatus, detail: Detail) -> dict[str, str]:
    """The value of each track."""
    return {
        "link": detail.link.value,
        "flight_mode": detail.vehicle.flight_mode or NO_NAME,
        "armed": _armed(detail).name,
        "mode": RobotMode(status.mode).name,
        **{name: TriState(getattr(status, name)).name for name in FIELDS[1:]},
    }


def _armed(detail: Detail) -> TriState:
    """Whether the autopilot is armed: a vehicle that is heard says DISARMED where it is not."""
    if detail.link is not LinkState.CONNECTED:
        return TriState.UNKNOWN
    return TriState(all(inhibit.name != "DISARMED" for inhibit in detail.inhibits))


def _follow(is_open: dict[str, Reason], closed: list[Reason], active: Iterable[Reason], at: int) -> None:
    """Close what is no longer active, or is with another text; open what is new."""
    now = {reason.name: reason for reason in active}
    for name, reason in list(is_open.items()):
        if name not in now or now[name].text != reason.text:
            _close(closed, is_open.pop(name), at)
    for name, reason in now.items():
        is_open.setdefault(name, reason)


def _close(into: list[Span] | list[Reason], what: Span | Reason, at: int) -> None:
    """End something; what did not last at all was never so."""
    if at > what.start:
        into.append(what._replace(end=at))  # type: ignore[arg-type]
