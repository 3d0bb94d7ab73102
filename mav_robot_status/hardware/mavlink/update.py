"""Updates a vehicle: a frame changes the state of its speaker; the states of all speakers give the status."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...mavlink.decode import text
from ...mavlink.definitions import CommandInt, CommandLong, Heartbeat, OpenDroneIdArmStatus, Statustext
from . import vehicle_log
from .armed import is_armed
from .belief.belief import SAID_ONCE, Heard, Joined
from .belief.clock import Change
from .derive import derive
from .estop import state as estop
from .estop.messages import overheard
from .facts import UNDISPUTED, Claimed, Deadline
from .faults.messages import transmitter_heard
from .faults.texts import pass_time
from .heartbeat.messages import exchanged, rebooted, starts_anew
from .heartbeat.state import missed
from .identity import is_autopilot
from .joined import joined
from .motion import state as motion
from .satellite.messages import follows, high_latency, sends_heartbeats
from .satellite.state import stated, tells_armed
from .state import VehicleState, begin, timeout_of
from .subjects import HANDLERS_BY_ID, HEARTBEAT_ID, HIGH_LATENCY_ID, facts_of

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Sequence

    from ...clock import Instant
    from ...mavlink.framing import Values
    from .belief import Speaker
    from .derive import Derived
    from .facts import Facts
    from .options import HardwareOptions
    from .vehicle import TrackedVehicle

JUST_AFTER: Final = 1e-3


class Updated(NamedTuple):
    """The result of `status_at`."""

    facts: Facts
    """Of the main speaker."""
    derived: Derived | None
    """The new status; None: what it rests on has not changed."""
    due: float
    """When (monotonic seconds) time alone may change the status."""


# -- a frame -----------------------------------------------------------------------------------------------------------


def on_frame(
    tracked: TrackedVehicle, frame: Values, channel: Hashable, now: Instant, lag: float, options: HardwareOptions
) -> Heard:
    """A frame with the ids of a vehicle changes the state of its speaker. Returns what `belief` says of it."""
    heard = tracked.belief.hear(frame, channel, now, lag)
    if tracked.belief.changes:
        _apply_changes(tracked, now, options)
    speaker, said = heard.speaker, heard.said
    if speaker is None:
        return heard
    _arrived(tracked, speaker, frame[3], now.mono, options)
    if said is None:
        if type(frame[3]) is Heartbeat and speaker.state is not None:  # late, and armed
            speaker.state.told_armed = now.mono
    else:
        _use(tracked, speaker, frame[0], frame[3], said, options)
        if tracked.belief.changes:
            _apply_changes(tracked, now, options)
    return heard


def _arrived(tracked: TrackedVehicle, speaker: Speaker, message: Any, at: float, options: HardwareOptions) -> None:
    """Any news keeps the link of a vehicle connected; once it is lost, only a HEARTBEAT of its autopilot does."""
    state: VehicleState | None = speaker.state
    if state is None:
        return
    is_heartbeat = type(message) is Heartbeat and is_autopilot(message, tracked.component)
    timeout, beat = timeout_of(state, options), state.latest.heartbeat
    if is_heartbeat or at - state.arrived <= timeout:
        state.arrived = max(at, state.arrived)
        if beat is not None and speaker.said_at - beat.at > timeout:
            state.heartbeats = missed(state.heartbeats, at)
    if speaker.lost_since is not None:
        state.stop = estop.lost(state.stop, speaker.lost_since)
        state.note_loss(speaker.lost_since)
        speaker.lost_since = None


def _apply_changes(tracked: TrackedVehicle, now: Instant, options: HardwareOptions) -> None:
    """Apply what `belief` has found: a boot, an exchange of vehicles, and speakers that are one."""
    changes, tracked.belief.changes = tracked.belief.changes, []
    for change in changes:
        speaker, state = change.speaker, change.speaker.state
        if isinstance(change, Joined):
            if change.booted is not None and state is not None:
                rebooted(state, change.booted, now, by_clock=True)
                speaker.newest.clear()
            for message_id, message, said in change.kept:
                newest = speaker.newest.get(message_id, -math.inf)
                if message_id in SAID_ONCE or said.mono >= newest:
                    speaker.newest[message_id] = max(said.mono, newest)
                    _arrived(tracked, speaker, message, said.mono, options)
                    _use(tracked, speaker, message_id, message, said, options)
        elif state is not None:
            booted = speaker.clock.booted or now.mono
            speaker.newest.clear()
            if change.change is Change.BOOT:
                rebooted(state, booted, now, by_clock=True)
            else:
                exchanged(state, booted, now)


def _use(
    tracked: TrackedVehicle, speaker: Speaker, message_id: int, message: Any, said: Instant, options: HardwareOptions
) -> None:
    """One message changes the state of a speaker."""
    state: VehicleState | None = speaker.state
    if message_id in (HEARTBEAT_ID, HIGH_LATENCY_ID):
        state = _claim(tracked, speaker, message_id, message, said, options)
    if state is None:
        return
    if speaker.clock.booted is not None:
        state.booted, state.has_clock = speaker.clock.booted, True
    if message_id == HIGH_LATENCY_ID:
        high_latency(state, message, said, options)
    elif (handler := HANDLERS_BY_ID.get(message_id)) is not None:
        handler(state, message, said, options)


def _claim(
    tracked: TrackedVehicle, speaker: Speaker, message_id: int, message: Any, said: Instant, options: HardwareOptions
) -> VehicleState | None:
    """A HEARTBEAT, or what stands for one, claims the ids. Returns the state that it changes, if it changes one."""
    state: VehicleState | None = speaker.state
    beat = message if message_id == HEARTBEAT_ID else stated(message)
    if not is_autopilot(beat, tracked.component):
        return None
    if state is not None and message_id == HIGH_LATENCY_ID and not _adds(state, message, said, options):
        _compare(speaker, state, beat, said)
        return None
    speaker.claim(beat, said)
    is_first = state is None
    if state is None:
        if tracked.belief.starts(speaker, lambda old: _says_that_it_starts(speaker, old, beat), said.mono):
            return None
        state = speaker.state = begin(beat, said)
        state.event_table, state.arrived = tracked.event_table, said.mono
    state.timeout = getattr(speaker.channel, "heartbeat_timeout", None)
    return None if is_first and message_id == HEARTBEAT_ID else state


def _adds(state: VehicleState, message: Any, said: Instant, options: HardwareOptions) -> bool:
    """Whether a HIGH_LATENCY2 says something new: not while HEARTBEATs arrive, and not if it is older than the last."""
    return not sends_heartbeats(state, said.mono, options) and follows(state, message)


def _compare(speaker: Speaker, state: VehicleState, beat: Heartbeat, said: Instant) -> None:
    """A HIGH_LATENCY2 that adds nothing still says armed or disarmed: armed is held against a disarmed HEARTBEAT."""
    if tells_armed(beat):
        speaker.compare(beat, said)
        if is_armed(beat):
            state.told_armed = said.mono


def _says_that_it_starts(speaker: Speaker, old: Speaker, beat: Any) -> bool:
    """Whether a new speaker says that it starts, as the next boot of an old one: in its HEARTBEAT, or in a text."""
    state: VehicleState | None = old.state
    if state is None or state.latest.heartbeat is None:
        return False
    texts = state.profile.requests.boot_texts
    says = any(type(one.message) is Statustext and text(one.message.text) in texts for one in speaker.kept)
    return says or starts_anew(state.latest.heartbeat.message, beat, state)


# -- a frame of another sender -----------------------------------------------------------------------------------------


def on_command(
    vehicles: Iterable[TrackedVehicle], message: CommandInt | CommandLong, sender: tuple[int, int], now: Instant
) -> Iterator[TrackedVehicle]:
    """A command that a ground station sends to one of the vehicles. Yields those whose stop it puts in doubt."""
    for tracked in vehicles:
        system, component = tracked.ids or (0, 0)
        addressed = message.target_system == system and message.target_component in (0, component)
        if addressed and tracked.state is not None:
            before = tracked.state.stop
            overheard(tracked.state, message, sender, now)
            if tracked.state.stop is not before:
                yield tracked


def on_arm_status(
    vehicles: Iterable[TrackedVehicle], message: OpenDroneIdArmStatus, sender: tuple[int, int], now: Instant
) -> Iterator[TrackedVehicle]:
    """What a Remote ID transmitter says to the autopilot of its system. Yields the vehicles that it changes."""
    for tracked in vehicles:
        if tracked.ids is not None and tracked.ids[0] == sender[0] and tracked.state is not None:
            before = tracked.state.faulty_parts
            transmitter_heard(tracked.state, message, sender[1], now)
            if tracked.state.faulty_parts is not before:
                yield tracked


# -- the status --------------------------------------------------------------------------------------------------------


def status_at(tracked: TrackedVehicle, now: Instant, options: HardwareOptions) -> Updated | None:
    """The status of a vehicle at `now`; None before its first HEARTBEAT."""
    belief, due = tracked.belief, math.inf
    for speaker in belief.speakers:
        if speaker.state is not None:
            due = min(due, _settle(speaker, speaker.state, now, options))
    main = belief.choose(_is_connected, now.mono, options.heartbeat_timeout)
    if main is None or main.state is None:
        return None
    rivals = belief.rivals(now.mono, options.heartbeat_timeout) if _is_connected(main) else []
    if rivals:
        due = min(due, min(one.stands_until for one in rivals) + JUST_AFTER)
        vehicle_log.strangers(tracked, main, rivals, now.mono)
    claimed, until = _claimed(tracked, [main, *rivals], now)
    vehicle_log.late(tracked, main, now.mono)
    basis = (claimed, main.facts, *(one.facts for one in rivals))
    if basis == tracked.basis:
        return Updated(main.facts, None, min(due, until))
    tracked.basis = basis
    ids, before = tracked.ids or (0, 0), tracked.handle.detail
    facts = [one.facts._replace(claimed=claimed) for one in (main, *rivals)]
    every = [derive(one, ids, before, now, options) for one in facts]
    derived = every[0] if len(every) == 1 else joined(every, before, now)
    return Updated(facts[0], derived, min(due, until))


def _settle(speaker: Speaker, state: VehicleState, now: Instant, options: HardwareOptions) -> float:
    """Settle the facts of one speaker. Returns when time alone may change them."""
    pass_time(state, now, options)
    for moving in (state.motion, state.gps_motion, state.rotation):
        motion.settle(moving, now.mono)
    state.stop = estop.moved(state.stop, state.motion.value, now.mono)
    deadline = Deadline(now.mono)
    facts = facts_of(state, deadline, options)
    if facts != speaker.facts:
        speaker.facts = facts
    return deadline.next if _is_connected(speaker) else math.inf


def _is_connected(speaker: Speaker) -> bool:
    facts: Facts | tuple[()] = speaker.facts
    return bool(facts) and (facts.fresh.heartbeat or facts.fresh.link)  # type: ignore[union-attr]


def _claimed(tracked: TrackedVehicle, speakers: Sequence[Speaker], now: Instant) -> tuple[Claimed, float]:
    """Whether two vehicles use the ids, and until when (monotonic seconds) that lasts."""
    belief = tracked.belief
    conflict, until = belief.compare(speakers[1:], now)
    mixed = belief.mixed(speakers, now.mono)
    found = mixed or conflict
    if found is None:
        return UNDISPUTED, until
    vehicle_log.conflict(tracked, found, speakers)
    return Claimed(found.since.unix_us, mixed is not None), min(until, belief.ends(found))
