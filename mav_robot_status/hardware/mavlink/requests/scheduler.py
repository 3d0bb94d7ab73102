"""The requests to all vehicles: messages, parameters and pre-arm checks, and when the next one may be due."""

from __future__ import annotations

import math
from itertools import takewhile
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ....interface import LinkState
from ....interface.status import TriState
from ....mavlink import definitions as mav
from ....mavlink import enumerations as mavlink
from ....mavlink.decode import text
from ....mavlink.definitions import CommandAck, MessageInterval, ParamValue, RequestEvent, Statustext
from ....mavlink.enumerations import MAV_CMD_RUN_PREARM_CHECKS, MAV_STATE_BOOT, MAV_STATE_CALIBRATING, MAV_STATE_UNINIT
from ..autopilots.profile import Uninit
from ..autopilots.wanted import METADATA, OUTPUT_WATCH, Once
from .message_intervals import Requests, wanted_of
from .parameters import Parameters

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Mapping

    from ..vehicle import TrackedVehicle

ROOM: Final = 0.5  # s until a vehicle whose link has no room is looked at again
ANSWERS: Final = frozenset(
    d.id for d in mav.MESSAGES.values() if d.type in (CommandAck, MessageInterval, ParamValue, Statustext)
)
"""The messages that say something about a request."""

EVENTS: Final = frozenset({mavlink.MAVLINK_MSG_ID_EVENT, mavlink.MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE})


class Ask(NamedTuple):
    """A message for the autopilot of one vehicle."""

    system: int
    component: int
    message: Any


class RequestScheduler:
    """Collects the requests that are due. It looks only when `next_due` has come, or `passive` has changed."""

    def __init__(self, watch_outputs: bool, own_component: int, request_events: bool = True) -> None:
        self.own_component = own_component
        self.own_system: int | None = None
        """Our system id. None: the system id of the vehicle."""
        self.next_due = -math.inf
        """When (monotonic seconds) a request may be due. -inf: at once, because something has changed."""
        self.without: frozenset[Once] = frozenset({METADATA})
        """What is not requested even if the profile of a vehicle names it."""
        self._watch_outputs = watch_outputs
        self._request_events = request_events
        self._passive: Container[tuple[int, int]] = ()

    def heard(self, tracked: TrackedVehicle, message: Any, message_id: int, now: float) -> None:
        """Note a message of a vehicle: a message that arrives need not be requested."""
        requests = tracked.requests
        if requests is None:
            return
        requests.arrived(message_id, now)
        if message_id in EVENTS:  # one may be missing
            self.next_due = -math.inf
        if message_id in ANSWERS:
            self._answered(requests, tracked, message, now)

    def _answered(self, requests: Requests, tracked: TrackedVehicle, message: Any, now: float) -> None:
        if type(message) is CommandAck and tracked.ids is not None:
            requests.acknowledged(message, (self.own_system or tracked.ids[0], self.own_component), now)
            self.next_due = -math.inf
        elif type(message) is ParamValue and tracked.parameters is not None:
            tracked.parameters.heard(text(message.param_id))
        elif type(message) is MessageInterval:
            requests.told(message.message_id, message.interval_us)
        elif (
            type(message) is Statustext
            and tracked.state is not None
            and text(message.text) in tracked.state.profile.requests.boot_texts
        ):
            requests.look_again(now)
            self.next_due = -math.inf

    def waits_for(self, tracked: TrackedVehicle) -> str | None:
        """What this vehicle was asked for and has not sent yet, in words; None if nothing is outstanding."""
        if tracked.ids is None or tracked.state is None or tracked.handle.detail.link is not LinkState.CONNECTED:
            return None
        requests, parameters = tracked.requests, tracked.parameters
        waiting = [] if requests is None else requests.outstanding()
        if parameters is not None and (names := parameters.outstanding()):
            waiting.append(f"{len(names)} parameters from {names[0]} on")
        return "vehicle {}.{}: {}".format(*tracked.ids, ", ".join(waiting)) if waiting else None

    def names(self, tracked: TrackedVehicle) -> list[str]:
        """The names of the messages that the status of a vehicle needs."""
        state = tracked.state
        return [] if state is None else [w.name for w in wanted_of(state.profile, state.family, self._watch_outputs)]

    def asked(self, tracked: TrackedVehicle, now: float) -> dict[str, str]:
        """What is known about the request for each wanted message of a vehicle, in words."""
        if tracked.ids in self._passive:
            return dict.fromkeys(self.names(tracked), "mav-robot-status does not ask for it (passive).")
        asked_at = {} if tracked.requests is None else tracked.requests.asked_at
        return {name: f"Asked for {now - at:.0f} s ago, no answer." for name, at in asked_at.items()}

    def due(
        self,
        vehicles: Mapping[tuple[int, int], TrackedVehicle],
        now: float,
        passive: Container[tuple[int, int]],
        has_room: Callable[[tuple[int, int], int], bool] = lambda ids, number: True,
    ) -> list[Ask]:
        """The requests to send at `now`, none to vehicles on `passive` links, nor where there is no room for more."""
        if now < self.next_due and passive == self._passive:
            return []
        self._passive = passive
        self.next_due = math.inf
        asks: list[Ask] = []
        for ids, tracked in vehicles.items():
            if ids in passive or tracked.handle.detail.link is not LinkState.CONNECTED or tracked.costly:
                continue
            if not has_room(ids, len(asks)):
                self.next_due = min(self.next_due, now + ROOM)
                continue
            message = self._of(ids, tracked, now)
            if message is not None:
                asks.append(Ask(*ids, message))
        if asks:  # another may follow at once
            self.next_due = -math.inf
        return asks

    def _of(self, ids: tuple[int, int], tracked: TrackedVehicle, now: float) -> Any:
        """The next request to one vehicle, or None."""
        state = tracked.state
        if state is None:
            return None
        if tracked.requests is None:
            tracked.requests = Requests(*ids, now)
        if now >= tracked.requests.next_due() and not _has_stayed(tracked):
            self.next_due = min(self.next_due, now + ROOM)
            return None
        wanted = wanted_of(state.profile, state.family, self._watch_outputs)
        if is_booting(tracked):
            tracked.requests.wait_for_boot(now)
        message: Any = tracked.requests.due(now, wanted, state.profile, self.without)
        if message is None and OUTPUT_WATCH[0] in wanted:
            if tracked.parameters is None:
                tracked.parameters = Parameters(*ids, now)
            message = tracked.parameters.due(now)
            self.next_due = min(self.next_due, tracked.parameters.next_due())
        if message is None:
            message = self._lost_events(ids, tracked)
        if message is None and not tracked.requests.checks_asked and _may_be_asked(tracked, now):
            tracked.requests.checks_asked = True
            message = command(ids)
        self.next_due = min(self.next_due, tracked.requests.next_due())
        return message

    def _lost_events(self, ids: tuple[int, int], tracked: TrackedVehicle) -> Any:
        """The request for events that did not arrive."""
        missing = () if tracked.state is None else tracked.state.events.missing
        if not self._request_events or (not missing and tracked.lost_events is None):
            return None
        if tracked.lost_events is None:
            tracked.lost_events = LostEvents(*ids)
        return tracked.lost_events.due(missing)


def is_booting(tracked: TrackedVehicle) -> bool:
    """Whether an autopilot is still starting: its streams do not run yet."""
    state = tracked.state
    if state is None or state.latest.heartbeat is None:
        return False
    beat = state.latest.heartbeat.message
    if beat.system_status == MAV_STATE_UNINIT:
        return state.profile.states.uninit is Uninit.STARTING
    if beat.system_status in (MAV_STATE_BOOT, MAV_STATE_CALIBRATING):
        return True
    return bool(state.profile.modes.initialising.get(state.family) == beat.custom_mode)


def _may_be_asked(tracked: TrackedVehicle, now: float) -> bool:
    """Whether the pre-arm checks of a vehicle should run now."""
    return is_wanted(tracked, now) and _has_stayed(tracked) and not is_booting(tracked)


def _has_stayed(tracked: TrackedVehicle) -> bool:
    """Whether it sent more than one HEARTBEAT: nothing is asked of an id that was heard once."""
    heartbeats = None if tracked.state is None else tracked.state.heartbeats
    return heartbeats is not None and heartbeats.runs[-1].last > heartbeats.since.mono


LISTEN: Final = 3.0
"""Seconds from the first heartbeat in which a PX4 may report by itself."""


def is_wanted(tracked: TrackedVehicle, now: float) -> bool:
    """Whether the vehicle is disarmed beyond doubt, can be asked, and has not said whether, or why, its checks fail."""
    state, facts = tracked.state, tracked.facts
    if state is None or not facts or not state.profile.requests.prearm_checks:
        return False
    if state.heartbeats.armed or tracked.handle.status.drives_powered is not TriState.FALSE:
        return False
    if state.profile.texts.sends_events:
        return not state.arming.chunks and now >= state.heartbeats.since.mono + LISTEN
    return facts.fresh.sys_status and facts.sys_status.ready is TriState.FALSE


def command(ids: tuple[int, int]) -> mav.CommandLong:
    """The command for the autopilot with these ids."""
    return mav.CommandLong(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, MAV_CMD_RUN_PREARM_CHECKS, *ids, confirmation=0)


class LostEvents:
    """The requests to one autopilot for its lost events."""

    def __init__(self, system: int, component: int) -> None:
        self._ids = (system, component)
        self._asked: frozenset[int] = frozenset()
        """The sequence numbers that were asked for and are still missing."""

    def due(self, missing: tuple[int, ...]) -> RequestEvent | None:
        """The next request, for the first run of consecutive numbers that were not asked for; None if there is none.

        `missing` are the sequence numbers that have not arrived, the oldest first.
        """
        if not missing:
            self._asked = frozenset()
            return None
        self._asked &= frozenset(missing)
        new = [number for number in missing if number not in self._asked]
        if not new:
            return None
        run = [number for _, number in takewhile(lambda pair: (new[0] + pair[0]) & 0xFFFF == pair[1], enumerate(new))]
        self._asked |= frozenset(run)
        return RequestEvent(run[0], run[-1], *self._ids)
