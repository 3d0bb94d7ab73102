"""`MavlinkRobotHW`: the hardware interface. It processes frames, keeps the state of each vehicle, and sets the handles.

The cycle of ros_control: `on_frame` for each frame, `read(time)` into the handles, then send the `due_requests(time)`.

Every frame takes one path. `belief` says who spoke, and when; a handler changes the state of that speaker; the vehicle
is due: at once after an edge (armed, a text, an acknowledgement), else at most SETTLES later. `read` then settles all
its facts, and derives a status if they have changed.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final

from ...due_times import DueTimes
from ...interface import LinkState, RobotHW
from ...mavlink import definitions as mav
from . import vehicle_log
from .autopilots.wanted import METADATA
from .belief import Belief
from .estop.applet import is_word
from .faults.messages import TRANSMITTERS
from .identity import is_autopilot
from .options import HardwareOptions
from .readiness.rule import inhibit
from .reason import EvidenceOfVehicle
from .requests.scheduler import Ask, RequestScheduler
from .satellite.state import stated
from .slots import VehicleSlots
from .subjects import APPLET_ID, ARM_STATUS_ID, COMMAND_IDS, EDGES, FILE_IDS, HEARTBEAT_ID, HIGH_LATENCY_ID
from .update import on_arm_status, on_command, status_at
from .update import on_frame as apply_frame

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Container, Hashable, Iterable, Iterator, Sequence

    from ...clock import Instant
    from ...mavlink.framing import Values
    from .derive import Derived
    from .facts import Facts
    from .px4_events import EventTable
    from .vehicle import ExpectedVehicle, Names, TrackedVehicle

LEAST_WAIT: Final = 1e-3
"""Seconds to the next look at a vehicle, at least: sums of times are rounded."""
SETTLES: Final = 0.05
"""Seconds after which a message that is no edge is in the status."""


class MavlinkRobotHW(RobotHW):
    """The vehicles heard on MAVLink links, as handles."""

    def __init__(
        self,
        options: HardwareOptions | None = None,
        slots: Sequence[ExpectedVehicle] = (),
        own_component: int = 192,
        beliefs: dict[tuple[int, int], Belief] | None = None,
        names: Names | None = None,
    ) -> None:
        """`beliefs`: who speaks with the ids of each vehicle. Another part may look at it."""
        super().__init__()
        self.options = options or HardwareOptions()
        self._asking = RequestScheduler(self.options.watch_outputs, own_component, self.options.request_events)
        self._slots = VehicleSlots(slots, self.handles, {} if beliefs is None else beliefs, names or {})
        self._tracked = self._slots.tracked
        self._due: DueTimes[TrackedVehicle] = DueTimes()
        """When the status of each vehicle may change. -inf: at once."""
        self.asks = False
        """Whether `due_requests` is called at all."""
        self.never_asked = ""
        """Why it is not, in words; empty for a recording, which cannot be asked."""
        self.on_file: Callable[[TrackedVehicle, Any, float], None] | None = None
        """Called with each message of a vehicle that brings a file or its place."""
        self._event_table: EventTable | None = None
        """The words for the events of each vehicle without its own table."""
        self._event_tables: dict[tuple[int, int], EventTable] = {}
        self._unheard = True
        """Whether the handles of vehicles that sent nothing still lack their inhibit LINK_STALE."""
        self.ignored = 0
        """Heartbeats of autopilots that no entry of the configuration names, or beyond MOST_VEHICLES."""
        self.ignored_words = 0
        """Words of the applet (RS_STOP) from a sender that is not a vehicle."""

    @property
    def deadline(self) -> float:
        """When (monotonic seconds) `read` has work. -inf: at once."""
        return min(self._due.first, self._slots.expire_at)

    @property
    def vehicles(self) -> Iterator[TrackedVehicle]:
        """The vehicles heard so far."""
        return iter(self._tracked.values())

    def find(self, system: int, component: int) -> TrackedVehicle | None:
        """The vehicle with these ids, if it was heard."""
        return self._tracked.get((system, component))

    def speak_as(self, system: int | None, component: int) -> None:
        """Our ids, to which acknowledgements are addressed. `system` None: the system id of the vehicle."""
        self._asking.own_system, self._asking.own_component = system, component

    def use_event_table(self, ids: tuple[int, int] | None, table: EventTable | None) -> None:
        """Use the words of `table` for the events of the vehicle `ids`; None: of each vehicle without its own table.

        `table` None: no longer use one.
        """
        if ids is None:
            self._event_table = table
        elif table is None:
            self._event_tables.pop(ids, None)
        elif ids in self._tracked:
            self._event_tables[ids] = table
        for tracked in self._tracked.values():
            self._give_event_table(tracked)

    def _give_event_table(self, tracked: TrackedVehicle) -> None:
        table = self._event_tables.get(tracked.ids or (0, 0), self._event_table)
        if tracked.event_table is table:
            return
        tracked.event_table = table
        for speaker in tracked.belief.speakers:
            if speaker.state is not None:
                speaker.state.event_table = table
        self._touch(tracked, -math.inf)

    def on_frame(self, frame: Values, now: Instant, source: Hashable = None, lag: float = 0.0) -> TrackedVehicle | None:
        """Process one frame. `source`: where it arrived; None if there is one place only.

        `lag`: how late it is by its signature, seconds. Returns the vehicle if the frame is a heartbeat of its
        autopilot, and news of its main speaker; else None.
        """
        message_id, ids, _, message, _, _ = frame
        if message_id in COMMAND_IDS and message is not None:
            self._touch_all(on_command(self._tracked.values(), message, ids, now))
        tracked = self._tracked.get(ids) or self._first_heard(frame, now)
        if tracked is None:
            return None
        _, speaker, said = apply_frame(tracked, frame, source, now, lag, self.options)
        if speaker is None:
            if message_id == HEARTBEAT_ID:
                self._touch(tracked, -math.inf)
            return None
        self._touch(tracked, -math.inf if message_id in EDGES else now.mono + SETTLES)
        if said is None or speaker is not tracked.belief.main:
            return None
        if message_id == HEARTBEAT_ID:
            return _note_heartbeat(tracked, message, said.mono)
        if message_id == HIGH_LATENCY_ID:
            _note_statement(tracked)
        elif message_id in FILE_IDS:
            self._on_file_message(tracked, message, now)
        elif tracked.requests is not None:
            self._asking.heard(tracked, message, message_id, now.mono)
        return None

    def _first_heard(self, frame: Values, now: Instant) -> TrackedVehicle | None:
        """The vehicle of an autopilot that sends its first HEARTBEAT or HIGH_LATENCY2; None for every other frame."""
        message_id, ids, _, message, _, _ = frame
        if message is None:
            return None
        if message_id == HEARTBEAT_ID and is_autopilot(message, ids[1]):
            return self._discover(ids, message, now)
        if message_id == HIGH_LATENCY_ID and is_autopilot(stated(message), ids[1]):
            return self._discover(ids, stated(message), now)
        if message_id == ARM_STATUS_ID and ids[1] in TRANSMITTERS:
            self._touch_all(on_arm_status(self._tracked.values(), message, ids, now))
        elif message_id == APPLET_ID and is_word(message):
            self.ignored_words += 1
        return None

    def _touch(self, tracked: TrackedVehicle, due: float) -> None:
        """Let the next `read` at `due` or later settle the facts of a vehicle."""
        if not tracked.touched or due < tracked.due:
            tracked.touched, tracked.due = True, min(due, tracked.due)
            self._due.set(tracked, tracked.due)

    def _touch_all(self, changed: Iterable[TrackedVehicle]) -> None:
        for tracked in changed:
            self._touch(tracked, -math.inf)

    def read(self, now: Instant) -> None:
        """Update the handles to `now`."""
        if self._unheard:
            self._report_unheard(now)
        if now.mono >= self._slots.expire_at and (gone := self._slots.expired(now.mono, self.options)):
            self._remove(gone)
        while self._due.first <= now.mono:
            self._update(self._due.first_key(), now)

    @property
    def requests_due(self) -> float:
        """When (monotonic seconds) `due_requests` has work."""
        return self._asking.next_due

    def explain(self, handle: str, now: Instant) -> None:
        """Update the evidence in a handle to `now`; `read` updates it only when a status may have changed."""
        for tracked in self._tracked.values():
            if tracked.handle.name == handle:
                self._update(tracked, now)
                if isinstance(tracked.handle.evidence, EvidenceOfVehicle):
                    tracked.handle.evidence.asked = self._asked(tracked, now)

    def _asked(self, tracked: TrackedVehicle, now: Instant) -> dict[str, str]:
        """What is known about the requests to a vehicle, in words."""
        return (
            self._asking.asked(tracked, now.mono)
            if self.asks
            else dict.fromkeys(self._asking.names(tracked), self.never_asked)
        )

    def due_requests(
        self,
        now: Instant,
        passive: Container[tuple[int, int]] = (),
        has_room: Callable[[tuple[int, int], int], bool] = lambda ids, number: True,
    ) -> list[Ask]:
        """The requests to send at `now`, none to vehicles on `passive` links.

        `has_room` says whether the link of a vehicle has room for this number of requests and one more.
        """
        return self._asking.due(self._tracked, now.mono, passive, has_room)

    def reconnected(self, ids: Collection[tuple[int, int]], now: float) -> None:
        """The connection to these vehicles is a new one: they may have rebooted, and lost what they were asked for."""
        for one in ids:
            tracked = self._tracked.get(one)
            if tracked is not None and tracked.requests is not None:
                tracked.requests.reconnected(now)
                self._asking.next_due = -math.inf

    def ask_for_tables(self, wanted: bool) -> None:
        """Whether each PX4 is asked where the table of its events is."""
        self._asking.without = frozenset() if wanted else frozenset({METADATA})

    def waits_for(self) -> list[str]:
        """What vehicles were asked for and have not sent yet, one line for each vehicle that still may send it."""
        return [line for tracked in self._tracked.values() if (line := self._asking.waits_for(tracked)) is not None]

    def next_due(self, until: float = -math.inf) -> float:
        """When (monotonic seconds) `read` or `due_requests` has work. -inf: now, because of a frame."""
        return min(self.deadline, self._asking.next_due) if self.asks else self.deadline

    def adopt(self, other: MavlinkRobotHW) -> None:
        """Adopt the vehicles of another interface, with the options and slots of this one. Do not use `other` again.

        Statuses do not change until the next `read`.
        """
        self._slots.expire_at = -math.inf
        for ids, theirs in other._tracked.items():
            tracked = None if theirs.state is None else self._slots.place(ids, theirs.belief)
            if tracked is None:
                continue
            ours = tracked.handle
            ours.status, ours.detail, ours.heard_at = theirs.handle.status, theirs.handle.detail, theirs.handle.heard_at
            tracked.boots, tracked.losses = theirs.boots, theirs.losses
            tracked.established, tracked.event_table = theirs.established, theirs.event_table
            tracked.requests, tracked.parameters = theirs.requests, theirs.parameters
            self._touch(tracked, -math.inf)
            if ids in other._event_tables:
                self._event_tables[ids] = other._event_tables[ids]
            self._give_event_table(tracked)

    def forget(self, keep: Container[tuple[int, int]] = ()) -> None:
        """Drop all vehicle states, as at the start of a log segment. Handles keep their vehicles.

        Vehicles with the ids `keep` keep their state.
        """
        for tracked in self._tracked.values():
            if tracked.ids not in keep:
                tracked.forget()
                self._due.set(tracked, math.inf)
        self._unheard = True

    def _report_unheard(self, now: Instant) -> None:
        """Once: set LINK_STALE for each expected vehicle that sent nothing."""
        self._unheard = False
        for tracked in self._slots.expected:
            if tracked.state is None:
                unheard = inhibit("LINK_STALE", None, tracked.handle.detail, now)
                tracked.handle.detail = tracked.handle.detail._replace(inhibits=(unheard,))
                self.changed = True

    def _on_file_message(self, tracked: TrackedVehicle, message: Any, now: Instant) -> None:
        """Hand on where a table of events is, or a piece of it."""
        if type(message) is mav.ComponentMetadata and tracked.requests is not None:
            tracked.requests.delivered(METADATA.id)
        if self.on_file is not None:
            self.on_file(tracked, message, now.mono)

    def _discover(self, ids: tuple[int, int], heartbeat: mav.Heartbeat, now: Instant) -> TrackedVehicle | None:
        """The vehicle of an autopilot that sends its first HEARTBEAT; None if no entry of the configuration matches."""
        gone = self._slots.room_for(ids, now.mono, self.options)
        if gone:
            self._remove(gone)
        tracked = (None if gone is None else self._slots.place(ids)) or self._slots.succeed(ids)
        if tracked is None:
            self.ignored += 1
            return None
        self._due.set(tracked, math.inf)
        vehicle_log.heard(tracked, heartbeat)
        self._give_event_table(tracked)
        return tracked

    def _remove(self, gone: list[TrackedVehicle]) -> None:
        """Free the places of these vehicles."""
        for tracked in gone:
            if tracked.ids is not None:
                self._event_tables.pop(tracked.ids, None)
            self._slots.remove(tracked)
            self._due.set(tracked, math.inf)
        self._unheard = self.changed = True

    def _update(self, tracked: TrackedVehicle, now: Instant) -> None:
        """Update the handle of a vehicle to `now`."""
        before = tracked.state
        updated = status_at(tracked, now, self.options)
        tracked.touched, tracked.due = False, math.inf if updated is None else max(updated.due, now.mono + LEAST_WAIT)
        self._due.set(tracked, tracked.due)
        state = tracked.state
        if updated is None or state is None:
            return
        if before is not state and before is not None:  # another speaker is the vehicle now
            tracked.requests = tracked.parameters = None
            tracked.handle.heard_at = state.latest.heartbeat.at if state.latest.heartbeat else None
            if (before.autopilot, before.vehicle_type) != (state.autopilot, state.vehicle_type):
                vehicle_log.exchanged(tracked)
        if state.boots != tracked.boots:
            tracked.boots = state.boots
            vehicle_log.rebooted(tracked)
            if tracked.requests is not None:
                tracked.requests.restart(now.mono)
                self._asking.next_due = -math.inf
        facts = updated.facts
        if updated.derived is not None:
            vehicle_log.applet(tracked, facts)
            self._follow_satellite(tracked, facts, now)
            tracked.facts = facts
            self._show(tracked, updated.derived)
            tracked.handle.evidence = EvidenceOfVehicle(state, facts, updated.derived.reasons)

    def _show(self, tracked: TrackedVehicle, derived: Derived) -> None:
        """Set the status in the handle."""
        handle, detail = tracked.handle, derived.detail
        self._follow_link(tracked, detail.link)
        if tracked.name is not None:
            detail = detail._replace(vehicle=detail.vehicle._replace(name=tracked.name))
        if derived.status != handle.status or detail != handle.detail:
            handle.status, handle.detail = derived.status, detail
            self.changed = True

    def _follow_link(self, tracked: TrackedVehicle, state: LinkState) -> None:
        """Its link has changed: count losses, and ask again when it is back."""
        before = tracked.handle.detail.link
        if state is before:
            return
        self._asking.next_due = -math.inf
        vehicle_log.link(tracked, before, state, tracked.timeout(self.options))
        if state is LinkState.LOST and before is LinkState.CONNECTED:
            tracked.losses += 1
            self._slots.lost(tracked, self.options)
        elif state is LinkState.CONNECTED and before is LinkState.LOST and tracked.requests is not None:
            tracked.requests.reconnected(tracked.handle.heard_at or 0.0)

    def _follow_satellite(self, tracked: TrackedVehicle, facts: Facts, now: Instant) -> None:
        """HIGH_LATENCY2 counts now, or HEARTBEATs do again: then ask again for what is missing."""
        did_not = bool(tracked.facts) and tracked.facts.seldom is not None  # type: ignore[union-attr]
        if did_not is (facts.seldom is not None):
            return
        vehicle_log.satellite(tracked, did_not)
        if did_not:
            self._asking.next_due = -math.inf
            if tracked.requests is not None:
                tracked.requests.look_again(now.mono)


def _note_heartbeat(tracked: TrackedVehicle, message: mav.Heartbeat, at: float) -> TrackedVehicle | None:
    """Note when the autopilot of the vehicle sent its last HEARTBEAT; None if this one is of another sender."""
    if not is_autopilot(message, tracked.component):
        return None
    tracked.handle.heard_at = at
    return tracked


def _note_statement(tracked: TrackedVehicle) -> None:
    """Note when the vehicle was last heard by HIGH_LATENCY2. One that is late does not count."""
    if tracked.state is not None and tracked.state.high_latency is not None:
        tracked.handle.heard_at = tracked.state.high_latency.at
