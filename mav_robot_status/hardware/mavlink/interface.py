"""`MavlinkRobotHW`: the hardware interface. It processes frames, keeps the state of each vehicle, and sets the handles.

The cycle of ros_control: `take` each frame, `read(time)` into the handles, then send the `due_requests(time)`.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Any, Final

from ...due_times import DueTimes
from ...interface import LinkState, RobotHW
from ...mavlink import definitions as mav
from ...mavlink.enumerations import MAV_COMP_ID_AUTOPILOT1
from .armed import may_move
from .autopilots.wanted import METADATA
from .derive import derive
from .evidence import EvidenceOfVehicle
from .handlers import overheard, pass_time, transmitter_heard
from .handlers.heartbeat import changed_way
from .handlers.high_latency import follows, high_latency, sends_heartbeats
from .handlers.parts import TRANSMITTERS
from .identity import is_autopilot, named
from .message_table import (
    APPLET_ID,
    ARM_STATUS_ID,
    COMMAND_IDS,
    FILE_IDS,
    HEARTBEAT_ID,
    HIGH_LATENCY_ID,
    KINDS,
    PLAIN,
)
from .moment import Moment
from .options import HardwareOptions
from .places import Places
from .requests.scheduler import Ask, RequestScheduler
from .rules.inhibits import inhibit
from .settle import claimed, facts_of
from .state import motion
from .state.applet import is_word
from .state.claims import BESIDE, CLOCKS, CONTINUES, COUNTED_APART, Claims, Outcome, are_alike, says_alike
from .state.high_latency import LEAST_TIMEOUT, stated
from .state.latest_messages import SILENCE
from .state.vehicle_state import begin, timeout_of

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Container, Iterator, Sequence

    from ...clock import Instant
    from ...mavlink.framing import Values
    from .facts import Facts
    from .message_table import Settles
    from .px4_events import EventTable
    from .state.vehicle_state import VehicleState
    from .vehicle import ExpectedVehicle, Names, TrackedVehicle

log = logging.getLogger(__name__)

Stamped = tuple["Instant", Any, bool]
"""A record of a log: its time, its frame (`Values`; None at the end), and whether it starts a new segment."""
LOG_WAYS: Final = 10.0
"""Seconds between two log lines about the way of one vehicle."""


class MavlinkRobotHW(RobotHW):
    """The vehicles heard on MAVLink links, as handles."""

    def __init__(
        self,
        options: HardwareOptions | None = None,
        slots: Sequence[ExpectedVehicle] = (),
        own_component: int = 192,
        claims: dict[tuple[int, int], Claims[Any]] | None = None,
        names: Names | None = None,
    ) -> None:
        """`claims`: who speaks with the ids of each vehicle. Another part may look at it."""
        super().__init__()
        self.claims = {} if claims is None else claims
        self.options = options or HardwareOptions()
        self._asking = RequestScheduler(self.options.watch_outputs, own_component, self.options.request_events)
        self._places = Places(slots, self.handles, self.claims, names or {})
        self._tracked = self._places.tracked
        self._short_timeouts = min(self.options.heartbeat_timeout, self.options.sys_status_timeout) < SILENCE
        """Whether a message can become too old within SILENCE. Then every message can make its kind fresh again."""
        self._due: DueTimes[TrackedVehicle] = DueTimes()
        """The deadline of each vehicle: `next` of its moment. inf while it is in `dirty_vehicles`."""
        self.dirty_vehicles: list[TrackedVehicle] = []
        """The vehicles whose facts may have changed since the last `read`."""
        self.deadline = math.inf
        """The first deadline of all vehicles, monotonic seconds. -inf while a vehicle is in `dirty_vehicles`."""
        self.asks = False
        """Whether `due_requests` is called at all."""
        self.hear_file: Callable[[TrackedVehicle, Any, float], None] | None = None
        """Called with each message that brings a file or its place, from the selected way of a vehicle."""
        self._event_table: EventTable | None = None
        """The words for the events of each vehicle without its own table."""
        self._event_tables: dict[tuple[int, int], EventTable] = {}
        self._unheard = True
        """Whether the handles of vehicles that sent nothing still lack their inhibit LINK_STALE."""
        self.ignored = 0
        """Heartbeats of autopilots that no entry of the configuration names, or beyond MOST_VEHICLES."""
        self.link_timeout: Callable[[Any], float | None] | None = None
        """The timeout that the site gives to the link of a way, in seconds. None: it gives none to any link."""
        self.ignored_words = 0
        """Words of the applet (RS_STOP) from a sender that is not a vehicle."""

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
        state, ids = tracked.state, tracked.ids
        if state is None or ids is None:
            return
        table = self._event_tables.get(ids, self._event_table)
        if state.event_table is not table:
            state.event_table = table
            if not tracked.dirty:
                self._mark_dirty(tracked)

    def take(self, frame: Values, now: Instant, way: Any = None) -> TrackedVehicle | None:
        """Process one frame that arrived on `way`: a channel, or None if there is only one.

        Returns the vehicle if the frame is a heartbeat of its autopilot on its selected way, else None.
        """
        message_id, ids, sequence, message, _, _ = frame
        try:
            handler, settles = KINDS[message_id]
        except KeyError:
            if message_id in COMMAND_IDS:
                self._overhear(message, ids, now)
            elif message_id == HIGH_LATENCY_ID:
                self._take_high_latency(frame, now, way)
            elif message_id in FILE_IDS:
                self._hear_file(message, ids, now, way)
            return None
        tracked = self._tracked.get(ids)
        if tracked is not None:
            claims = tracked.claims
            if claims.way is not way:
                if not self._is_heard_elsewhere(tracked, frame, now, way):
                    return None
            elif message_id != COUNTED_APART:
                if (sequence - claims.sequence) & 255 > CONTINUES:
                    claims.broken = True
                claims.sequence = sequence
        sender = None
        if message_id == HEARTBEAT_ID:
            tracked = sender = self._vehicle_of(tracked, frame, now, way)
        if tracked is None:
            if message_id == ARM_STATUS_ID and ids[1] in TRANSMITTERS:
                self._hear_transmitter(message, ids, now)
            elif message_id == APPLET_ID and is_word(message):
                self.ignored_words += 1
            return None
        state = tracked.state
        if state is None:
            if sender is not None:
                tracked.state = begin(message, now, tracked.claims)
                self._mark_dirty(tracked)
                self._give_event_table(tracked)
            return sender
        if tracked.requests is not None and sender is None:
            self._asking.heard(tracked, message, message_id, now.mono)
        unchanged = handler(state, message, now, self.options)
        if tracked.dirty:
            return sender
        if not unchanged or state.latest.unsettled or not tracked.connected or now.mono >= tracked.deadline:
            self._settle(tracked, state, settles, now)
        return sender

    def take_all(self, records: Iterator[Stamped], last: Instant, until: float) -> tuple[Instant, Stamped | None]:
        """Take the records of a log before `until` (monotonic seconds) while nothing else is due.

        Returns the time of the last one taken (`last` if none was), and the first record that is not taken. That is
        None at the end of the log, or if a vehicle is in `dirty_vehicles` now. Nearly every frame of a log takes the
        short way here: it does what `take` does with a message that concerns only the state of its vehicle.
        """
        options = self.options
        limit = min(until, self.deadline)
        known: tuple[int, int] | None = None
        tracked: TrackedVehicle | None = None
        state: VehicleState | None = None
        for record in records:
            now, frame, new_segment = record
            if new_segment or frame is None or now.mono >= limit:
                return last, record
            last = now
            message_id, ids, sequence, message, _, _ = frame
            if ids is not known:
                known, tracked = ids, self._connected(ids)
                state = None if tracked is None else tracked.state
            if tracked is not None and state is not None and message_id in PLAIN:
                claims = tracked.claims
                if (sequence - claims.sequence) & 255 > CONTINUES:
                    claims.broken = True
                claims.sequence = sequence
                if PLAIN[message_id](state, message, now, options) and not state.latest.unsettled:
                    continue
                self._settle(tracked, state, KINDS[message_id][1], now)
            else:
                known = None
                self.take(frame, now)
            if self.dirty_vehicles:
                return last, None
            limit = min(until, self.deadline)
        return last, None

    def _connected(self, ids: tuple[int, int]) -> TrackedVehicle | None:
        """The vehicle of a log with these ids, if its heartbeats arrive."""
        tracked = self._tracked.get(ids)
        if tracked is None or tracked.state is None or not tracked.connected:
            return None
        return tracked if tracked.claims.way is None and tracked.requests is None else None

    def _settle(self, tracked: TrackedVehicle, state: VehicleState, settles: Settles, now: Instant) -> None:
        """Settle the facts that a message may have changed."""
        if state.latest.unsettled:
            if not tracked.dirty:
                self._mark_dirty(tracked)
            return
        facts, moment = tracked.facts, tracked.moment
        moment.now = now.mono
        for place, settle in settles:
            if settle(state, moment, self.options) != facts[place]:
                self._mark_dirty(tracked)
                return
        if moment.next < tracked.deadline:
            self._set_deadline(tracked, moment.next)

    def _take_high_latency(self, frame: Values, now: Instant, way: Any) -> None:
        """Process a HIGH_LATENCY2: as a HEARTBEAT, if no HEARTBEAT arrives, else as a claim."""
        _, ids, sequence, message, _, _ = frame
        beat: Values = (HEARTBEAT_ID, ids, sequence, stated(message), *frame[4:])
        if not is_autopilot(beat[3], ids[1]):
            return
        tracked = self._tracked.get(ids)
        state = None if tracked is None else tracked.state
        if tracked is not None and state is not None:
            claims = tracked.claims
            if sends_heartbeats(state, now.mono, self.options):
                claims.beside(beat[3], sequence, way, now)
                self._settle_claims(tracked, now)
                return
            claims.lasts = max(LEAST_TIMEOUT, timeout_of(state, self.options))
            if claims.way is way and not follows(state, message):
                if may_move(beat[3]):  # late, or of another vehicle on this way
                    claims.claim((BESIDE, way), way, beat[3], sequence, now)
                    self._settle_claims(tracked, now)
                return
        if tracked is not None and tracked.claims.way is not way:
            if not self._is_heard_elsewhere(tracked, beat, now, way):
                return
        elif tracked is not None:
            tracked.claims.follow_own(sequence)
        tracked = self._vehicle_of(tracked, beat, now, way)
        if tracked is None:
            return
        if tracked.state is None:
            tracked.state = begin(beat[3], now, tracked.claims)
        high_latency(tracked.state, message, now, self.options)
        if not tracked.dirty:
            self._mark_dirty(tracked)

    def read(self, now: Instant) -> None:
        """Update the handles to `now`."""
        if self._unheard:
            self._report_unheard(now)
        if now.mono >= self.deadline:
            if now.mono >= self._places.expire_at and (gone := self._places.expired(now.mono, self.options)):
                self._remove(gone)
            while (tracked := self._look_again(now.mono)) is not None:
                self._mark_dirty(tracked)
            self._find_deadline()
        if self.dirty_vehicles:
            for tracked in self.dirty_vehicles:
                self._evaluate(tracked, now)
            self.dirty_vehicles.clear()
            self._find_deadline()

    @property
    def requests_due(self) -> float:
        """When (monotonic seconds) `due_requests` has work."""
        return self._asking.next_due

    def explain(self, handle: str, now: Instant) -> None:
        """Update the evidence in a handle to `now`; `read` updates it only when a status may have changed."""
        for tracked in self._tracked.values():
            if tracked.handle.name == handle:
                self._evaluate(tracked, now)

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
        """When (monotonic seconds) `read` or `due_requests` has work. -inf: now, because of a frame.

        A time before `until` is exact. A later time is a lower bound: newer messages may postpone it.
        """
        if self.deadline <= until and not self.dirty_vehicles:
            self._look_again(min(until, self._asking.next_due) if self.asks else until)
            self._find_deadline()
        if self.asks:
            due = self._asking.next_due
            if due < self.deadline:
                return due
        return self.deadline

    def adopt(self, other: MavlinkRobotHW) -> None:
        """Adopt the vehicles of another interface, with the options and slots of this one. Do not use `other` again.

        Statuses do not change until the next `read`.
        """
        self._places.expire_at = -math.inf
        for ids, theirs in other._tracked.items():
            tracked = None if theirs.state is None else self._places.place(ids)
            if tracked is None:
                continue
            ours = tracked.handle
            ours.status, ours.detail, ours.heard_at = theirs.handle.status, theirs.handle.detail, theirs.handle.heard_at
            tracked.state, tracked.boots, tracked.losses = theirs.state, theirs.boots, theirs.losses
            tracked.established = theirs.established
            tracked.requests, tracked.parameters = theirs.requests, theirs.parameters
            if self.link_timeout is None:
                tracked.claims.timeout = None
            self._mark_dirty(tracked)
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
                self._set_deadline(tracked, math.inf)
        self.dirty_vehicles = [tracked for tracked in self.dirty_vehicles if tracked.dirty]
        self._find_deadline()
        self._unheard = True

    def _report_unheard(self, now: Instant) -> None:
        """Once: set LINK_STALE for each expected vehicle that sent nothing."""
        self._unheard = False
        for tracked in self._places.expected:
            if tracked.state is None:
                unheard = inhibit("LINK_STALE", None, tracked.handle.detail, now)
                tracked.handle.detail = tracked.handle.detail._replace(inhibits=(unheard,))
                self.changed = True

    def _overhear(self, message: mav.CommandInt | mav.CommandLong, sender: tuple[int, int], now: Instant) -> None:
        """Note a command that a ground station sends to one of the vehicles."""
        for (system, component), tracked in self._tracked.items():
            addressed = message.target_system == system and message.target_component in (0, component)
            if addressed and tracked.state is not None:
                before = tracked.state.stop
                overheard(tracked.state, message, sender, now)
                if tracked.state.stop is not before and not tracked.dirty:
                    self._mark_dirty(tracked)

    def _hear_transmitter(self, message: mav.OpenDroneIdArmStatus, sender: tuple[int, int], now: Instant) -> None:
        """Note what a Remote ID transmitter says to the autopilot of its system."""
        for (system, _), tracked in self._tracked.items():
            if system == sender[0] and tracked.state is not None:
                before = tracked.state.faulty_parts
                transmitter_heard(tracked.state, message, sender[1], now)
                if tracked.state.faulty_parts is not before and not tracked.dirty:
                    self._mark_dirty(tracked)

    def _hear_file(self, message: Any, sender: tuple[int, int], now: Instant, way: Any) -> None:
        """Hand on where a table of events is, or a piece of it."""
        tracked = self._tracked.get(sender)
        if tracked is None or tracked.claims.way is not way:
            return
        if type(message) is mav.ComponentMetadata and tracked.requests is not None:
            tracked.requests.delivered(METADATA.id)
        if self.hear_file is not None:
            self.hear_file(tracked, message, now.mono)

    def _vehicle_of(
        self, tracked: TrackedVehicle | None, frame: Values, now: Instant, way: Any
    ) -> TrackedVehicle | None:
        """The vehicle whose autopilot sent this heartbeat; None if it is not from an autopilot."""
        _, ids, sequence, heartbeat, _, _ = frame
        if not is_autopilot(heartbeat, ids[1]):
            return None
        if tracked is None:
            tracked = self._discover(frame, now, way)
        if tracked is not None:
            tracked.handle.heard_at = now.mono
            claims = tracked.claims
            if self.link_timeout is not None:
                claims.timeout = self.link_timeout(way)
            claims.heard(heartbeat, sequence, way, now)
            if claims.news is not None:
                self._log_conflict(tracked)
        return tracked

    def _discover(self, frame: Values, now: Instant, way: Any) -> TrackedVehicle | None:
        """The vehicle of an autopilot that sends its first HEARTBEAT; None if no entry of the configuration matches."""
        _, ids, _, heartbeat, _, _ = frame
        gone = self._places.room_for(ids, now.mono, self.options)
        if gone:
            self._remove(gone)
        tracked = (None if gone is None else self._places.place(ids)) or self._succeed(frame, now, way)
        if tracked is None:
            self.ignored += 1
            return None
        names = named(mav.AUTOPILOT_NAMES, heartbeat.autopilot), named(mav.TYPE_NAMES, heartbeat.type)
        called = "" if tracked.name is None else f" '{tracked.name}'"
        log.info("heard vehicle %d.%d%s (%s, %s): handle '%s'", *ids, called, *names, tracked.handle.name)
        return tracked

    def _remove(self, gone: list[TrackedVehicle]) -> None:
        """Free the places of these vehicles."""
        for tracked in gone:
            if tracked.ids is not None:
                self._event_tables.pop(tracked.ids, None)
            self._places.remove(tracked)
            self._set_deadline(tracked, math.inf)
        self._unheard = self.changed = True
        self.dirty_vehicles = [tracked for tracked in self.dirty_vehicles if tracked not in gone]
        self._find_deadline()

    def _succeed(self, frame: Values, now: Instant, way: Any) -> TrackedVehicle | None:
        """The vehicle whose entry leaves the ids open, if this sender takes it over from the one before.

        Component 1 is the autopilot: it takes the entry at once from another component of its system, and what that one
        says stays a claim. Any other component of the system is a claim itself.
        """
        _, ids, sequence, heartbeat, _, _ = frame
        for tracked in self._places.expected:
            owner = tracked.ids
            if owner is None or tracked.slot.component is not None or tracked.slot.system not in (None, ids[0]):
                continue
            same_system = owner[0] == ids[0]
            if same_system and ids[1] == MAV_COMP_ID_AUTOPILOT1:
                log.info("vehicle %d.%d: its handle '%s' is now that of %d.%d", *owner, tracked.handle.name, *ids)
                former = tracked.claims.mine
                tracked.forget()
                self._set_deadline(tracked, math.inf)
                tracked.requests = tracked.parameters = None
                self._places.give(tracked, ids)
                if former is not None:
                    tracked.claims.others[owner] = former
                return tracked
            if same_system:
                tracked.claims.claim(ids, way, heartbeat, sequence, now)
                self._settle_claims(tracked, now)
        return None

    def _is_heard_elsewhere(self, tracked: TrackedVehicle, frame: Values, now: Instant, way: Any) -> bool:
        """Whether a frame that is not from the selected way counts: only a heartbeat that selects its way does."""
        message_id, ids, sequence, message, _, _ = frame
        claims, state = tracked.claims, tracked.state
        if claims.mine is None:
            return True
        if message_id != COUNTED_APART:
            claims.follow(way, sequence)
        booted = state.boot.at if state is not None and state.boot.clock_ms is not None else None
        if message_id == HEARTBEAT_ID and is_autopilot(message, ids[1]):
            before, former = claims.way, claims.mine
            outcome = claims.elsewhere(message, sequence, way, now, booted, tracked.timeout(self.options))
            if outcome is not Outcome.UNUSED:
                if outcome is Outcome.EXCHANGED:
                    log.warning("vehicle %d.%d: another vehicle has these ids now, on %s", *ids, way)
                    tracked.state, tracked.boots = None, 0
                    tracked.requests = tracked.parameters = None
                else:
                    known = claims.mine.booted if claims.mine else None
                    if state is not None and not (are_alike(known, booted) and says_alike(former.heartbeat, message)):
                        changed_way(state, now.mono)
                    if now.mono >= tracked.log_way_at:
                        log.info("vehicle %d.%d: now heard on %s, no longer on %s", *ids, way, before)
                tracked.log_way_at = now.mono + LOG_WAYS
                return True
        elif message_id in CLOCKS:
            claims.clock(way, now.mono - message.time_boot_ms / 1000, booted, now)
        else:
            return False
        self._settle_claims(tracked, now)
        return False

    def _settle_claims(self, tracked: TrackedVehicle, now: Instant) -> None:
        """After a message of another sender."""
        self._log_conflict(tracked)
        state = tracked.state
        if state is None or tracked.dirty or not tracked.facts:
            return
        moment = tracked.moment
        moment.now = now.mono
        if claimed(state, moment, self.options) != tracked.facts.claimed:
            self._mark_dirty(tracked)
        elif moment.next < tracked.deadline:
            self._set_deadline(tracked, moment.next)

    def _log_conflict(self, tracked: TrackedVehicle) -> None:
        """Log once that a conflict has begun."""
        found, tracked.claims.news = tracked.claims.news, None
        if found is None:
            return
        ways = [str(way) for way in dict.fromkeys(found.ways) if way is not None]
        places = f": {' and '.join(ways)}" if ways else ""
        log.warning("two autopilots claim the ids %d.%d%s (%s)", *(tracked.ids or (0, 0)), places, found.why)

    def _mark_dirty(self, tracked: TrackedVehicle) -> None:
        """Make a `read` due at once, to evaluate this vehicle. Until then its messages settle no facts."""
        tracked.dirty = True
        if tracked.state is not None:
            tracked.state.latest.unsettled = True
        self.dirty_vehicles.append(tracked)
        self._set_deadline(tracked, math.inf)
        self.deadline = -math.inf

    def _look_again(self, until: float) -> TrackedVehicle | None:
        """Postpone the first deadlines at which the facts do not change, because messages kept arriving.

        Returns the vehicle of the first deadline up to `until` at which the facts change; None if there is none.
        """
        while self._due.first <= until:
            tracked = self._due.first_key()
            if tracked.state is None:
                self._set_deadline(tracked, math.inf)
                continue
            moment = Moment(tracked.moment.next)
            if facts_of(tracked.state, moment, self.options) != tracked.facts:
                return tracked
            tracked.moment = moment
            self._set_deadline(tracked, moment.next)
        return None

    def _set_deadline(self, tracked: TrackedVehicle, at: float) -> None:
        tracked.deadline = at
        self._due.set(tracked, at)
        if at < self.deadline:
            self.deadline = at

    def _find_deadline(self) -> None:
        """Set `deadline`."""
        self.deadline = -math.inf if self.dirty_vehicles else min(self._due.first, self._places.expire_at)

    def _evaluate(self, tracked: TrackedVehicle, now: Instant) -> None:
        """Update the handle of a vehicle to `now`. Derive a new status only if its facts have changed."""
        state = tracked.state
        if state is None:
            return
        if state.boots != tracked.boots:
            self._report_reboot(tracked, state, now)
        pass_time(state, now, self.options)
        motion.settle(state.motion, now.mono)
        motion.settle(state.gps_motion, now.mono)
        motion.settle(state.rotation, now.mono)
        tracked.moment = moment = Moment(now.mono)
        facts = facts_of(state, moment, self.options)
        state.latest.unsettled = self._short_timeouts
        if facts != tracked.facts:
            self._log_applet(tracked, facts)
            self._log_heartbeats(tracked, facts)
            tracked.facts = facts
            self._renew(tracked, state, facts, now)
        tracked.dirty = False
        tracked.connected = facts.fresh.heartbeat
        if not tracked.connected:
            moment.next = math.inf
        self._set_deadline(tracked, moment.next)

    def _renew(self, tracked: TrackedVehicle, state: VehicleState, facts: Facts, now: Instant) -> None:
        """Derive the status in the handle from the facts."""
        assert tracked.ids is not None
        handle = tracked.handle
        derived = derive(facts, tracked.ids, handle.detail, now, self.options)
        self._log_link(tracked, derived.detail.link)
        detail = derived.detail
        if tracked.name is not None:
            detail = detail._replace(vehicle=detail.vehicle._replace(name=tracked.name))
        if derived.status != handle.status:
            handle.status = derived.status
            self.changed = True
        if detail != handle.detail:
            handle.detail = detail
            self.changed = True
        handle.evidence = EvidenceOfVehicle(state, facts, derived.reasons)

    def _report_reboot(self, tracked: TrackedVehicle, state: VehicleState, now: Instant) -> None:
        tracked.boots = state.boots
        log.info("vehicle %d.%d has rebooted", *(tracked.ids or (0, 0)))
        if tracked.requests is not None:
            tracked.requests.restart(now.mono)
            self._asking.next_due = -math.inf

    def _log_applet(self, tracked: TrackedVehicle, facts: Facts) -> None:
        was_heard = tracked.facts.applet.is_heard if tracked.facts else False
        if facts.applet.is_heard is was_heard or not facts.fresh.heartbeat:
            return
        ids = tracked.ids or (0, 0)
        if was_heard:
            log.warning("vehicle %d.%d: the applet is silent, e_stopped is deduced again", *ids)
        else:
            log.info("vehicle %d.%d: the applet reports the emergency stop", *ids)

    def _log_heartbeats(self, tracked: TrackedVehicle, facts: Facts) -> None:
        """Log once that HIGH_LATENCY2 counts, or that HEARTBEATs do again: then ask again for what is missing."""
        did_not = bool(tracked.facts) and tracked.facts.seldom is not None  # type: ignore[union-attr]
        if did_not is (facts.seldom is not None):
            return
        ids = tracked.ids or (0, 0)
        if did_not:
            log.info("vehicle %d.%d sends HEARTBEATs", *ids)
            self._asking.next_due = -math.inf
            if tracked.requests is not None:
                tracked.requests.look_again(tracked.moment.now)
        else:
            log.info("vehicle %d.%d is heard only through HIGH_LATENCY2: nothing is sent to it", *ids)

    def _log_link(self, tracked: TrackedVehicle, state: LinkState) -> None:
        before = tracked.handle.detail.link
        if state is before:
            return
        self._asking.next_due = -math.inf
        ids = tracked.ids or (0, 0)
        if state is LinkState.LOST and before is LinkState.CONNECTED:
            tracked.losses += 1
            self._places.lost(tracked, self.options)
            log.warning("lost vehicle %d.%d: no heartbeat for %g s", *ids, tracked.timeout(self.options))
        elif state is LinkState.CONNECTED and before is LinkState.LOST:
            log.info("vehicle %d.%d is back", *ids)
            if tracked.requests is not None:
                tracked.requests.reconnected(tracked.handle.heard_at or 0.0)
