"""`MavlinkRobotHW`: the hardware interface. It takes frames, keeps a memory of each vehicle, and fills the handles.

ros_control's walk: `take` what arrived, `read(time)` the robot into the handles, `write(time)` what is to be asked of
it.
"""

from __future__ import annotations

import logging
import math
from typing import TYPE_CHECKING, Final

from ..interface import (
    DEFAULT_HANDLE_NAME,
    Detail,
    IndustrialRobotStatusInterface,
    LinkState,
    RobotHW,
    RobotStatus,
)
from ..mavlink import definitions as mav
from . import causes, horizon, motion
from .asking import Ask, Asking
from .derive import derive
from .fields.inhibits import inhibit
from .fields.view import named
from .hearing import overheard, pass_time
from .identity import is_autopilot
from .kinds import COMMAND_IDS, HEARTBEAT_ID, KINDS
from .memory import begin
from .observation import SILENCE
from .options import HardwareOptions
from .tracked import Slot, Tracked

if TYPE_CHECKING:
    from collections.abc import Container, Iterator, Sequence

    from ..clock import Instant
    from ..mavlink.framing import Values
    from .memory import Memory

log = logging.getLogger(__name__)

MOST_VEHICLES: Final = 256


class MavlinkRobotHW(RobotHW):
    """The vehicles heard on MAVLink links, as handles."""

    def __init__(
        self, options: HardwareOptions | None = None, slots: Sequence[Slot] = (), own_component: int = 192
    ) -> None:
        super().__init__()
        self.options = options or HardwareOptions()
        self._asking = Asking(self.options.watch_outputs, own_component)
        self.handles = IndustrialRobotStatusInterface()
        self.register_interface(self.handles)
        # a vehicle that is named exactly comes before one that is not
        ordered = sorted(slots, key=lambda slot: (slot.system is None, slot.component is None))
        self._expected = [Tracked(slot) for slot in ordered]
        self._hasty = min(self.options.heartbeat_timeout, self.options.sys_status_timeout) < SILENCE
        """Whether messages count as too old so soon that each one may change a status."""
        self._open = not slots
        """Whether every autopilot heard becomes a handle."""
        self._tracked: dict[tuple[int, int], Tracked] = {}
        self.stirred: list[Tracked] = []
        """The vehicles of which something was taken, since the last `read`, that may change their status."""
        self.deadline = math.inf
        """The first deadline of all vehicles: when `read` has something to do though nothing is stirred."""
        self.changed = False
        """Whether a status or a detail in a handle is another; whoever looks puts it back."""
        self._unheard = True
        """Whether the handles of vehicles that were not heard are still to be told so."""
        self.ignored = 0
        """Heartbeats of autopilots that no entry of the configuration names, or beyond MOST_VEHICLES."""
        for slot in slots:
            self.handles.register_handle(next(t.handle for t in self._expected if t.slot is slot))

    @property
    def vehicles(self) -> Iterator[Tracked]:
        """The vehicles heard so far."""
        return iter(self._tracked.values())

    def find(self, system: int, component: int) -> Tracked | None:
        """The vehicle with these ids, if it was heard."""
        return self._tracked.get((system, component))

    def speak_as(self, system: int | None, component: int) -> None:
        """Our ids, which acknowledgements come back to; `system` None: that of the vehicle that is spoken to."""
        self._asking.own_system, self._asking.own_component = system, component

    def take(self, frame: Values, now: Instant) -> Tracked | None:
        """Take one frame. Returns the vehicle whose autopilot's heartbeat it is, None for everything else."""
        message_id, ids, _, message, _, _ = frame
        try:
            type_, handler, part, moving = KINDS[message_id]
        except KeyError:
            if message_id in COMMAND_IDS:
                self._overhear(message, ids, now)
            return None
        tracked = self._tracked.get(ids)
        beating = None
        if message_id == HEARTBEAT_ID:
            tracked = beating = self._beating(tracked, message, ids, now)
        if tracked is None:
            return None
        memory = tracked.memory
        if memory is None:
            if beating is not None:
                tracked.memory = begin(message, now)
                self._stir(tracked)
            return beating
        if beating is None and tracked.requests is not None:
            self._asking.heard(tracked, message, message_id, now.mono)
        options = self.options
        handler(memory, message, now, options)
        if tracked.dirty:
            return beating
        if (
            part(memory, options) != tracked.seen[type_]
            if part is not None
            else horizon.matters(memory, options) != tracked.seen
        ):
            self._stir(tracked)
        elif moving is not None:
            at = motion.settles_at(moving(memory))
            if now.mono < at < tracked.deadline:
                tracked.deadline = at
                self.deadline = min(self.deadline, at)
        return beating

    def is_stirred(self, asks: bool) -> bool:
        """Whether something was taken that `read`, or `write` if it is called at all, should look at now."""
        return bool(self.stirred) or (asks and self._asking.anew)

    def read(self, now: Instant) -> None:
        """Set the handles to what is so at `now`."""
        if self._unheard:
            self._tell_unheard(now)
        if now.mono >= self.deadline:
            self._look_again(now.mono)
            for tracked in self._tracked.values():
                if now.mono >= tracked.deadline and not tracked.dirty:
                    self._stir(tracked)
        if self.stirred:
            for tracked in self.stirred:
                self._evaluate(tracked, now)
            self.stirred.clear()
            self.deadline = min(tracked.deadline for tracked in self._tracked.values())

    def explain(self, now: Instant) -> None:
        """Bring the evidence in the handles up to `now`; `read` renews it only when a status may have changed."""
        for tracked in self._tracked.values():
            self._evaluate(tracked, now)

    def explained(self, handle: str, now: Instant) -> Tracked | None:
        """One vehicle by its handle, its evidence brought up to `now`; None if it was not heard."""
        for tracked in self._tracked.values():
            if tracked.handle.name == handle:
                self._evaluate(tracked, now)
                return tracked
        return None

    def write(self, now: Instant, passive: Container[tuple[int, int]] = ()) -> list[Ask]:
        """What is to be asked of the autopilots at `now`; nothing of those on `passive` links."""
        return self._asking.due(self._tracked, now.mono, passive)

    def conflict(self, ids: tuple[int, int], now: Instant) -> None:
        """Two autopilots that claim the ids of this vehicle were heard on different ways."""
        tracked = self._tracked.get(ids)
        if tracked is not None and tracked.memory is not None:
            memory = tracked.memory
            memory.latches = causes.announce(memory.latches, 9002, None, now, "clocks of two autopilots")
            self._stir(tracked)

    def next_due(self, until: float = -math.inf) -> float:
        """When (monotonic seconds) `read` or `write` has something to do, if nothing arrives before.

        What falls due before `until` does so in fact; later, it may turn out that nothing has ended by then.
        """
        if self.deadline < until:
            self._look_again(until)
        return min(self.deadline, self._asking.next_due)

    def adopt(self, other: MavlinkRobotHW) -> None:
        """Go on with the vehicles of another, as this one's options and slots have it. The other is used no more.

        Statuses stay as they are until the next `read`.
        """
        for ids, theirs in other._tracked.items():
            name = theirs.handle.name if other._open else None
            tracked = None if theirs.memory is None else self._place(ids, name)
            if tracked is None:
                continue
            ours = tracked.handle
            ours.status, ours.detail, ours.heard_at = theirs.handle.status, theirs.handle.detail, theirs.handle.heard_at
            tracked.memory, tracked.boots, tracked.losses = theirs.memory, theirs.boots, theirs.losses
            tracked.requests, tracked.parameters = theirs.requests, theirs.parameters
            self._stir(tracked)

    def forget(self, keep: Container[tuple[int, int]] = ()) -> None:
        """Begin anew, as if nothing had been heard (a new segment of a log). Handles keep their vehicles.

        Those with the ids `keep` are not forgotten.
        """
        for tracked in self._tracked.values():
            if tracked.ids in keep:
                continue
            tracked.memory = None
            tracked.boots = 0
            tracked.dirty, tracked.deadline, tracked.checked = False, math.inf, -math.inf
            system, component = tracked.ids or (None, None)
            tracked.handle.status = RobotStatus()
            tracked.handle.detail = Detail(system, component, link=LinkState.NEVER_SEEN)
            tracked.handle.heard_at = None
            tracked.handle.evidence = {}
        self.stirred = [tracked for tracked in self.stirred if tracked.dirty]
        self.deadline = min((tracked.deadline for tracked in self._tracked.values()), default=math.inf)
        self._unheard = True

    def _tell_unheard(self, now: Instant) -> None:
        """Once: a vehicle that was never heard cannot move as far as one knows."""
        self._unheard = False
        for tracked in self._expected:
            if tracked.memory is None:
                unheard = inhibit("LINK_STALE", None, tracked.handle.detail, now)
                tracked.handle.detail = tracked.handle.detail._replace(inhibits=(unheard,))
                self.changed = True

    def _overhear(self, message: mav.CommandInt | mav.CommandLong, sender: tuple[int, int], now: Instant) -> None:
        """A command of a ground station to one of the vehicles."""
        for (system, component), tracked in self._tracked.items():
            addressed = message.target_system == system and message.target_component in (0, component)
            if addressed and tracked.memory is not None:
                overheard(tracked.memory, message, sender, now)

    def _beating(
        self, tracked: Tracked | None, heartbeat: mav.Heartbeat, ids: tuple[int, int], now: Instant
    ) -> Tracked | None:
        """The vehicle whose autopilot sent this heartbeat, if any did."""
        if tracked is None:
            tracked = self._discover(heartbeat, ids, now)
        elif not is_autopilot(heartbeat, ids[1]):
            return None
        if tracked is not None:
            tracked.handle.heard_at = now.mono
        return tracked

    def _discover(self, heartbeat: mav.Heartbeat, ids: tuple[int, int], now: Instant) -> Tracked | None:
        """The place of an autopilot that is heard for the first time."""
        if not is_autopilot(heartbeat, ids[1]):
            return None
        tracked = self._place(ids)
        if tracked is None:
            self.ignored += 1
            return None
        names = named(mav.AUTOPILOT_NAMES, heartbeat.autopilot), named(mav.TYPE_NAMES, heartbeat.type)
        log.info("heard vehicle %d.%d (%s, %s): handle '%s'", *ids, *names, tracked.handle.name)
        return tracked

    def _place(self, ids: tuple[int, int], name: str | None = None) -> Tracked | None:
        """The place of a vehicle that has none yet; None if there is none. `name`: of its handle if that is new."""
        tracked = next((t for t in self._expected if t.matches(*ids)), None)
        if tracked is None and self._open and len(self._tracked) < MOST_VEHICLES:
            if name is None:
                name = DEFAULT_HANDLE_NAME if not self._tracked else f"{DEFAULT_HANDLE_NAME}/{ids[0]}.{ids[1]}"
            tracked = Tracked(Slot(*ids, name))
            self.handles.register_handle(tracked.handle)
        if tracked is not None:
            tracked.ids = ids
            self._tracked[ids] = tracked
        return tracked

    def _stir(self, tracked: Tracked) -> None:
        tracked.dirty = True
        self.stirred.append(tracked)

    def _look_again(self, until: float) -> None:
        """Put off the deadlines up to `until` of vehicles of which what would have ended was heard again meanwhile."""
        first = math.inf
        for tracked in self._tracked.values():
            if tracked.deadline <= until and tracked.memory is not None:
                tracked.deadline = horizon.next_change(tracked.memory, tracked.checked, self.options)
            if tracked.deadline < first:
                first = tracked.deadline
        self.deadline = first

    def _evaluate(self, tracked: Tracked, now: Instant) -> None:
        if tracked.memory is None or tracked.ids is None:
            return
        memory = tracked.memory
        if memory.boots != tracked.boots:
            self._tell_reboot(tracked, memory, now)
        pass_time(memory, now, self.options)
        motion.settle(memory.motion, now.mono)
        motion.settle(memory.gps_motion, now.mono)
        handle = tracked.handle
        derived = derive(memory, tracked.ids, handle.detail, now, self.options)
        self._log_link(tracked, derived.detail.link)
        if derived.status != handle.status:
            handle.status = derived.status
            self.changed = True
        if derived.detail != handle.detail:
            handle.detail = derived.detail
            self.changed = True
        handle.evidence = derived.evidence
        tracked.dirty = False
        tracked.checked = now.mono
        tracked.seen = horizon.UNLIKE_ALL if self._hasty else horizon.matters(memory, self.options)
        lost = derived.detail.link is LinkState.LOST
        tracked.deadline = math.inf if lost else horizon.next_change(memory, now.mono, self.options)

    def _tell_reboot(self, tracked: Tracked, memory: Memory, now: Instant) -> None:
        tracked.boots = memory.boots
        log.info("vehicle %d.%d has rebooted", *(tracked.ids or (0, 0)))
        if tracked.requests is not None:
            tracked.requests.restart(now.mono)
            self._asking.anew = True

    def _log_link(self, tracked: Tracked, state: LinkState) -> None:
        before = tracked.handle.detail.link
        if state is before:
            return
        self._asking.anew = True
        ids = tracked.ids or (0, 0)
        if state is LinkState.LOST and before is LinkState.CONNECTED:
            tracked.losses += 1
            log.warning("lost vehicle %d.%d: no heartbeat for %g s", *ids, self.options.heartbeat_timeout)
        elif state is LinkState.CONNECTED and before is LinkState.LOST:
            log.info("vehicle %d.%d is back", *ids)
            if tracked.requests is not None:
                tracked.requests.resume(tracked.handle.heard_at or 0.0)
