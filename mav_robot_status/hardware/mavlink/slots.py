"""The vehicle slots: those of the configuration, or up to 256 of the vehicles heard, each under a handle.

A vehicle that was heard only briefly gives up its place soon, if there are many such: they may be forged, or a mistake.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final

from ...interface import DEFAULT_HANDLE_NAME, LinkState
from ...mavlink.enumerations import MAV_COMP_ID_AUTOPILOT1
from .vehicle import ExpectedVehicle, TrackedVehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...interface import IndustrialRobotStatusInterface
    from .belief import Belief
    from .options import HardwareOptions
    from .vehicle import Names

log = logging.getLogger(__name__)

Ids = tuple[int, int]

PLAIN: Final = (1, 1)
"""The ids of the vehicle whose handle has no ids in its name: autopilots have these unless somebody changes them."""
MOST_VEHICLES: Final = 256
LOGGED: Final = 5
"""The most ids in one log line."""
GONE: Final = 10.0
"""Seconds after its link loss for which a vehicle that was heard only briefly keeps its place, if there are more than
MOST_PASSING of its kind."""
MOST_PASSING: Final = 8


class VehicleSlots:
    """The vehicles of a hardware interface. Times are monotonic seconds."""

    def __init__(
        self,
        slots: Sequence[ExpectedVehicle],
        handles: IndustrialRobotStatusInterface,
        beliefs: dict[Ids, Belief],
        names: Names,
    ) -> None:
        """`slots`: the vehicles of the configuration. Without one, every autopilot gets a place and a handle.

        A name in `names` takes precedence over the name of a slot.
        """
        self._names = names
        # exact ids match before open ones
        ordered = sorted(slots, key=lambda slot: (slot.system is None, slot.component is None))
        self.expected = [TrackedVehicle(slot, self._name(slot, slot.system, slot.component)) for slot in ordered]
        self.tracked: dict[Ids, TrackedVehicle] = {}
        """The vehicles heard so far."""
        self.is_open = not slots
        self.expire_at = math.inf
        """When the first vehicle that was heard only briefly loses its place."""
        self._handles = handles
        self._beliefs = beliefs
        self._newcomers = Newcomers()
        self._crowded_until = -math.inf
        """Until when vehicles that were heard only briefly give up their places."""
        for slot in slots:
            handles.register_handle(next(t.handle for t in self.expected if t.slot is slot))

    def place(self, ids: Ids, belief: Belief | None = None) -> TrackedVehicle | None:
        """A new vehicle with these ids; None if no entry matches. `belief`: who is known to speak with them."""
        tracked = next((t for t in self.expected if t.matches(*ids)), None)
        if tracked is None and self.is_open and len(self.tracked) < MOST_VEHICLES:
            tracked = TrackedVehicle(ExpectedVehicle(*ids, handle_name(ids)))
            self._handles.register_handle(tracked.handle)
        if tracked is not None:
            self.give(tracked, ids, belief)
        return tracked

    def give(self, tracked: TrackedVehicle, ids: Ids, belief: Belief | None = None) -> None:
        """Give these ids to a vehicle in place of those that it had."""
        if tracked.ids is not None:
            del self.tracked[tracked.ids]
            self._beliefs.pop(tracked.ids, None)
        tracked.ids = ids
        tracked.name = self._name(tracked.slot, *ids)
        tracked.belief = self._beliefs.setdefault(ids, belief or tracked.belief)
        self.tracked[ids] = tracked

    def succeed(self, ids: Ids) -> TrackedVehicle | None:
        """The vehicle whose entry leaves the component open, if this sender takes it over from the one before.

        Component 1 is the autopilot: it takes the entry at once from another component of its system, but not from one
        that is armed.
        """
        if ids[1] != MAV_COMP_ID_AUTOPILOT1:
            return None
        for tracked in self.expected:
            owner = tracked.ids
            if owner is None or tracked.slot.component is not None or owner[0] != ids[0] or tracked.is_armed:
                continue
            log.info("vehicle %d.%d: its handle '%s' is now that of %d.%d", *owner, tracked.handle.name, *ids)
            tracked.forget()
            tracked.requests = tracked.parameters = None
            self.give(tracked, ids)
            return tracked
        return None

    def room_for(self, ids: Ids, now: float, options: HardwareOptions) -> list[TrackedVehicle] | None:
        """Whether a vehicle with these ids that sends its first HEARTBEAT gets a place.

        None: it gets no place. Otherwise the vehicles that give up their place for it: `remove` them.
        """
        if any(t.matches(*ids) for t in self.expected):
            return []
        if self.is_open:
            full, holders = len(self.tracked) >= MOST_VEHICLES, list(self.tracked.values())
        else:
            full, holders = True, [t for t in self.expected if t.accepts(*ids) and not t.established]
        if (full and not holders) or not self._newcomers.admits(ids, full, now):
            return None
        if not full:
            return []
        silent = [t for t in holders if _gives_way(t, now, options)]
        return [min(silent, key=lambda t: (t.established, t.last_heard))] if silent else None

    def lost(self, tracked: TrackedVehicle, options: HardwareOptions) -> None:
        """The link of a vehicle is lost: it keeps its place if it was there long enough, else for a while."""
        tracked.established = tracked.established or tracked.has_lasted
        if self.is_open and not tracked.established:
            self.expire_at = min(self.expire_at, tracked.last_heard + options.heartbeat_timeout + GONE)

    def expired(self, now: float, options: HardwareOptions) -> list[TrackedVehicle]:
        """The silent vehicles that were heard only briefly and lose their places now, because there are many."""
        passing = [tracked for tracked in self.tracked.values() if self._is_passing(tracked)]
        keep = options.heartbeat_timeout + GONE
        gone = [tracked for tracked in passing if now >= tracked.last_heard + keep]
        if len(passing) > MOST_PASSING:
            self._crowded_until = now + keep
        elif now > self._crowded_until:
            gone, passing = [], [tracked for tracked in passing if now < tracked.last_heard + keep]
        self.expire_at = min((t.last_heard + keep for t in passing if t not in gone), default=math.inf)
        if gone:
            first = ", ".join("{}.{}".format(*(tracked.ids or (0, 0))) for tracked in gone[:LOGGED])
            more = f" and {len(gone) - LOGGED} more" if len(gone) > LOGGED else ""
            log.info("no longer a vehicle, heard only briefly: %s%s", first, more)
        return gone

    def remove(self, tracked: TrackedVehicle) -> None:
        """Free the place of a vehicle. A handle that the configuration names stays, for another vehicle."""
        assert tracked.ids is not None
        del self.tracked[tracked.ids]
        self._beliefs.pop(tracked.ids, None)
        tracked.forget()
        if tracked in self.expected:
            slot, tracked.ids = tracked.slot, None
            tracked.name = self._name(slot, slot.system, slot.component)
            tracked.handle.detail = tracked.unheard(slot.system, slot.component)
            tracked.requests = tracked.parameters = None
        else:
            self._handles.remove_handle(tracked.handle.name)

    def _name(self, slot: ExpectedVehicle, system: int | None, component: int | None) -> str | None:
        """The name of the vehicle with these ids. None: the id is not known yet."""
        if system is None:
            return slot.name
        return self._names.get((system, component)) or self._names.get((system, None)) or slot.name

    def _is_passing(self, tracked: TrackedVehicle) -> bool:
        """Whether it is silent, was heard only briefly, and the configuration does not name its handle."""
        return self.is_open and tracked.handle.detail.link is LinkState.LOST and not tracked.established


def handle_name(ids: Ids) -> str:
    """The handle of a vehicle that the configuration does not name. It depends on the ids alone."""
    return DEFAULT_HANDLE_NAME if ids == PLAIN else f"{DEFAULT_HANDLE_NAME}/{ids[0]}.{ids[1]}"


def _gives_way(tracked: TrackedVehicle, now: float, options: HardwareOptions) -> bool:
    """Whether it is silent, and gives up its place. One HIGH_LATENCY2 is not enough to keep a place for a minute."""
    briefly = tracked.costly and not tracked.has_lasted
    return now - tracked.last_heard > (options.heartbeat_timeout if briefly else tracked.timeout(options))


log = logging.getLogger(__name__)

SECONDS: Final = 3
"""A newcomer must have sent a HEARTBEAT in this many different seconds of a WINDOW."""
WINDOW: Final = 10.0
LOG_PERIOD: Final = 60.0  # s between two log lines
PAIRS: Final = 1 << 16


class Newcomers:
    """Counts the heartbeats of ids without a place, while newcomers crowd."""

    def __init__(self) -> None:
        self._crowded_until = self._second_ends = self._window_ends = self._log_at = -math.inf
        self._second = self._seconds = bytearray()
        """Which ids sent a heartbeat in this second, and in how many seconds of this window."""

    def admits(self, ids: tuple[int, int], full: bool, now: float) -> bool:
        """Whether an id without a place, which sends a heartbeat, gets one. `full`: no place is free."""
        if full and now >= self._log_at:
            self._log_at = now + LOG_PERIOD
            log.warning(
                "no place for vehicle %d.%d: the table of vehicles is full. A newcomer gets the place of a vehicle "
                "that is silent; vehicles in the configuration always have theirs",
                *ids,
            )
        if not full and now >= self._crowded_until:
            self._second = self._seconds = bytearray()
            return True
        self._crowded_until = now + WINDOW
        if now >= self._window_ends or not self._seconds:
            self._seconds, self._window_ends = bytearray(PAIRS), now + WINDOW
        if now >= self._second_ends or not self._second:
            self._second, self._second_ends = bytearray(PAIRS), now + 1.0
        pair = ids[0] << 8 | ids[1]
        if not self._second[pair]:
            self._second[pair] = 1
            self._seconds[pair] += 1
        return self._seconds[pair] >= SECONDS
