"""Decides to which channels a frame is forwarded. No I/O: channels are opaque, time is an argument.

The rules are those of https://mavlink.io/en/guide/routing.html. Where they leave a choice:

* A frame for a known component goes to the channels on which that component was heard (mavlink-router). If only its
  system is known, the frame goes to the channels of the system. ArduPilot does the same for systems other than its own
  (MAVLink_routing.cpp, 2c); mavlink-router drops the frame. This reaches a component behind the autopilot that only
  listens, as on a direct cable.
* A broadcast does not go to a channel from which its sender still comes: receivers there already have it
  (mavlink-router, accept_msg). "Still" means PRESENT seconds since its last frame there, and for a heartbeat
  BEAT_PRESENT seconds since its last heartbeat there. An autopilot passes the heartbeat of a ground station on to us.
  When the station then moves and comes through us alone, the autopilot must have its heartbeats within two
  seconds: they keep its failsafe away.
* A frame for one system is never held back for that reason. A command that arrives twice is better than one that is
  lost.
* Between two vehicle links a broadcast is forwarded only if both lead to the same system (MAVROS's router also keeps
  vehicles apart). An autopilot could use another vehicle's DISTANCE_SENSOR or GPS_INPUT as its own, and two telemetry
  streams do not fit one radio. A component of that system other than the sender must be there: an autopilot does not
  need its own telemetry from its other link. All other directions are forwarded: vehicle to outs, out to vehicles and
  other outs.
* A frame that arrives again on another channel is a copy. It is dropped, and the router learns nothing from it:
  otherwise every sender would seem to be on a line that echoes.
* A frame that arrives again on its first channel may come from a sender with a constant sequence number, which repeats
  itself, or from a loop beyond that channel. It is forwarded every REPEAT seconds while the sender has used no other
  sequence number since, until a copy on another channel shows that it loops.
* Frames with unknown ids are broadcasts. Their CRC cannot be checked, so the router learns nothing from them. It learns
  nothing from the RADIO_STATUS of a telemetry radio either: no frame is for a radio, and its frames are never signed.
"""

from __future__ import annotations

import math
from collections import Counter, OrderedDict
from typing import TYPE_CHECKING, Final, Generic, Protocol, TypeVar

from ...mavlink.commands import HEARTBEAT
from ...mavlink.definitions import CRC_EXTRA
from ...mavlink.signing import RADIO
from ...mavlink.targets import TARGETS
from ...mavlink.wire import FORMATS

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from ...mavlink.framing import Frame

SILENCE: Final = 300.0
"""Seconds after which a silent route is forgotten."""
PRESENT: Final = 3.0
"""Seconds for which a sender counts as present on a channel, after a frame of it there."""
BEAT_PRESENT: Final = 1.2
"""The same for heartbeats, after a heartbeat there. They come once a second."""
REPEAT: Final = 0.05
"""Seconds between two repeats of a frame on its first channel. A frame in a loop repeats faster, or others overtake."""
AGAIN: Final = 0.5
"""Seconds after the first copy on another channel for which every such frame is dropped."""
WINDOW: Final = 1.0
"""Copies are recognised for at least this many seconds, and at most twice as many. Decisions are cached as long."""
MOST_ROUTES: Final = 1024
"""Limit of components times channels. The least recently heard is dropped."""
MOST_FRAMES: Final = 8192
"""Frames in a window. More frames make the window shorter."""
MOST_DECISIONS: Final = 4096

WHOLE: Final = -1  # instead of a component: the whole system
EVERYBODY: Final = (0, 0)
UNCHECKED: Final = (0, -1)  # a broadcast that teaches nothing


class Channel(Protocol):
    """The properties of a channel that routing needs. Hashable, equal only to itself."""

    @property
    def is_out(self) -> bool:
        """Whether it leads to ground stations and not to vehicles."""

    @property
    def passive(self) -> bool:
        """Whether sending there is forbidden."""


C = TypeVar("C", bound=Channel)


class Router(Generic[C]):
    """Learns which components are on which channel, and decides where a frame goes."""

    def __init__(self) -> None:
        self._own: frozenset[tuple[int, int]] = frozenset()
        self._heard: OrderedDict[tuple[C, int, int], float] = OrderedDict()
        """Channel, system, component -> time; the least recently heard first."""
        self._beats: dict[tuple[C, int, int], float] = {}
        """When the last heartbeat came from there, for a part of the keys of `_heard`."""
        self._where: dict[tuple[int, int], Counter[C]] = {}
        """The channels of each (system, component) and (system, WHOLE)."""
        self._channels: tuple[C, ...] = ()
        self._decisions: dict[tuple[C, tuple[int, int], tuple[int, int]], tuple[C, ...]] = {}
        """By channel, sender and target."""
        self._recent: dict[int, object] = {}
        """The frames of this window, by hash: the channel on which each arrived first, or when a copy showed that it
        also comes on another one."""
        self._older: dict[int, object] = {}
        """The frames of the previous window."""
        self._newest: dict[tuple[C, tuple[int, int]], int] = {}
        """By channel and sender: the sequence number of its last frame in this window."""
        self._repeated: dict[int, float] = {}
        """When a frame that came again on its first channel was last forwarded, by hash."""
        self._turn_at = -math.inf

    def speak_as(self, own: Collection[tuple[int, int]]) -> None:
        """Set our own ids. Frames from them or addressed to them are not forwarded."""
        if self._own != own:
            self._own = frozenset(own)
            self._decisions.clear()

    def heard(self, channel: C, system: int, component: int, now: float) -> None:
        """Learn from a frame with a good CRC that this sender is on this channel."""
        if system == 0 or (system, component) in self._own:
            return
        route = channel, system, component
        if route not in self._heard:
            if len(self._heard) >= MOST_ROUTES:
                self._forget_oldest()
            for ids in ((system, component), (system, WHOLE)):
                self._where.setdefault(ids, Counter())[channel] += 1
            self._decisions.clear()
        self._heard[route] = now
        self._heard.move_to_end(route)

    def destinations(self, frame: Frame, came_from: C, channels: tuple[C, ...], now: float) -> tuple[C, ...]:
        """The channels that get a frame received on `came_from`. Learns its sender at least once in each window.

        `frame` comes from a parser that keeps `raw`. `channels` are all channels that may be sent to. Pass the same
        tuple while they are the same: decisions are cached for that long.
        """
        message_id, ids, sequence, _, raw, _ = frame
        if now >= self._turn_at or len(self._recent) >= MOST_FRAMES:
            self._turn(now)
        sender, key = (came_from, ids), hash(raw)
        if key not in self._recent and key not in self._older:
            self._newest[sender] = sequence
            self._recent[key] = came_from
        elif self._is_copy(key, sender, sequence, now):
            return ()
        if channels is not self._channels:
            self._channels = channels
            self._decisions.clear()
        if message_id == HEARTBEAT:
            return self._heartbeat(ids, came_from, now)
        return self._decided(came_from, ids, _target(message_id, raw), now)

    def _decided(self, came_from: C, ids: tuple[int, int], target: tuple[int, int], now: float) -> tuple[C, ...]:
        """The cached decision for this sender and this target."""
        key = came_from, ids, target
        decision = self._decisions.get(key)
        if decision is None:
            if target is not UNCHECKED:
                self.heard(came_from, *ids, now)
            if len(self._decisions) >= MOST_DECISIONS:
                self._decisions.clear()
            decision = self._decisions[key] = self._decide(came_from, ids, target, self._heard, now - PRESENT)
        return decision

    def decided(self, frame: Frame, came_from: C) -> tuple[C, ...]:
        """The channels that `destinations` gave for this frame or an earlier one like it; none if it is forgotten."""
        return self._decisions.get((came_from, frame.ids, _target(frame.message_id, frame.raw)), ())

    def _heartbeat(self, sender: tuple[int, int], came_from: C, now: float) -> tuple[C, ...]:
        """The channels that get a heartbeat. Decided each time: a decision of a second ago may be too old."""
        self.heard(came_from, *sender, now)
        route = came_from, *sender
        if route in self._heard:
            self._beats[route] = now
        return self._decide(came_from, sender, EVERYBODY, self._beats, now - BEAT_PRESENT)

    def plan(
        self, data: bytes, frames: Sequence[Frame], came_from: C, channels: tuple[C, ...], now: float
    ) -> list[tuple[bytes, tuple[C, ...]]]:
        """The bytes to send, with their channels. `data` is the datagram of the frames, or b"" for a stream.

        A datagram of frames only, all for the same channels, is forwarded unchanged. Otherwise each frame is sent
        separately, without the bytes in between.
        """
        if len(frames) == 1:
            frame = frames[0]
            to = self.destinations(frame, came_from, channels, now)
            return [(frame.raw, to)] if to else []
        parts = [(frame.raw, self.destinations(frame, came_from, channels, now)) for frame in frames]
        if parts:
            first = parts[0][1]
            if all(to == first for _, to in parts) and b"".join([raw for raw, _ in parts]) == data:
                return [(data, first)] if first else []
        return [part for part in parts if part[1]]

    def _decide(
        self,
        came_from: C,
        sender: tuple[int, int],
        target: tuple[int, int],
        times: Mapping[tuple[C, int, int], float],
        since: float,
    ) -> tuple[C, ...]:
        """The channels for frames of this sender to this target.

        `times` says when the sender was heard on each channel; where that is later than `since`, it still comes from
        there.
        """
        if sender in self._own or target in self._own:
            return ()
        where, nowhere = self._where, Counter[C]()
        others = [c for c in self._channels if c != came_from and not c.passive]
        system, component = target
        if system:
            exact = where.get(target) if component else None
            reached = exact or where.get((system, WHOLE), nowhere)
            return tuple(c for c in others if c in reached)
        others = [c for c in others if times.get((c, *sender), -math.inf) <= since]
        already = where.get(sender, nowhere)
        same_system = where.get((sender[0], WHOLE), nowhere)
        return tuple(c for c in others if came_from.is_out or c.is_out or same_system[c] > already[c])

    def _is_copy(self, key: int, sender: tuple[C, tuple[int, int]], sequence: int, now: float) -> bool:
        """Whether this frame, which has come before, arrived first on another channel, or loops."""
        came_from = sender[0]
        recent = self._recent.get(key)
        first = recent or self._older.get(key)
        if first is not None and first != came_from:
            if not isinstance(first, float):
                self._recent[key] = now
                return True
            if now - first < AGAIN:
                return True
            recent = None  # its sender repeats itself on two channels
        constant = self._newest.get(sender) == sequence
        self._newest[sender] = sequence
        self._recent[key] = came_from
        return recent is not None and not (constant and self._may_repeat(key, now))

    def _may_repeat(self, key: int, now: float) -> bool:
        if now - self._repeated.get(key, -math.inf) < REPEAT:
            return False
        self._repeated[key] = now
        return True

    def _turn(self, now: float) -> None:
        """Start the next window."""
        self._older = self._recent if now < self._turn_at + WINDOW else {}
        self._recent = {}
        self._newest = {}
        self._repeated = {}
        self._turn_at = now + WINDOW
        self._decisions.clear()
        while self._heard and now - next(iter(self._heard.values())) > SILENCE:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        route, _ = self._heard.popitem(last=False)
        self._beats.pop(route, None)
        channel, system, component = route
        for ids in ((system, component), (system, WHOLE)):
            channels = self._where[ids]
            channels[channel] -= 1
            if not channels[channel]:
                del channels[channel]
            if not channels:
                del self._where[ids]


def _target(message_id: int, raw: bytes) -> tuple[int, int]:
    """The target system and component of a frame. MAVLink 2 cuts trailing zeros; 0 is a broadcast."""
    offsets = TARGETS.get(message_id)
    if offsets is None:
        return EVERYBODY if message_id in CRC_EXTRA and message_id not in RADIO else UNCHECKED
    header, size = FORMATS[raw[0]].header, raw[1]
    system_at, component_at = offsets
    system = raw[header + system_at] if system_at < size else 0
    return system, raw[header + component_at] if 0 <= component_at < size else 0
