"""A flight as intervals: the values of each handle over time.

Times inside a timeline are whole microseconds since the log's first record, on a clock that never steps. When the
log's clock is set, a new segment begins: no interval spans it, and each segment has its own time in UTC.
"""

from __future__ import annotations

import bisect
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from ..clock import Instant
from ..interface import STATES, Detail, Evidence, IndustrialRobotStatusHandle, LinkState, RobotStatus, TriState

UNTOLD: Final = {"HEARTBEAT_LATE", "SENDER_UNCERTAIN", "LOG_GAP"}
"""Inhibits with which nobody knows whether the autopilot is armed."""
TRACKS: Final = ("link", "flight_mode", "armed", *(field.name for field in STATES))
"""The tracks of each vehicle. A track has one value at a time."""
NO_NAME: Final = ""
"""The flight mode of a vehicle that has none, or whose mode is unknown."""


class Span(NamedTuple):
    """A value of one track over an interval."""

    start: int
    end: int
    value: str
    """The name of a state or of a flight mode; see TRACKS."""
    rule: str | None = None
    """The evidence at its start, if the hardware gives some: the rule, and in `source` the message that it read."""
    source: str | None = None


class Reason(NamedTuple):
    """An error cause or an inhibit with one text. A new text begins a new interval."""

    start: int
    end: int
    name: str
    code: int | None
    """The number of an error cause; None for an inhibit."""
    text: str | None
    handle: str | None = None
    """The member of a group that reports it; None for a single robot."""

    @property
    def title(self) -> str:
        """Its name; in a group with the member in front: `arm: E_STOPPED`."""
        return self.name if self.handle is None else f"{self.handle}: {self.name}"


class Segment(NamedTuple):
    """A part of the log in which its clock was not set."""

    start: int
    end: int
    unix_us: int
    """UTC at `start`, microseconds since 1970."""


@dataclass
class VehicleTimeline:
    """The intervals of one vehicle."""

    handle: str
    system: int | None = None
    component: int | None = None
    autopilot: str | None = None
    type: str | None = None
    tracks: dict[str, list[Span]] = field(default_factory=lambda: {name: [] for name in TRACKS})
    """In order of time, without overlaps. There is a gap before the first heartbeat."""
    errors: list[Reason] = field(default_factory=list)
    inhibits: list[Reason] = field(default_factory=list)
    """In order of their ends. Those of the same title and text do not overlap; an inhibit may have several texts."""
    not_ready: list[Reason] = field(default_factory=list)
    """Why members of a group could not work, in order of their ends. Empty for a single robot."""
    members: tuple[str, ...] = ()
    """The handles of a group. Empty for a single robot."""
    name: str | None = None
    """What people call it."""


@dataclass
class Timeline:
    """The intervals of all vehicles of one log."""

    name: str
    segments: list[Segment] = field(default_factory=list)
    vehicles: list[VehicleTimeline] = field(default_factory=list)

    @property
    def end(self) -> int:
        """The length of the log, in microseconds."""
        return self.segments[-1].end if self.segments else 0

    def unix_us(self, start: int, at: int) -> int:
        """UTC of `at`, the end of an interval that began at `start`. Both are in one segment."""
        index = bisect.bisect_right(self.segments, start, key=lambda segment: segment.start) - 1
        segment = self.segments[max(0, index)]
        return segment.unix_us + at - segment.start


class TimelineBuilder:
    """Builds a timeline: call `begin`, then `sample` whenever a handle may have changed, then `end`."""

    def __init__(self, name: str) -> None:
        self.timeline = Timeline(name)
        self._origin = 0.0
        self._recorders: dict[str, _Recorder] = {}

    def begin(self, now: Instant) -> None:
        """The log begins, or its clock was set. All intervals end here."""
        if not self.timeline.segments:
            self._origin = now.mono
        else:
            self.end(now)
        at = self._elapsed(now)
        self.timeline.segments.append(Segment(at, at, now.unix_us))

    def sample(self, handles: Iterable[IndustrialRobotStatusHandle], now: Instant) -> None:
        """Record the values of the handles at `now`."""
        for handle in handles:
            recorder = self._recorders.get(handle.name)
            if recorder is None:
                recorder = self._recorders[handle.name] = _Recorder(VehicleTimeline(handle.name))
                self.timeline.vehicles.append(recorder.vehicle)
            recorder.sample(handle, self._elapsed(now))

    def end(self, now: Instant) -> None:
        """The log, or a segment of it, ends."""
        at = self._elapsed(now)
        self.timeline.segments[-1] = self.timeline.segments[-1]._replace(end=at)
        for recorder in self._recorders.values():
            recorder.end(at)

    def _elapsed(self, now: Instant) -> int:
        return round((now.mono - self._origin) * 1e6)


_Named = tuple[str, "str | None"]
"""A reason by its name and text."""


class _Recorder:
    """The open intervals of one vehicle."""

    def __init__(self, vehicle: VehicleTimeline) -> None:
        self.vehicle = vehicle
        self._seen: tuple[RobotStatus, Detail] | None = None
        self._values: dict[str, Span] = {}
        self._errors: dict[_Named, Reason] = {}
        self._inhibits: dict[_Named, Reason] = {}
        self._not_ready: dict[_Named, Reason] = {}

    def sample(self, handle: IndustrialRobotStatusHandle, at: int) -> None:
        status, detail = handle.status, handle.detail
        if self._seen is not None and self._seen[0] is status and self._seen[1] is detail:
            return
        self._seen = status, detail
        vehicle = self.vehicle
        vehicle.system, vehicle.component = detail.system, detail.component
        vehicle.members = detail.members
        vehicle.name = detail.vehicle.name
        vehicle.autopilot = detail.vehicle.autopilot or vehicle.autopilot
        vehicle.type = detail.vehicle.type or vehicle.type
        for name, value in values_of(status, detail).items():
            self._value(name, value, handle.evidence, at)
        errors = [Reason(at, at, error.name, error.code, error.text, error.handle) for error in detail.errors]
        inhibits = [Reason(at, at, one.name, None, one.text, one.handle) for one in detail.inhibits]
        _follow(self._errors, vehicle.errors, errors, at)
        not_ready = [Reason(at, at, one.why, None, None, one.handle) for one in detail.not_ready]
        _follow(self._inhibits, vehicle.inhibits, inhibits, at)
        _follow(self._not_ready, vehicle.not_ready, not_ready, at)

    def end(self, at: int) -> None:
        for name, span in self._values.items():
            _close(self.vehicle.tracks[name], span, at)
        _follow(self._errors, self.vehicle.errors, (), at)
        _follow(self._inhibits, self.vehicle.inhibits, (), at)
        _follow(self._not_ready, self.vehicle.not_ready, (), at)
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
        **{field.name: field.word(getattr(status, field.name)) for field in STATES},
    }


def _armed(detail: Detail) -> TriState:
    """Whether the autopilot is armed. A connected vehicle that is not armed has the inhibit DISARMED.

    A group has no autopilot of its own.
    """
    if detail.link is not LinkState.CONNECTED or detail.members:
        return TriState.UNKNOWN
    names = {inhibit.name for inhibit in detail.inhibits}
    return TriState.UNKNOWN if names & UNTOLD else TriState("DISARMED" not in names)


def _follow(is_open: dict[_Named, Reason], closed: list[Reason], active: Iterable[Reason], at: int) -> None:
    """Close reasons that ended or have a new text; open new ones."""
    now = {(reason.title, reason.text): reason for reason in active}
    for key in [key for key in is_open if key not in now]:
        _close(closed, is_open.pop(key), at)
    for key, reason in now.items():
        is_open.setdefault(key, reason)


def _close(into: list[Span] | list[Reason], what: Span | Reason, at: int) -> None:
    """Close an interval. An empty one is left out."""
    if at > what.start:
        into.append(what._replace(end=at))  # type: ignore[arg-type]
