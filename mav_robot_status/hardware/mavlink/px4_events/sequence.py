"""The events of an autopilot by their sequence numbers: what has arrived, in any order, and what is missing.

PX4 numbers its events without gaps, with 16 bits, and keeps the last 20 to be asked for again. CURRENT_EVENT_SEQUENCE
gives the number of the newest one; its flag RESET says that the count begins anew. Source: mavlink/libevents,
`libs/cpp/protocol/receive.h`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from ....clock import Instant
    from ....mavlink.definitions import CurrentEventSequence, Event, ResponseEventError

RESET: Final = 1  # MAV_EVENT_CURRENT_SEQUENCE_FLAGS_RESET
KEPT: Final = 32
"""The events that are remembered. A report of the arming checks has at most 16 (PX4: `event_s::ORB_QUEUE_LENGTH`)."""
ASKABLE: Final = 20
"""The events that PX4 keeps."""
HALF: Final = 1 << 15
BACK_MS: Final = 10_000
"""An event this much older than the newest one is from another run of the autopilot, as in libevents."""


class Arrival(Enum):
    """How an event relates to those before it."""

    NEWEST = "newer than all others"
    LATE = "missing until now, while a newer one has arrived"
    REPEATED = "known, or too old to be used"


class EventSequence(NamedTuple):
    """The newest events of one run of an autopilot."""

    newest: int | None = None
    """The newest sequence number that the autopilot has used. None: unknown."""
    events: Mapping[int, Event] = {}
    """By sequence number, at most KEPT."""
    missing: tuple[int, ...] = ()
    """The sequence numbers that have not arrived, the oldest first, at most ASKABLE."""
    unbroken: int = 0
    """How many events up to the newest one have arrived without a gap, as far as remembered."""
    since: float = math.inf
    """When this run was first heard, monotonic seconds."""
    lost: int = 0
    """Events that the autopilot could not send again."""

    def has_all_after(self, sequence: int) -> bool:
        """Whether each event after this one has arrived."""
        return self.newest is not None and distance(sequence, self.newest) <= self.unbroken


NOTHING: Final = EventSequence()


def distance(before: int, after: int) -> int:
    """How many events `after` comes after `before`: 0 to 65535."""
    return (after - before) & 0xFFFF


def heard(known: EventSequence, event: Event, now: Instant) -> tuple[EventSequence, Arrival]:
    """The sequence after an EVENT."""
    sequence = event.sequence
    if known.newest is None or _is_of_another_run(known, event):
        return EventSequence(sequence, {sequence: event}, unbroken=1, since=now.mono, lost=known.lost), Arrival.NEWEST
    ahead = distance(known.newest, sequence)
    if 0 < ahead < HALF:
        events = _newest_of({**known.events, sequence: event}, sequence)
        missing = (*known.missing, *_between(known.newest, sequence))[-ASKABLE:]
        unbroken = min(known.unbroken + 1, HALF - 1) if ahead == 1 else 1
        return known._replace(newest=sequence, events=events, missing=missing, unbroken=unbroken), Arrival.NEWEST
    is_announced = sequence == known.newest and sequence not in known.events
    if sequence not in known.missing and not is_announced:
        return known, Arrival.REPEATED
    is_newest = all(distance(number, sequence) < HALF for number in known.events)
    events = _newest_of({**known.events, sequence: event}, known.newest)
    missing = tuple(number for number in known.missing if number != sequence)
    unbroken = max(known.unbroken, _run_to(known.newest, events))
    known = known._replace(events=events, missing=missing, unbroken=unbroken)
    return known, Arrival.NEWEST if is_newest else Arrival.LATE


def told(known: EventSequence, message: CurrentEventSequence, now: Instant) -> EventSequence:
    """The sequence after a CURRENT_EVENT_SEQUENCE. A count that differs from it widely begins anew."""
    sequence = message.sequence
    if known.newest == sequence:
        return known
    ahead = 0 if known.newest is None else distance(known.newest, sequence)
    is_late = ahead >= HALF and distance(sequence, known.newest or 0) <= KEPT
    if known.newest is None or message.flags & RESET or (ahead >= HALF and not is_late):
        return EventSequence(sequence, since=now.mono, lost=known.lost)
    if is_late:
        return known
    missing = (*known.missing, *_between(known.newest, sequence), sequence)[-ASKABLE:]
    return known._replace(newest=sequence, missing=missing, unbroken=0)


def refused(known: EventSequence, message: ResponseEventError) -> EventSequence:
    """The sequence after a RESPONSE_EVENT_ERROR: the autopilot has no events before the oldest available one."""
    oldest = message.sequence_oldest_available
    gone = {
        number
        for number in known.missing
        if number == message.sequence or distance(oldest, number) >= HALF  # before the oldest
    }
    if message.sequence not in gone:
        return known
    missing = tuple(number for number in known.missing if number not in gone)
    return known._replace(missing=missing, lost=known.lost + len(gone))


def _is_of_another_run(known: EventSequence, event: Event) -> bool:
    """Whether the autopilot has begun to count anew: its clock goes back, or another event has this number."""
    assert known.newest is not None
    if 0 < distance(known.newest, event.sequence) < HALF or event.sequence in known.missing:
        return False
    same, last = known.events.get(event.sequence), known.events.get(known.newest)
    if same is not None:
        return same.event_time_boot_ms != event.event_time_boot_ms
    return last is not None and event.event_time_boot_ms + BACK_MS < last.event_time_boot_ms


def _between(before: int, after: int) -> tuple[int, ...]:
    """The sequence numbers between two others, at most the last ASKABLE."""
    number = min(distance(before, after) - 1, ASKABLE)
    return tuple((after - back) & 0xFFFF for back in range(number, 0, -1))


def _newest_of(events: Mapping[int, Event], newest: int) -> Mapping[int, Event]:
    """The events that are remembered, in order."""
    order = sorted(events, key=lambda sequence: distance(sequence, newest))[:KEPT]
    return {sequence: events[sequence] for sequence in reversed(order)}


def _run_to(newest: int, events: Mapping[int, Event]) -> int:
    """The number of events up to the newest one without a gap."""
    return next(back for back in range(KEPT + 1) if (newest - back) & 0xFFFF not in events)
