"""Which frames go on to which channels. No input or output of its own: channels are opaque, time is an argument.

The rules are those of https://mavlink.io/en/guide/routing.html. Where it leaves a choice:

* A frame for a component that was heard goes where exactly that component was heard (mavlink-router). If it never was,
  but its system was, the frame goes where the system was heard: so does ArduPilot for systems other than its own
  (MAVLink_routing.cpp, 2c), while mavlink-router drops it. Thus a component behind the autopilot that only listens is
  reached as on a direct cable.
* Nothing goes to a channel where its very sender was heard: who is there has it already (mavlink-router, accept_msg).
* Between two vehicle links a broadcast passes only if both lead to parts of the same system (MAVROS's router keeps
  vehicles apart, too). An autopilot may take another vehicle's DISTANCE_SENSOR or GPS_INPUT for its own, and two
  telemetry streams do not fit one radio. Everything else passes: vehicle to outs, out to vehicles and to other outs.
* A frame that comes again on another channel is a copy. It is dropped, and is no evidence of who is where: a line that
  echoes would else seem to be where everybody is. Repeats on the channel of the first are passed on (senders whose
  sequence stands still repeat themselves), until a copy has shown that this frame goes round.
* Frames of ids that we do not know are broadcasts, and as nobody could check them nobody is learned from them.
"""

from __future__ import annotations

import math
from collections import Counter, OrderedDict
from typing import TYPE_CHECKING, Final, Generic, Protocol, TypeVar

from ..mavlink.definitions import CRC_EXTRA
from ..mavlink.targets import TARGETS

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from ..mavlink.framing import Frame

SILENCE: Final = 300.0
"""Seconds after which it is forgotten who was heard where."""
WINDOW: Final = 1.0
"""Seconds for which a frame is known again, at least; twice that at most. A decision is kept no longer, either."""
MOST_ROUTES: Final = 1024
"""Components times channels; the least recently heard goes."""
MOST_FRAMES: Final = 8192
"""Frames in a window; if more come, the window is shorter."""
MOST_DECISIONS: Final = 4096

WHOLE: Final = -1  # stands for the component where the whole system is meant
EVERYBODY: Final = (0, 0)
UNCHECKED: Final = (0, -1)  # everybody, and the frame proves nothing
CAME_AGAIN: Final = object()


class Channel(Protocol):
    """What routing asks of a channel. It is hashable, and equal only to itself."""

    @property
    def is_out(self) -> bool:
        """Whether it leads to ground stations rather than to vehicles."""

    @property
    def passive(self) -> bool:
        """Whether nothing may ever be sent there."""


C = TypeVar("C", bound=Channel)


class Router(Generic[C]):
    """Learns who is on which channel, and says where a frame goes."""

    def __init__(self) -> None:
        self._own: frozenset[tuple[int, int]] = frozenset()
        self._heard: OrderedDict[tuple[C, int, int], float] = OrderedDict()
        """Channel, system, component -> when; the least recently heard first."""
        self._where: dict[tuple[int, int], Counter[C]] = {}
        """The same by (system, component) and by (system, WHOLE)."""
        self._channels: tuple[C, ...] = ()
        self._decisions: dict[tuple[C, tuple[int, int], tuple[int, int]], tuple[C, ...]] = {}
        """By channel and sender and target."""
        self._recent: dict[int, object] = {}
        """By hash of the frame: the channel on which it came first, or CAME_AGAIN; of this window."""
        self._older: dict[int, object] = {}
        """The same, of the window before."""
        self._turn_at = -math.inf

    def speak_as(self, own: Collection[tuple[int, int]]) -> None:
        """The systems and components that are ourselves: what comes back from or is meant for them goes nowhere."""
        if self._own != own:
            self._own = frozenset(own)
            self._decisions.clear()

    def heard(self, channel: C, system: int, component: int, now: float) -> None:
        """A checked frame of this sender came on this channel."""
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
        """Where a frame goes that came on `came_from`; its sender is learned, at least once in each window.

        `frame` is a parser's that keeps `raw`. `channels` are all that may be sent to, the same tuple as long as they
        are the same: decisions are kept that long.
        """
        if now >= self._turn_at or len(self._recent) >= MOST_FRAMES:
            self._turn(now)
        if self._is_copy(frame.raw, came_from):
            return ()
        if channels is not self._channels:
            self._channels = channels
            self._decisions.clear()
        target = _target(frame)
        key = came_from, frame.ids, target
        decision = self._decisions.get(key)
        if decision is None:
            if target is not UNCHECKED:
                self.heard(came_from, *frame.ids, now)
            if len(self._decisions) >= MOST_DECISIONS:
                self._decisions.clear()
            decision = self._decisions[key] = self._decide(came_from, frame.ids, target)
        return decision

    def plan(
        self, data: bytes, frames: Sequence[Frame], came_from: C, channels: tuple[C, ...], now: float
    ) -> list[tuple[bytes, tuple[C, ...]]]:
        """What to send where of the frames that came with `data`: a datagram, or b"" where bytes come as a stream.

        A datagram is sent as it came if it is all frames and all go to the same channels; else each frame is sent on
        its own, without the bytes between them.
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

    def _decide(self, came_from: C, sender: tuple[int, int], target: tuple[int, int]) -> tuple[C, ...]:
        """Where frames of this sender to this target go, from all that is known now."""
        if sender in self._own or target in self._own:
            return ()
        where, nowhere = self._where, Counter[C]()
        has_it = where.get(sender, nowhere)
        others = [c for c in self._channels if c != came_from and not c.passive and c not in has_it]
        system, component = target
        if system:
            exact = where.get(target) if component else None
            reached = exact or where.get((system, WHOLE), nowhere)
            return tuple(c for c in others if c in reached)
        same_system = where.get((sender[0], WHOLE), nowhere)
        return tuple(c for c in others if came_from.is_out or c.is_out or c in same_system)

    def _is_copy(self, raw: bytes, came_from: C) -> bool:
        """Whether this frame came first on another channel, or is known to go round."""
        key = hash(raw)
        first = self._recent.get(key) or self._older.get(key)
        if first is None or first == came_from:
            self._recent[key] = came_from
            return False
        if first is not CAME_AGAIN:
            self._recent[key] = CAME_AGAIN
        return True

    def _turn(self, now: float) -> None:
        """Begin another window."""
        self._older = self._recent if now < self._turn_at + WINDOW else {}
        self._recent = {}
        self._turn_at = now + WINDOW
        self._decisions.clear()
        while self._heard and now - next(iter(self._heard.values())) > SILENCE:
            self._forget_oldest()

    def _forget_oldest(self) -> None:
        (channel, system, component), _ = self._heard.popitem(last=False)
        for ids in ((system, component), (system, WHOLE)):
            channels = self._where[ids]
            channels[channel] -= 1
            if not channels[channel]:
                del channels[channel]
            if not channels:
                del self._where[ids]


def _target(frame: Frame) -> tuple[int, int]:
    """System and component that a frame is for; MAVLink 2 leaves trailing zeros away, and zero is everybody."""
    offsets = TARGETS.get(frame.message_id)
    if offsets is None:
        return EVERYBODY if frame.message_id in CRC_EXTRA else UNCHECKED
    payload = frame.payload
    size = len(payload)
    system_at, component_at = offsets
    system = payload[system_at] if system_at < size else 0
    return system, payload[component_at] if 0 <= component_at < size else 0
