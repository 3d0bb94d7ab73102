"""When the vehicles of a recorded log were heard, and their last status before a silence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from ...clock import Instant
from ...gateway.observer import Observer
from ...interface import STATES, IndustrialRobotStatusHandle, IndustrialRobotStatusInterface, LinkState

FRESH: Final = 1.5
"""Seconds for which a status counts as that at the latest heartbeat. Then its fields become unknown one by one."""


class LastStatus(NamedTuple):
    """A status when a vehicle was last heard."""

    flight_mode: str | None = None
    fields: Mapping[str, Any] = {}
    """The values by field, as in a JSON line."""
    errors: tuple[str, ...] = ()
    inhibits: tuple[str, ...] = ()


class Heard(NamedTuple):
    """When a vehicle of a log was heard."""

    seconds: float
    """The time in which it was heard, without its silences."""
    times: int
    """One more than the number of times it came back."""
    until_us: int
    """Its last heartbeat, in Unix microseconds."""
    silence: float
    """Seconds of silence at the end of the log; 0 if it was heard until then."""
    last: LastStatus

    @property
    def words(self) -> str:
        """`4 min 12 s`, and how often."""
        return duration(self.seconds) + (f" in {self.times} pieces" if self.times > 1 else "")


class _Watched:
    """What is known of one handle so far."""

    __slots__ = ("first", "heard_at", "last", "lost", "seconds", "times")

    def __init__(self, heard_at: float) -> None:
        self.first = self.heard_at = heard_at
        self.seconds = 0.0
        self.times = 1
        self.lost = False
        self.last = LastStatus()

    def hear(self, heard_at: float) -> None:
        """A heartbeat came. After a loss it begins another piece."""
        if self.lost:
            self.seconds += self.heard_at - self.first
            self.first = heard_at
            self.times += 1
        self.heard_at, self.lost = heard_at, False


class Listener(Observer):
    """Notes when each handle is heard."""

    def __init__(self) -> None:
        self._watched: dict[str, _Watched] = {}

    def on_tick(self, handles: IndustrialRobotStatusInterface, now: Instant) -> None:
        """Look at all handles."""
        for handle in handles:
            at, connected = handle.heard_at, handle.detail.link is LinkState.CONNECTED
            if at is None:
                continue
            known = self._watched.get(handle.name)
            if known is None:
                known = self._watched[handle.name] = _Watched(at)
            if at != known.heard_at:
                known.hear(at)
            if connected and now.mono - at <= FRESH:
                known.last = _status(handle)
            known.lost = known.lost or not connected

    def heard(self, handle: IndustrialRobotStatusHandle, end: Instant) -> Heard | None:
        """What was noted of a handle, in a log that ends at `end`; None if it was never heard."""
        known = self._watched.get(handle.name)
        if known is None:
            return None
        if handle.heard_at is not None and handle.heard_at != known.heard_at:
            known.hear(handle.heard_at)
        silence = end.mono - known.heard_at
        return Heard(
            known.seconds + known.heard_at - known.first,
            known.times,
            end.unix_us - round(silence * 1e6),
            silence if known.lost else 0.0,
            known.last,
        )


def _status(handle: IndustrialRobotStatusHandle) -> LastStatus:
    detail = handle.detail
    return LastStatus(
        detail.vehicle.flight_mode,
        {field.name: field.plain(getattr(handle.status, field.name)) for field in STATES},
        tuple(error.name for error in detail.errors),
        tuple(dict.fromkeys(inhibit.name for inhibit in detail.inhibits)),
    )


def duration(seconds: float) -> str:
    """`0.4 s`, `12 s`, `4 min 12 s`, `1 h 02 min`."""
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:
        return f"{minutes} min {rest} s" if minutes else f"{rest} s"
    return f"{minutes // 60} h {minutes % 60:02} min"
