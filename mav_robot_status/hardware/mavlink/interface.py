"""`MavlinkRobotHW`: the hardware interface. It processes frames, keeps the state of each vehicle, and sets the handles.

The cycle of ros_control: `take` each frame, `read(time)` into the handles, then send the `due_requests(time)`.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Any, Final

from ...interface import DEFAULT_HANDLE_NAME, Detail, LinkState, RobotHW, RobotStatus
from ...mavlink import definitions as mav
from ...mavlink.enumerations import MAV_COMP_ID_AUTOPILOT1
from .derive import derive
from .evidence import EvidenceOfVehicle
from .handlers import overheard, pass_time
from .identity import is_autopilot, named
from .message_table import APPLET_ID, COMMAND_IDS, HEARTBEAT_ID, KINDS
from .moment import Moment
from .newcomers import Newcomers
from .options import HardwareOptions
from .requests.scheduler import Ask, RequestScheduler
from .rules.inhibits import inhibit
from .settle import claimed, facts_of
from .state import motion
from .state.applet import is_word
from .state.claims import CLOCKS, CONTINUES, COUNTED_APART, Claims, Outcome
from .state.latest_messages import SILENCE
from .state.vehicle_state import begin
from .vehicle import ExpectedVehicle, TrackedVehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Container, Iterator, Sequence

    from ...clock import Instant
    from ...mavlink.framing import Values
    from .facts import Facts
    from .state.vehicle_state import VehicleState

log = logging.getLogger(__name__)

MOST_VEHICLES: Final = 256
ESTABLISHED: Final = 5.0
"""Seconds of heartbeats without a link loss after which a vehicle keeps its place and its handle."""
LOGGED: Final = 5
"""The most ids in one log line."""
GONE: Final = 10.0
"""Seconds after its link loss for which another vehicle keeps them, if there are more than MOST_PASSING of its kind: a
few heartbeats may be forged, or a mistake."""
MOST_PASSING: Final = 8
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
    ) -> None:
        """`claims`: who speaks with the ids of each vehicle. Another part may look at it."""
        super().__init__()
        self.claims = {} if claims is None else claims
        self.options = options or HardwareOptions()
        self._asking = RequestScheduler(self.options.watch_outputs, own_component)
        # exact ids match before open ones
        ordered = sorted(slots, key=lambda slot: (slot.system is None, slot.component is None))
        self._expected = [TrackedVehicle(slot) for slot in ordered]
        self._short_timeouts = min(self.options.heartbeat_timeout, self.options.sys_status_timeout) < SILENCE
        """Whether a message can become too old within SILENCE. Then every message can make its kind fresh again."""
        self._open = not slots
        """Whether every autopilot that sends a HEARTBEAT gets a handle."""
        self._tracked: dict[tuple[int, int], TrackedVehicle] = {}
        self.dirty_vehicles: list[TrackedVehicle] = []
        """The vehicles whose facts may have changed since the last `read`."""
        self.deadline = math.inf
        """The first deadline of all vehicles, monotonic seconds. -inf while a vehicle is in `dirty_vehicles`."""
        self.asks = False
        """Whether `due_requests` is called at all."""
        self._newcomers = Newcomers()
        self._crowded_until = -math.inf
        """Until when (monotonic seconds) vehicles that were heard only briefly give up their places."""
        self._expire_at = math.inf
        """When (monotonic seconds) the first vehicle that is not established loses its place."""
        self._unheard = True
        """Whether the handles of vehicles that sent nothing still lack their inhibit LINK_STALE."""
        self.ignored = 0
        """Heartbeats of autopilots that no entry of the configuration names, or beyond MOST_VEHICLES."""
        self.ignored_words = 0
        """Words of the applet (RS_STOP) from a sender that is no vehicle."""
        for slot in slots:
            self.handles.register_handle(next(t.handle for t in self._expected if t.slot is slot))

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
            if message_id == APPLET_ID and is_word(message):
                self.ignored_words += 1
            return None
        state = tracked.state
        if state is None:
            if sender is not None:
                tracked.state = begin(message, now, tracked.claims)
                self._mark_dirty(tracked)
            return sender
        if tracked.requests is not None and sender is None:
            self._asking.heard(tracked, message, message_id, now.mono)
        options = self.options
        handler(state, message, now, options)
        if state.latest.unsettled:
            if not tracked.dirty:
                self._mark_dirty(tracked)
            return sender
        facts, moment = tracked.facts, tracked.moment
        moment.now = now.mono
        for place, settle in settles:
            if settle(state, moment, options) != facts[place]:
                self._mark_dirty(tracked)
                return sender
        if moment.next < self.deadline:
            self.deadline = moment.next
        return sender

    def read(self, now: Instant) -> None:
        """Update the handles to `now`."""
        if self._unheard:
            self._report_unheard(now)
        if now.mono >= self.deadline:
            if now.mono >= self._expire_at:
                self._expire(now.mono)
            self._look_again(now.mono)
            for tracked in self._tracked.values():
                if now.mono >= tracked.moment.next and not tracked.dirty:
                    self._mark_dirty(tracked)
        if self.dirty_vehicles:
            for tracked in self.dirty_vehicles:
                self._evaluate(tracked, now)
            self.dirty_vehicles.clear()
            self._find_deadline()

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
                tracked.requests.look_again(now)
                self._asking.next_due = -math.inf

    def waits_for(self) -> list[str]:
        """What vehicles were asked for and have not sent yet, one line for each vehicle that still may send it."""
        return [line for tracked in self._tracked.values() if (line := self._asking.waits_for(tracked)) is not None]

    def next_due(self, until: float = -math.inf) -> float:
        """When (monotonic seconds) `read` or `due_requests` has work. -inf: now, because of a frame.

        A time before `until` is exact. A later time is a lower bound: newer messages may postpone it.
        """
        if self.deadline < until and not self.dirty_vehicles:
            self._look_again(until)
        if self.asks:
            due = self._asking.next_due
            if due < self.deadline:
                return due
        return self.deadline

    def adopt(self, other: MavlinkRobotHW) -> None:
        """Adopt the vehicles of another interface, with the options and slots of this one. Do not use `other` again.

        Statuses do not change until the next `read`.
        """
        self._expire_at = -math.inf
        for ids, theirs in other._tracked.items():
            name = theirs.handle.name if other._open else None
            tracked = None if theirs.state is None else self._place(ids, name)
            if tracked is None:
                continue
            ours = tracked.handle
            ours.status, ours.detail, ours.heard_at = theirs.handle.status, theirs.handle.detail, theirs.handle.heard_at
            tracked.state, tracked.boots, tracked.losses = theirs.state, theirs.boots, theirs.losses
            tracked.established = theirs.established
            tracked.requests, tracked.parameters = theirs.requests, theirs.parameters
            self._mark_dirty(tracked)

    def forget(self, keep: Container[tuple[int, int]] = ()) -> None:
        """Drop all vehicle states, as at the start of a log segment. Handles keep their vehicles.

        Vehicles with the ids `keep` keep their state.
        """
        for tracked in self._tracked.values():
            if tracked.ids not in keep:
                _make_unheard(tracked)
        self.dirty_vehicles = [tracked for tracked in self.dirty_vehicles if tracked.dirty]
        self._find_deadline()
        self._unheard = True

    def _report_unheard(self, now: Instant) -> None:
        """Once: set LINK_STALE for each expected vehicle that sent nothing."""
        self._unheard = False
        for tracked in self._expected:
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
            claims.heard(heartbeat, sequence, way, now)
            if claims.news is not None:
                self._log_conflict(tracked)
        return tracked

    def _discover(self, frame: Values, now: Instant, way: Any) -> TrackedVehicle | None:
        """The vehicle of an autopilot that sends its first HEARTBEAT; None if no entry of the configuration matches."""
        _, ids, _, heartbeat, _, _ = frame
        tracked = self._place(ids) if self._has_place(ids, now.mono) else None
        tracked = tracked or self._succeed(frame, now, way)
        if tracked is None:
            self.ignored += 1
            return None
        names = named(mav.AUTOPILOT_NAMES, heartbeat.autopilot), named(mav.TYPE_NAMES, heartbeat.type)
        log.info("heard vehicle %d.%d (%s, %s): handle '%s'", *ids, *names, tracked.handle.name)
        return tracked

    def _has_place(self, ids: tuple[int, int], now: float) -> bool:
        """Whether a vehicle with these ids that sends its first HEARTBEAT gets a place. Frees one if all are taken."""
        if any(t.matches(*ids) for t in self._expected):
            return True
        if self._open:
            full, holders = len(self._tracked) >= MOST_VEHICLES, list(self._tracked.values())
        else:
            full, holders = True, [t for t in self._expected if t.accepts(*ids) and not t.established]
        if full and not holders:
            return False
        if not self._newcomers.admits(ids, full, now):
            return False
        if full:
            silent = [t for t in holders if now - _last_heard(t) > self.options.heartbeat_timeout]
            if not silent:
                return False
            self._remove([min(silent, key=lambda t: (t.established, _last_heard(t)))])
        return True

    def _is_passing(self, tracked: TrackedVehicle) -> bool:
        """Whether it is silent, was heard only briefly, and the configuration does not name its handle."""
        return self._open and tracked.handle.detail.link is LinkState.LOST and not tracked.established

    def _expire(self, now: float) -> None:
        """Free the places of the vehicles that are silent and were heard only briefly, if there are many."""
        passing = [tracked for tracked in self._tracked.values() if self._is_passing(tracked)]
        keep = self.options.heartbeat_timeout + GONE
        gone = [tracked for tracked in passing if now >= _last_heard(tracked) + keep]
        if len(passing) > MOST_PASSING:
            self._crowded_until = now + keep
        elif now > self._crowded_until:
            gone, passing = [], [tracked for tracked in passing if now < _last_heard(tracked) + keep]
        self._expire_at = min((_last_heard(t) + keep for t in passing if t not in gone), default=math.inf)
        if gone:
            first = ", ".join("{}.{}".format(*(tracked.ids or (0, 0))) for tracked in gone[:LOGGED])
            more = f" and {len(gone) - LOGGED} more" if len(gone) > LOGGED else ""
            log.info("no longer a vehicle, heard only briefly: %s%s", first, more)
            self._remove(gone)

    def _remove(self, gone: list[TrackedVehicle]) -> None:
        """Free the places of these vehicles. A handle that the configuration names stays, for another vehicle."""
        for tracked in gone:
            assert tracked.ids is not None
            del self._tracked[tracked.ids]
            self.claims.pop(tracked.ids, None)
            _make_unheard(tracked)
            if tracked in self._expected:
                tracked.ids = None
                tracked.handle.detail = Detail(tracked.slot.system, tracked.slot.component, link=LinkState.NEVER_SEEN)
                tracked.requests = tracked.parameters = None
                self._unheard = True
            else:
                self.handles.remove_handle(tracked.handle.name)
        self.changed = True
        self.dirty_vehicles = [tracked for tracked in self.dirty_vehicles if tracked not in gone]
        self._find_deadline()

    def _succeed(self, frame: Values, now: Instant, way: Any) -> TrackedVehicle | None:
        """The vehicle whose entry leaves the ids open, if this sender takes it over from the one before.

        Component 1 is the autopilot: it takes the entry at once from another component of its system, and what that one
        says stays a claim. Any other component of the system is a claim itself.
        """
        _, ids, sequence, heartbeat, _, _ = frame
        for tracked in self._expected:
            owner = tracked.ids
            if owner is None or tracked.slot.component is not None or tracked.slot.system not in (None, ids[0]):
                continue
            same_system = owner[0] == ids[0]
            if same_system and ids[1] == MAV_COMP_ID_AUTOPILOT1:
                log.info("vehicle %d.%d: its handle '%s' is now that of %d.%d", *owner, tracked.handle.name, *ids)
                former = tracked.claims.mine
                _make_unheard(tracked)
                tracked.requests = tracked.parameters = None
                del self._tracked[owner]
                self.claims.pop(owner, None)
                self._give(tracked, ids)
                if former is not None:
                    tracked.claims.others[owner] = former
                return tracked
            if same_system:
                tracked.claims.claim(ids, way, heartbeat, sequence, now)
                self._settle_claims(tracked, now)
        return None

    def _is_heard_elsewhere(self, tracked: TrackedVehicle, frame: Values, now: Instant, way: Any) -> bool:
        """Whether a frame counts that is not from the selected way: a heartbeat that selects its way."""
        message_id, ids, sequence, message, _, _ = frame
        claims, state = tracked.claims, tracked.state
        if claims.mine is None:
            return True
        if message_id != COUNTED_APART:
            claims.follow(way, sequence)
        booted = state.boot.at if state is not None and state.boot.clock_ms is not None else None
        if message_id == HEARTBEAT_ID and is_autopilot(message, ids[1]):
            before = claims.way
            outcome = claims.elsewhere(message, sequence, way, now, booted, self.options.heartbeat_timeout)
            if outcome is not Outcome.UNUSED:
                if outcome is Outcome.EXCHANGED:
                    log.warning("vehicle %d.%d: another vehicle has these ids now, on %s", *ids, way)
                    tracked.state, tracked.boots = None, 0
                    tracked.requests = tracked.parameters = None
                elif now.mono >= tracked.log_way_at:
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
        elif moment.next < self.deadline:
            self.deadline = moment.next

    def _log_conflict(self, tracked: TrackedVehicle) -> None:
        """Log once that a conflict has begun."""
        found, tracked.claims.news = tracked.claims.news, None
        if found is None:
            return
        ways = [str(way) for way in dict.fromkeys(found.ways) if way is not None]
        places = f": {' and '.join(ways)}" if ways else ""
        log.warning("two autopilots claim the ids %d.%d%s (%s)", *(tracked.ids or (0, 0)), places, found.why)

    def _place(self, ids: tuple[int, int], name: str | None = None) -> TrackedVehicle | None:
        """A new vehicle with these ids; None if no entry matches. `name` is the name of its handle if that is new."""
        tracked = next((t for t in self._expected if t.matches(*ids)), None)
        if tracked is None and self._open and len(self._tracked) < MOST_VEHICLES:
            if name is None:
                name = DEFAULT_HANDLE_NAME if not self._tracked else f"{DEFAULT_HANDLE_NAME}/{ids[0]}.{ids[1]}"
            tracked = TrackedVehicle(ExpectedVehicle(*ids, name))
            self.handles.register_handle(tracked.handle)
        if tracked is not None:
            self._give(tracked, ids)
        return tracked

    def _give(self, tracked: TrackedVehicle, ids: tuple[int, int]) -> None:
        """These ids to a vehicle."""
        tracked.ids = ids
        tracked.claims = self.claims.setdefault(ids, tracked.claims)
        self._tracked[ids] = tracked

    def _mark_dirty(self, tracked: TrackedVehicle) -> None:
        """Make a `read` due at once, to evaluate this vehicle. Until then its messages settle no facts."""
        tracked.dirty = True
        if tracked.state is not None:
            tracked.state.latest.unsettled = True
        self.dirty_vehicles.append(tracked)
        self.deadline = -math.inf

    def _look_again(self, until: float) -> None:
        """Postpone each deadline up to `until` at which the facts do not change, because messages kept arriving."""
        for tracked in self._tracked.values():
            while tracked.moment.next <= until and tracked.state is not None and not tracked.dirty:
                moment = Moment(tracked.moment.next)
                if facts_of(tracked.state, moment, self.options) != tracked.facts:
                    break
                tracked.moment = moment
        self._find_deadline()

    def _find_deadline(self) -> None:
        """Set `deadline`."""
        first = min((tracked.moment.next for tracked in self._tracked.values()), default=math.inf)
        self.deadline = -math.inf if self.dirty_vehicles else min(first, self._expire_at)

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
            tracked.facts = facts
            self._renew(tracked, state, facts, now)
        tracked.dirty = False
        if not facts.fresh.heartbeat:
            moment.next = math.inf

    def _renew(self, tracked: TrackedVehicle, state: VehicleState, facts: Facts, now: Instant) -> None:
        """Derive the status in the handle from the facts."""
        assert tracked.ids is not None
        handle = tracked.handle
        derived = derive(facts, tracked.ids, handle.detail, now, self.options)
        self._log_link(tracked, derived.detail.link)
        if derived.status != handle.status:
            handle.status = derived.status
            self.changed = True
        if derived.detail != handle.detail:
            handle.detail = derived.detail
            self.changed = True
        handle.evidence = EvidenceOfVehicle(state, facts, derived.reasons)

    def _report_reboot(self, tracked: TrackedVehicle, state: VehicleState, now: Instant) -> None:
        tracked.boots = state.boots
        log.info("vehicle %d.%d has rebooted", *(tracked.ids or (0, 0)))
        if tracked.requests is not None:
            tracked.requests.restart(now.mono)
            self._asking.next_due = -math.inf

    def _note_loss(self, tracked: TrackedVehicle) -> None:
        """Its link is lost: it keeps its place if it was there long enough, else for a while."""
        assert tracked.state is not None
        since = tracked.state.heartbeats.since.mono
        tracked.established = tracked.established or _last_heard(tracked) - since >= ESTABLISHED
        if self._open and not tracked.established:
            self._expire_at = min(self._expire_at, _last_heard(tracked) + self.options.heartbeat_timeout + GONE)

    def _log_applet(self, tracked: TrackedVehicle, facts: Facts) -> None:
        was_heard = tracked.facts.applet.is_heard if tracked.facts else False
        if facts.applet.is_heard is was_heard or not facts.fresh.heartbeat:
            return
        ids = tracked.ids or (0, 0)
        if was_heard:
            log.warning("vehicle %d.%d: the applet is silent, e_stopped is deduced again", *ids)
        else:
            log.info("vehicle %d.%d: the applet reports the emergency stop", *ids)

    def _log_link(self, tracked: TrackedVehicle, state: LinkState) -> None:
        before = tracked.handle.detail.link
        if state is before:
            return
        self._asking.next_due = -math.inf
        ids = tracked.ids or (0, 0)
        if state is LinkState.LOST and before is LinkState.CONNECTED:
            tracked.losses += 1
            self._note_loss(tracked)
            log.warning("lost vehicle %d.%d: no heartbeat for %g s", *ids, self.options.heartbeat_timeout)
        elif state is LinkState.CONNECTED and before is LinkState.LOST:
            log.info("vehicle %d.%d is back", *ids)
            if tracked.requests is not None:
                tracked.requests.look_again(tracked.handle.heard_at or 0.0)


def _last_heard(tracked: TrackedVehicle) -> float:
    """When (monotonic seconds) a vehicle sent its last HEARTBEAT; -inf if it sent none."""
    heard_at = tracked.handle.heard_at
    return -math.inf if heard_at is None else heard_at


def _make_unheard(tracked: TrackedVehicle) -> None:
    """The state before the first HEARTBEAT. The ids stay."""
    tracked.state, tracked.facts = None, ()
    tracked.boots = 0
    tracked.established = False
    tracked.dirty, tracked.moment = False, Moment(-math.inf)
    tracked.claims.forget()
    system, component = tracked.ids or (None, None)
    tracked.handle.status = RobotStatus()
    tracked.handle.detail = Detail(system, component, link=LinkState.NEVER_SEEN)
    tracked.handle.heard_at = None
    tracked.handle.evidence = {}
