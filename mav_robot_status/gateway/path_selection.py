"""Select one route for each vehicle: a vehicle heard on two links is one vehicle.

Only frames of the selected route are used. Copies on other routes contain nothing new, and are late on a slow route.
When the selected route is silent, another one is selected. The clocks reveal two autopilots with the same ids: one
vehicle has the same boot time on every route.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterable

    from ..mavlink.framing import Frame

SILENCE: Final = 1.5
"""Seconds without a frame after which another route is selected. Longer than the heartbeat period, shorter than the
heartbeat timeout (3.5 s)."""
APART: Final = 10.0
"""Boot times that differ by more seconds belong to two autopilots. A slow route delays by less."""
PROOFS: Final = 5
"""Consecutive samples that prove two autopilots."""
MOST_ROUTES: Final = 8
FRESH: Final = 3.0
"""Seconds for which a boot time is valid: after a reboot one route shows the new one before the other."""

CLOCKS: Final = frozenset({2, 30, 32, 33})
"""Message ids with time_boot_ms: SYSTEM_TIME, ATTITUDE, positions."""


C = TypeVar("C")
"""A channel: any hashable value."""


class Route(Generic[C]):
    """One channel on which a vehicle is heard."""

    __slots__ = ("at", "booted", "channel", "clock_at")

    def __init__(self, channel: C) -> None:
        self.channel = channel
        self.at = 0.0
        self.booted = self.clock_at = -math.inf


class Path(Generic[C]):
    """The selected route of one vehicle, and the others."""

    __slots__ = ("contradictions", "others", "route")

    def __init__(self, route: Route[C]) -> None:
        self.route = route
        self.others: dict[C, Route[C]] = {}
        self.contradictions = 0


class PathSelection(Generic[C]):
    """The routes of all vehicles. Bounded by the number of vehicles of the hardware interface."""

    def __init__(self) -> None:
        self._paths: dict[tuple[int, int], Path[C]] = {}
        self.duplicates = 0
        """Frames on routes that were not selected."""
        self.changes = 0

    def channel(self, ids: tuple[int, int]) -> C | None:
        """The selected channel of a vehicle."""
        path = self._paths.get(ids)
        return None if path is None else path.route.channel

    def vehicles(self) -> Iterable[tuple[int, int]]:
        """The ids of all vehicles that have been heard."""
        return self._paths.keys()

    def keep(self, stays: Callable[[C], bool]) -> None:
        """Forget the other channels, and the vehicles that were heard only there."""
        for ids, path in list(self._paths.items()):
            others = {channel: route for channel, route in path.others.items() if stays(channel)}
            if not stays(path.route.channel):
                if not others:
                    del self._paths[ids]
                    continue
                path.route = others.pop(max(others, key=lambda channel: others[channel].at))
            path.others = others

    def retain(self, ids: Container[tuple[int, int] | None]) -> None:
        """Forget all other vehicles."""
        for gone in [one for one in self._paths if one not in ids]:
            del self._paths[gone]

    def take(self, ids: tuple[int, int], channel: C, now: float) -> None:
        """Select the route of a frame that is known to be newer than all before."""
        path = self._paths.get(ids)
        if path is not None:
            if path.route.channel is not channel:
                path.route = Route(channel)
            path.route.at = now

    def learn(self, ids: tuple[int, int], channel: C, now: float) -> None:
        """Note a heartbeat of a vehicle on this channel."""
        path = self._paths.get(ids)
        if path is None:
            path = self._paths[ids] = Path(Route(channel))
        path.route.at = now

    def accepts(self, frame: Frame, channel: C, now: float) -> bool:
        """Whether a frame arrived on the selected route of its vehicle. True for frames of other components."""
        path = self._paths.get(frame.ids)
        if path is None:
            return True
        route = path.route
        if route.channel is channel:
            route.at = now
            if path.others and frame.message_id in CLOCKS:
                _note_clock(route, frame, now)
            return True
        if frame.message_id == 0 and now - route.at > SILENCE:
            _remember(path, route)
            path.route = path.others.pop(channel) if channel in path.others else Route(channel)
            path.route.at = now
            self.changes += 1
            return True
        self.duplicates += 1
        other = path.others.get(channel)
        if other is None:
            other = Route(channel)
            _remember(path, other)
        other.at = now
        if frame.message_id in CLOCKS:
            _note_clock(other, frame, now)
            path.contradictions = path.contradictions + 1 if _contradicts(route, other, now) else 0
        return False

    def conflict(self, frame: Frame, channel: C) -> tuple[C, C] | None:
        """The two channels that claim the ids of this frame, after PROOFS contradictions of their clocks. Else None."""
        path = self._paths.get(frame.ids)
        if path is None or path.contradictions < PROOFS:
            return None
        path.contradictions = 0
        return path.route.channel, channel


def _remember(path: Path[C], route: Route[C]) -> None:
    """Keep a route that is not selected. At the limit, drop the one that is silent longest."""
    if len(path.others) >= MOST_ROUTES:
        del path.others[min(path.others.values(), key=lambda other: other.at).channel]
    path.others[route.channel] = route


def _note_clock(route: Route[C], frame: Frame, now: float) -> None:
    route.booted = now - frame.message.time_boot_ms / 1000
    route.clock_at = now


def _contradicts(route: Route[C], other: Route[C], now: float) -> bool:
    return now - route.clock_at < FRESH and abs(route.booted - other.booted) > APART
