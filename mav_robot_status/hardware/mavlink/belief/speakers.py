"""Who speaks with the ids of a vehicle: for how long each one claims them, and what proves two to be one."""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from math import inf
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ....mavlink.enumerations import MAV_AUTOPILOT_INVALID
from ..armed import is_armed, may_move
from ..satellite.state import is_statement, tells_armed
from .clock import JUMP, NEAR, Clock, turned

if TYPE_CHECKING:
    from collections.abc import Hashable

    from ....clock import Instant
    from ....mavlink.definitions import Heartbeat
    from .counts import Count

STANDS: Final = 4.0
"""Seconds for which a HEARTBEAT claims the ids: four of its usual intervals."""
INTERVALS, LONGEST = 3.2, 20.0
"""An armed claim stands for this many intervals of its HEARTBEAT, at most so many seconds."""
STATED: Final = 5.0
"""Seconds between two HIGH_LATENCY2 of ArduPilot, the only autopilot that says armed there."""
DIFFERS: Final = 5.0
"""Seconds for which two speakers differ before that is a conflict."""
HOLD: Final = 10.0
"""Seconds for which a conflict lasts after its latest evidence."""
LATE_PORT: Final = 10.0
"""Seconds by which the clocks of one vehicle differ at most, if one of its channels is late from the start."""
GAPS, SPARSE = 3, 60.0
"""A count that breaks so often within so many seconds is that of a link that loses most frames."""
MOST_KEPT: Final = 256
"""Frames of a new speaker that are kept until it is proven to be another one."""


class Conflict(NamedTuple):
    """Two vehicles use the same ids."""

    since: Instant
    last: float
    """The latest evidence, monotonic seconds."""
    why: str


class Said(NamedTuple):
    """A message of a speaker, and when it was said."""

    message_id: int
    message: Any
    at: Instant


class Alternation:
    """What one vehicle does not do: change a value to and fro, as two vehicles in one count do."""

    def __init__(self) -> None:
        self._values: dict[str, object] = {}
        self._changes: dict[str, deque[float]] = {what: deque(maxlen=most) for what, (most, _) in ALTERNATIONS.items()}

    def shows(self, heartbeat: Heartbeat, now: float) -> str | None:
        """What alternates, if this HEARTBEAT shows that."""
        found = None
        for what, value in (("armed and disarmed", is_armed(heartbeat)), ("two types", kind_of(heartbeat))):
            before = self._values.get(what, value)
            self._values[what] = value
            changes, (most, within) = self._changes[what], ALTERNATIONS[what]
            if value != before:
                changes.append(now)
                if len(changes) == most and now - changes[0] <= within:
                    found = what
        return found


ALTERNATIONS: Final = {"armed and disarmed": (4, 4.0), "two types": (2, 10.0)}
"""So many changes within so many seconds are those of two vehicles."""


class Speaker:
    """One boot of one vehicle, as heard on one or more channels. Times are monotonic seconds."""

    def __init__(self, channel: Hashable, now: float) -> None:
        self.state: Any = None
        """Its `VehicleState`; None before its first HEARTBEAT."""
        self.facts: Any = ()
        """The `Facts` of that state. The owner settles them."""
        self.clock = Clock()
        self.counts: list[Count] = []
        self.channel: Hashable = channel
        """Where it is best reached: it stays there while news or copies arrive."""
        self.channel_at = self.since = self.heard_at = self.said_at = now
        """When it was last heard on that channel, first heard, last heard; and when its newest message was said."""
        self.trusted_at = -inf
        """When it was last heard on a trusted channel."""
        self.beats: deque[float] = deque(maxlen=6)
        """When its latest HEARTBEATs were said."""
        self.beat_at = -inf
        """When the latest one arrived: one that says armed counts from then on, however late it is."""
        self.armed = False
        """Whether the latest one says that it may move."""
        self.is_stated = False
        """Whether it is heard through HIGH_LATENCY2, not by HEARTBEATs."""
        self.kind: tuple[int, int] | None = None
        """Its autopilot and type. None: it sent no HEARTBEAT, and claims nothing."""
        self.proof = "not proven"
        """How it is known to be the vehicle, or that its counts are of one vehicle; for a person."""
        self.proven = False
        """Whether it is not to join another one: it was the first, or the only one left."""
        self.newest: dict[int, float] = {}
        """By message id: when the newest one was said."""
        self.kept: deque[Said] = deque(maxlen=MOST_KEPT)
        self.gaps: deque[float] = deque(maxlen=GAPS)
        """When its count broke, although it was the same sender."""
        self.copies: dict[Speaker, int] = {}
        """How often a channel of this speaker repeated a frame of another one."""
        self.lost_since: float | None = None
        """Since when frames are lost. The owner takes it."""
        self.clock_turns: deque[float] = deque(maxlen=3)
        """When another clock ticked in its count, each after one of its own."""
        self.alternation = Alternation()
        self.conflict: Conflict | None = None
        """Two vehicles in its count. It ends HOLD after its `last`."""

    def claim(self, heartbeat: Heartbeat, now: Instant) -> None:
        """Note a HEARTBEAT, or what stands for one: its speaker claims the ids."""
        at = now.mono
        if self.beats and at < self.beats[-1]:
            self.claim_late(heartbeat, self.heard_at)
            return
        self.kind, self.is_stated = kind_of(heartbeat), is_statement(heartbeat)
        if not tells_armed(heartbeat):
            return
        self.beats.append(at)
        self.beat_at = self.heard_at
        self.armed = may_move(heartbeat)
        self.compare(heartbeat, now)

    def claim_late(self, heartbeat: Heartbeat, now: float) -> bool:
        """Note a HEARTBEAT that is older than the newest one. Whether it says armed: then disarmed is in doubt."""
        if not self.beats or heartbeat.autopilot == MAV_AUTOPILOT_INVALID or not may_move(heartbeat):
            return False
        self.armed, self.beat_at = True, now
        return True

    def compare(self, heartbeat: Heartbeat, now: Instant) -> None:
        """Compare a HEARTBEAT, or what is said beside the HEARTBEATs, with those before: two vehicles alternate."""
        why = self.alternation.shows(heartbeat, now.mono)
        if why is not None:
            self.contradict(f"{why} in turn", now)

    def contradict(self, why: str, now: Instant) -> None:
        """Note that two vehicles speak in its count."""
        begun = now if self.conflict is None or now.mono - self.conflict.last > HOLD else self.conflict.since
        self.conflict = Conflict(begun, now.mono, why)

    def claim_again(self, heartbeat: Heartbeat, now: float) -> None:
        """Note a copy of a HEARTBEAT: it is no news, but what says armed is a claim again."""
        if self.armed and may_move(heartbeat):
            self.beat_at = now

    @property
    def interval(self) -> float:
        """The median interval of its HEARTBEATs, seconds; 0 before the second one."""
        gaps = sorted(later - earlier for earlier, later in pairwise(self.beats))
        return gaps[len(gaps) // 2] if gaps else 0.0

    @property
    def stands_until(self) -> float:
        """Until when it claims the ids."""
        if not self.beats:
            return -inf
        if not self.armed:
            return self.beats[-1] + STANDS
        interval = max(self.interval, STATED) if self.is_stated else self.interval
        return max(self.beats[-1], self.beat_at) + max(STANDS, min(INTERVALS * interval, LONGEST))

    def is_sparse(self, now: float) -> bool:
        """Whether its count breaks so often, on a link that loses most frames, that numbers tell nothing."""
        return len(self.gaps) == GAPS and now - self.gaps[0] <= SPARSE

    def heard_on(self, channel: Hashable, now: float) -> None:
        """Note news or a copy on one of its channels."""
        if channel is self.channel or now - self.channel_at > 1.5:
            self.channel, self.channel_at = channel, now

    @property
    def lag(self) -> float:
        """How late it is heard, seconds: by the fastest of its channels."""
        heard = [count.lag for count in self.counts if self.clock.heard_at - count.lag.at <= NEAR]
        return min((lag.seconds for lag in heard), default=0.0)

    def lost(self, since: float) -> None:
        """Note that frames are lost since a time."""
        self.lost_since = since if self.lost_since is None else max(since, self.lost_since)

    def clocks_alternate(self, now: float) -> bool:
        """Note that another clock ticks in its count. Whether that happens in turn with its own."""
        turns = self.clock_turns
        if not turns or self.clock.heard_at > turns[-1]:
            turns.append(now)
        return len(turns) == turns.maxlen and now - turns[0] <= 4.0

    def follows(self, other: Speaker) -> bool:
        """Whether it began on a channel of the other one, whose counts are not heard since."""
        shared = {count.channel for count in self.counts} & {count.channel for count in other.counts}
        return bool(shared) and all(count.at < self.since for count in other.counts)

    def goes_on_after(self, other: Speaker) -> bool:
        """Whether it follows the other one, whose counts had fallen silent before."""
        return self.follows(other) and all(count.is_silent(self.since) for count in other.counts)


def kind_of(heartbeat: Heartbeat) -> tuple[int, int]:
    """What no vehicle changes."""
    return heartbeat.autopilot, heartbeat.type


def is_same_boot(young: Speaker, old: Speaker, now: float) -> bool:
    """Whether the clocks prove one boot: by SAMPLES, or by one where the young one goes on after the old one."""
    if young.clock.booted is None or not _same_kind(young, old):
        return False
    if old.clock.booted is None:  # nothing contradicts it; but what is dangerous to believe needs a proof
        return young.goes_on_after(old) and not old.armed
    if abs(turned(young.clock.booted - old.clock.booted)) > JUMP:
        return False
    return young.clock.is_proven(now) or young.goes_on_after(old)


def has_booted(young: Speaker, old: Speaker, now: float) -> bool:
    """Whether the clock of the young one proves that the old one booted: it began after the last frame of that run."""
    return began_after(young, old) and _same_kind(young, old) and young.clock.is_proven(now) and young.follows(old)


def began_after(young: Speaker, old: Speaker) -> bool:
    """Whether the clock of the young one began after the last frame of the run of the old one."""
    if young.clock.booted is None or old.clock.booted is None:
        return False
    is_other = abs(turned(young.clock.booted - old.clock.booted)) > JUMP
    return is_other and young.clock.booted > old.clock.last - JUMP


def _same_kind(one: Speaker, other: Speaker) -> bool:
    return one.kind is None or other.kind is None or one.kind == other.kind


def differ(one: Speaker, other: Speaker) -> str | None:
    """In what two speakers differ, as one vehicle on two channels does not. None: one vehicle may be both."""
    if one.kind != other.kind:
        return "HEARTBEAT.type and autopilot differ"
    a, b = one.clock.booted, other.clock.booted
    apart = 0.0 if a is None or b is None else abs(turned(a - b))
    if apart > LATE_PORT:
        return "clocks of two autopilots"
    return "armed and disarmed at the same time" if one.armed != other.armed and apart <= JUMP else None
