"""Which way each vehicle is heard: the same vehicle over two links is one vehicle.

One way at a time counts, for the copies that come the other way say nothing new, and old news if that way is slow.
Another way is taken once the present one is silent. Two autopilots that claim the same ids are told apart by their
clocks: one vehicle has booted at one time, whichever way it is heard.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Generic, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from ..mavlink.framing import Frame

SILENCE: Final = 1.5
"""Seconds without a frame after which another way is taken: more than the second between two heartbeats, and soon
enough that the link does not count as lost (3.5 s)."""
APART: Final = 10.0
"""Seconds between the boot times of two autopilots, at least: a slow way delays by less."""
PROOFS: Final = 5
"""Samples that have to agree that there are two."""
MOST_WAYS: Final = 8
FRESH: Final = 3.0
"""Seconds for which a boot time stands as evidence: after a reboot one way tells it before the other."""

CLOCKS: Final = frozenset({2, 30, 32, 33})
"""Message ids with time_boot_ms: SYSTEM_TIME, ATTITUDE, positions."""


C = TypeVar("C")
"""A channel, compared by identity or as a key; what it is does not matter here."""


class Way(Generic[C]):
    """One way on which a vehicle is heard."""

    __slots__ = ("at", "booted", "channel", "clock_at")

    def __init__(self, channel: C) -> None:
        self.channel = channel
        self.at = 0.0
        self.booted = self.clock_at = -math.inf


class Path(Generic[C]):
    """One vehicle: the way that counts, and the others."""

    __slots__ = ("contradictions", "others", "way")

    def __init__(self, way: Way[C]) -> None:
        self.way = way
        self.others: dict[C, Way[C]] = {}
        self.contradictions = 0


class Paths(Generic[C]):
    """The ways of all vehicles; no more of them than the hardware has vehicles."""

    def __init__(self) -> None:
        self._paths: dict[tuple[int, int], Path[C]] = {}
        self.duplicates = 0
        """Frames that came another way than the one that counts."""
        self.changes = 0

    def way(self, ids: tuple[int, int]) -> C | None:
        """The channel on which a vehicle is heard."""
        path = self._paths.get(ids)
        return None if path is None else path.way.channel

    def vehicles(self) -> Iterable[tuple[int, int]]:
        """The ids of all vehicles that have been heard."""
        return self._paths.keys()

    def keep(self, stays: Callable[[C], bool]) -> None:
        """Forget the channels that do not stay; a vehicle that was heard on no other is forgotten."""
        for ids, path in list(self._paths.items()):
            others = {channel: way for channel, way in path.others.items() if stays(channel)}
            if not stays(path.way.channel):
                if not others:
                    del self._paths[ids]
                    continue
                path.way = others.pop(max(others, key=lambda channel: others[channel].at))
            path.others = others

    def take(self, ids: tuple[int, int], channel: C, now: float) -> None:
        """A frame is known to be newer than all before: the way that it came is the one that counts."""
        path = self._paths.get(ids)
        if path is not None:
            if path.way.channel is not channel:
                path.way = Way(channel)
            path.way.at = now

    def learn(self, ids: tuple[int, int], channel: C, now: float) -> None:
        """A heartbeat of a vehicle was taken from this channel."""
        path = self._paths.get(ids)
        if path is None:
            path = self._paths[ids] = Path(Way(channel))
        path.way.at = now

    def counts(self, frame: Frame, channel: C, now: float) -> bool:
        """Whether a frame came the way that counts for its vehicle; True for everything that is no vehicle's."""
        path = self._paths.get(frame.ids)
        if path is None:
            return True
        way = path.way
        if way.channel is channel:
            way.at = now
            if path.others and frame.message_id in CLOCKS:
                _note_clock(way, frame, now)
            return True
        if frame.message_id == 0 and now - way.at > SILENCE:
            _remember(path, way)
            path.way = path.others.pop(channel) if channel in path.others else Way(channel)
            path.way.at = now
            self.changes += 1
            return True
        self.duplicates += 1
        other = path.others.get(channel)
        if other is None:
            other = Way(channel)
            _remember(path, other)
        other.at = now
        if frame.message_id in CLOCKS:
            _note_clock(other, frame, now)
            path.contradictions = path.contradictions + 1 if _contradicts(way, other, now) else 0
        return False

    def conflict(self, frame: Frame, channel: C) -> tuple[C, C] | None:
        """The two ends that claim the ids of this frame, if its clock has just shown so for the PROOFS-th time."""
        path = self._paths.get(frame.ids)
        if path is None or path.contradictions < PROOFS:
            return None
        path.contradictions = 0
        return path.way.channel, channel


def _remember(path: Path[C], way: Way[C]) -> None:
    """Keep one more way that does not count; of too many the longest silent goes."""
    if len(path.others) >= MOST_WAYS:
        del path.others[min(path.others.values(), key=lambda other: other.at).channel]
    path.others[way.channel] = way


def _note_clock(way: Way[C], frame: Frame, now: float) -> None:
    way.booted = now - frame.message.time_boot_ms / 1000
    way.clock_at = now


def _contradicts(way: Way[C], other: Way[C], now: float) -> bool:
    return now - way.clock_at < FRESH and abs(way.booted - other.booted) > APART
