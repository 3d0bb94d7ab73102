"""Who may speak as a vehicle: which way counts for its ids, and whether several senders claim them.

A *way* is a channel on which frames arrive; here it is any hashable value. One way is selected for each vehicle, and
only its frames change the state. The heartbeats of every other sender of the same ids are *claims*. They change no
state, but they are compared with the selected way:

- A live claim of a vehicle that may move makes a selected way doubtful at once that says disarmed, or in its state that
  motion is not possible.
- Claims are a conflict if they differ for longer than a slow way explains, or in what no vehicle changes.
- A silent way is replaced by one that does not contradict it. One that does has to wait for a link loss.
- A HIGH_LATENCY2 is a statement as a HEARTBEAT is (`high_latency.stated`). It comes seldom, so it counts for longer; it
  never takes the place of a HEARTBEAT that arrives, and gives way to one at once.

No I/O and no clock: time is an argument, in monotonic seconds.
"""

from __future__ import annotations

import math
from collections import deque
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, Generic, TypeVar

from ....values import NamedTuple
from ..armed import is_armed, may_move
from .boot_clock import APART
from .high_latency import LEAST_TIMEOUT, is_statement, tells_armed
from .turns import Turns

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from ....clock import Instant
    from ....mavlink.definitions import Heartbeat

LIVE: Final = 3.0
"""Seconds for which a claim counts. Two heartbeat periods of 1 s, with a margin."""
SILENCE: Final = 1.5
"""Seconds without a heartbeat after which another way may be selected. Longer than the heartbeat period, shorter than
the heartbeat timeout (3.5 s)."""
PERSISTS: Final = 5.0
"""Seconds of disagreement that the delay of a slow way does not explain."""
HOLD: Final = 10.0
"""Seconds for which a conflict lasts after its last evidence."""
PROOFS: Final = 5
"""Consecutive samples of a clock that prove two autopilots, if they span PROOF seconds."""
PROOF: Final = 2.0
COPIES: Final = 3.0
"""Seconds within which a router delivers a copy of a heartbeat on another way."""
CONTINUES: Final = 48
"""Sequence numbers continue a count if they are ahead of it by at most this. Unwanted and lost frames lie between."""
COUNTED_APART: Final = 42
"""MISSION_CURRENT: Betaflight counts its sequence numbers apart from those of all other messages (recorded)."""
SIGNED_LASTS: Final = 30.0
"""Seconds after a verified frame for which frames without a verified signature are not claims."""
MOST_CLAIMS: Final = 8
MOST_COPIES: Final = 16

CLOCKS: Final = frozenset({2, 30, 32, 33})
"""Message ids with time_boot_ms: SYSTEM_TIME, ATTITUDE, positions."""
NEVER: Final = -math.inf
BESIDE: Final = "HIGH_LATENCY2"
"""With a way, the key of a claim by HIGH_LATENCY2: it does not replace what the HEARTBEATs of the way say."""

C = TypeVar("C")
"""A way: any hashable value."""


class Outcome(Enum):
    """What becomes of a frame that did not arrive on the selected way."""

    UNUSED = "unused"
    """It changes no state."""
    SELECTED = "selected"
    """Its way is now selected."""
    EXCHANGED = "exchanged"
    """Its way is now selected, and its sender is another vehicle: what is known of the old one is void."""


class Conflict(NamedTuple):
    """Two autopilots claim the same ids."""

    since: Instant
    last: float
    """The latest evidence."""
    why: str
    ways: tuple[Any, Any]
    """Where the two were heard; the same way twice if they share it."""


class Claim:
    """What was last said with these ids on one way, or by one other component."""

    __slots__ = (
        "armed_at",
        "at",
        "booted",
        "broken",
        "copied",
        "counts",
        "former_at",
        "heartbeat",
        "number",
        "sequence",
        "way",
    )

    def __init__(
        self, way: Any, heartbeat: Heartbeat, sequence: int, at: float, counts_from: float | None = None
    ) -> None:
        self.way, self.heartbeat, self.at = way, heartbeat, at
        self.armed_at = (at if counts_from is None else counts_from) if may_move(heartbeat) else NEVER
        """When the sender with this count of sequence numbers said that it may move. NEVER if it took that back."""
        self.former_at = NEVER
        """When a sender with another count last said that. Only time ends that."""
        self.copied = False
        """Whether a router copied it from another way: then it is not a claim of its own."""
        self.booted: float | None = None
        """When its autopilot booted, if it sent a clock."""
        self.number = self.sequence = sequence
        """The sequence numbers of the latest heartbeat and of the latest frame."""
        self.broken = False
        """Whether a frame since that heartbeat did not continue the count."""
        self.counts = False
        """Whether the sequence numbers change at all."""

    @property
    def armed(self) -> bool:
        """Whether the latest heartbeat says armed."""
        return is_armed(self.heartbeat)

    @property
    def doubt_at(self) -> float:
        """When anyone on this way last said that the vehicle may move, and did not take that back since."""
        return self.armed_at if self.armed_at > self.former_at else self.former_at

    def follow(self, sequence: int) -> None:
        """Note the sequence number of a frame."""
        if (sequence - self.sequence) & 255 > CONTINUES:
            self.broken = True
        self.sequence = sequence

    def hear(
        self, heartbeat: Heartbeat, sequence: int, at: float, counts_from: float | None = None, *, signed: bool = False
    ) -> bool:
        """Note a heartbeat. Returns whether it continues the count: then it has the same sender as the one before.

        It counts for LIVE seconds from `counts_from` on; None: from `at` on.
        """
        continues = signed or not (self.broken or (sequence == self.number and self.counts))
        if not continues:
            self.former_at = max(self.former_at, self.armed_at)
        if tells_armed(heartbeat):
            self.armed_at = (at if counts_from is None else counts_from) if may_move(heartbeat) else NEVER
        if sequence != self.number:
            self.number, self.counts = sequence, True
        self.broken, self.heartbeat, self.at = False, heartbeat, at
        return continues


class Claims(Generic[C]):
    """All that claim the ids of one vehicle. Bounded for any number of senders."""

    __slots__ = (
        "_apart_since",
        "_copies",
        "_proofs",
        "_proofs_since",
        "_turns",
        "armed_at",
        "broken",
        "conflict",
        "differed_at",
        "disarmed_at",
        "lasts",
        "mine",
        "news",
        "others",
        "sequence",
        "timeout",
        "unused",
        "verified_at",
        "way",
    )

    def __init__(self) -> None:
        self.unused = 0
        """Frames on ways that were not selected."""
        self.timeout: float | None = None
        """Seconds after which the link of the selected way counts as lost, if the site says so. The owner sets this."""
        self.forget()

    def forget(self) -> None:
        """Forget every sender. The next one is believed as the first."""
        self.way: C | None = None
        """The selected way."""
        self.mine: Claim | None = None
        """What was said last on it. None: no heartbeat yet."""
        self.sequence = 0
        """The sequence number of the latest frame on it. The owner sets this, and the next one, for each frame."""
        self.broken = False
        """Whether a frame since the last heartbeat did not continue the sequence numbers."""
        self.others: dict[Hashable, Claim] = {}
        self.conflict: Conflict | None = None
        """The latest conflict. It ends HOLD after its `last`."""
        self.news: Conflict | None = None
        """A conflict that has begun. The owner logs and resets it."""
        self.armed_at = self.disarmed_at = self.differed_at = NEVER
        """When a sender other than the selected one last said armed; said disarmed; when two last differed."""
        self.verified_at = NEVER
        """When the latest frame with a verified signature arrived."""
        self.lasts = LEAST_TIMEOUT
        """Seconds for which a HIGH_LATENCY2 counts: as long as the status made of it. The owner sets it."""
        self._apart_since: float | None = None
        self._proofs = 0
        self._proofs_since = 0.0
        self._turns = Turns()
        self._copies: deque[tuple[int, Heartbeat, float]] = deque(maxlen=MOST_COPIES)
        """The latest heartbeats on the selected way, while there is another one."""

    # the selected way

    def heard(self, heartbeat: Heartbeat, sequence: int, way: C, now: Instant) -> None:
        """Process a heartbeat on the selected way. The first one selects its way."""
        at, mine = now.mono, self.mine
        if mine is None:
            self.way, self.mine = way, Claim(way, heartbeat, sequence, at, self._counts_from(heartbeat, at))
            self._turns.heard(heartbeat, at)
        elif heartbeat == mine.heartbeat and not self.broken:
            if sequence != mine.number:
                mine.number, mine.counts = sequence, True
            mine.at = at
            if may_move(heartbeat):  # also if it was a copy before: this is not a copy
                mine.armed_at = self._counts_from(heartbeat, at)
        else:
            self._changed(mine, heartbeat, sequence, now)
        self.sequence, self.broken = sequence, False
        if self.others:
            if self.mine is not None and self.mine.counts:
                self._copies.append((sequence, heartbeat, at))
            self._compare(None, now)

    def follow_own(self, sequence: int) -> None:
        """Note the sequence number of a frame on the selected way, if the owner does not."""
        if (sequence - self.sequence) & 255 > CONTINUES:
            self.broken = True
        self.sequence = sequence

    def _changed(self, mine: Claim, heartbeat: Heartbeat, sequence: int, now: Instant) -> None:
        """Something else is said on the selected way: by the vehicle, or by a second sender on it?"""
        before, armed_at = mine.heartbeat, mine.doubt_at
        self._note(before, mine.at)
        if _stance(heartbeat) != _stance(before):
            self.differed_at = now.mono
        mine.broken = self.broken
        counts_from = self._counts_from(heartbeat, now.mono)
        continues = mine.hear(heartbeat, sequence, now.mono, counts_from, signed=self.is_signed(now.mono))
        if is_statement(heartbeat) and may_move(before) and not continues:
            mine.former_at = max(mine.former_at, counts_from)
        if _kind(heartbeat) != _kind(before) and may_move(before) and not may_move(heartbeat):
            mine.former_at = armed_at  # no vehicle becomes another one
        if mine.armed and not is_armed(before) and not continues and now.mono - armed_at <= HOLD:
            self.contradict("two counts of sequence numbers, armed and disarmed", mine.way, now)
        turns = self._turns.heard(heartbeat, now.mono, counted=continues and mine.counts)
        if turns is not None:
            self.contradict(f"{turns} in turn", mine.way, now)

    def contradict(self, why: str, way: Any, now: Instant) -> None:
        """Note evidence of a second autopilot, heard on this way."""
        current = self.conflict
        if current is None or now.mono - current.last > HOLD:
            self.news = current = Conflict(now, now.mono, why, (self.way, way))
        self.conflict = current._replace(last=now.mono)

    def verified(self, way: C, now: float) -> None:
        """Select the way of a frame whose signature proves that it is newer than all before."""
        if self.mine is None:
            return
        if not self.is_signed(now):
            self.others.clear()
            self.conflict = None
        self.verified_at = now
        if self.way is not way:
            self.way = self.mine.way = way
            self.broken = True

    def is_signed(self, now: float) -> bool:
        """Whether the vehicle signs its frames, so that no other frame may speak for it."""
        return now - self.verified_at <= SIGNED_LASTS

    def keep(self, stays: Callable[[C], bool]) -> None:
        """Forget the other ways. If no way is left, forget everything."""
        left = {key: claim for key, claim in self.others.items() if stays(claim.way)}
        if self.way is None or not stays(self.way):
            if not left:
                self.forget()
                return
            key = max(left, key=lambda key: left[key].at)
            said_at = max((c.doubt_at for c in (self.mine, *self.others.values()) if c is not None), default=NEVER)
            self.mine = left.pop(key)
            self.mine.former_at = max(self.mine.former_at, said_at)  # a way that is gone cannot take it back
            self.way, self.sequence, self.broken = self.mine.way, self.mine.sequence, True
        self.others = left

    # all other ways

    def elsewhere(
        self, heartbeat: Heartbeat, sequence: int, way: C, now: Instant, booted: float | None, timeout: float
    ) -> Outcome:
        """Process a heartbeat on a way that is not selected.

        `booted` is when the autopilot on the selected way booted, if known. `timeout` is the heartbeat timeout. After
        SELECTED and EXCHANGED, `heard` must get the same heartbeat.
        """
        at, mine = now.mono, self.mine
        if mine is None:
            return Outcome.SELECTED
        if self.is_signed(at):
            return Outcome.UNUSED
        claim = self.others.get(way)
        better = is_statement(mine.heartbeat) and not is_statement(heartbeat)
        if at - mine.at > SILENCE or better:
            other_clock = claim is not None and _are_apart(claim.booted, booted)
            other_kind = _kind(heartbeat) != _kind(mine.heartbeat)
            disarmed = not better and _disarms(heartbeat, mine.heartbeat)
            if not (other_clock or other_kind or disarmed) or at - mine.at > timeout:
                ran_before = claim is not None and claim.booted is not None and claim.booted < mine.at
                if disarmed and is_statement(heartbeat):
                    mine.armed_at = self._counts_from(heartbeat, at)
                self._select(way, mine, claim)
                return Outcome.EXCHANGED if other_kind or (other_clock and ran_before) else Outcome.SELECTED
        if not self._is_copy(heartbeat, sequence, at):
            self.claim(way, way, heartbeat, sequence, now)
        elif claim is not None:
            self._note_copy(claim, heartbeat, sequence, at)
        else:
            claim = self._remember(way, Claim(way, heartbeat, sequence, at))
            claim.copied, claim.armed_at = True, NEVER
        return Outcome.UNUSED

    def beside(self, statement: Heartbeat, sequence: int, way: C, now: Instant) -> None:
        """Process what a HIGH_LATENCY2 says while HEARTBEATs arrive on the selected way. It selects no way.

        On that way it is from the vehicle, unless it is of another kind, or says armed while the HEARTBEATs do not.
        """
        mine = self.mine
        if mine is None or self.is_signed(now.mono):
            return
        is_other = _kind(statement) != _kind(mine.heartbeat)
        if is_other:
            self.contradict("HIGH_LATENCY2.type and autopilot differ from HEARTBEAT", way, now)
        key = BESIDE, way
        agrees = may_move(mine.heartbeat) or not may_move(statement)
        if way is self.way and not is_other and agrees and key not in self.others:
            if may_move(statement):
                mine.armed_at = max(mine.armed_at, self._counts_from(statement, now.mono))
            return
        former = self.others.get(way)
        if former is not None and is_statement(former.heartbeat):  # from when its way was selected
            self.others[key] = self.others.pop(way)
        if key in self.others:
            self.others[key].follow(sequence)
        self.claim(key, way, statement, sequence, now)

    def claim(self, key: Hashable, way: Any, heartbeat: Heartbeat, sequence: int, now: Instant) -> None:
        """Note what another sender says. `key` identifies it: its way, or its ids if they are not these."""
        claim = self.others.get(key)
        counts_from = self._counts_from(heartbeat, now.mono)
        if claim is None:
            self._remember(key, Claim(way, heartbeat, sequence, now.mono, counts_from))
        else:
            claim.hear(heartbeat, sequence, now.mono, counts_from)
            claim.copied = False
        self._note(heartbeat, now.mono)
        if self.mine is not None and _stance(heartbeat) != _stance(self.mine.heartbeat):
            self.differed_at = now.mono
        self._compare(key, now)

    def follow(self, way: C, sequence: int) -> None:
        """Note the sequence number of a frame on a way that is not selected."""
        self.unused += 1
        claim = self.others.get(way)
        if claim is not None:
            claim.follow(sequence)

    def clock(self, way: C, other: float, booted: float | None, now: Instant) -> None:
        """Note that the autopilot on another way booted at `other`, and the one on the selected way at `booted`.

        After a reboot one way shows the new time before the other. So one sample proves nothing.
        """
        claim, mine = self.others.get(way), self.mine
        if claim is None or mine is None:
            return
        claim.booted = other
        if now.mono - mine.at > LIVE or not _are_apart(other, booted):
            self._proofs = 0
            return
        if self._proofs == 0:
            self._proofs_since = now.mono
        self._proofs += 1
        if self._proofs >= PROOFS and now.mono - self._proofs_since >= PROOF:
            self._proofs = 0
            self.contradict("clocks of two autopilots", way, now)

    def _select(self, way: C, before: Claim, claim: Claim | None) -> None:
        """Select another way, with all that was said on it. `heard` then gets the heartbeat that selects it."""
        self.others.pop(way, None)
        before.booted = None
        before.sequence, before.broken = self.sequence, self.broken
        self._note(before.heartbeat, before.at)
        self.differed_at = max(self.differed_at, before.at)
        self._remember(before.way, before)
        self.way, self.mine = way, claim
        if claim is not None:
            claim.copied = False
            self.sequence, self.broken = claim.sequence, claim.broken
        self._turns, self._apart_since, self._proofs = Turns(), None, 0
        self._copies.clear()

    def _remember(self, key: Hashable, claim: Claim) -> Claim:
        """Keep a claim. At the limit the oldest is dropped, the disarmed ones first."""
        if len(self.others) >= MOST_CLAIMS:
            del self.others[min(self.others, key=lambda key: (self.others[key].doubt_at, self.others[key].at))]
        self.others[key] = claim
        return claim

    def _is_copy(self, heartbeat: Heartbeat, sequence: int, at: float) -> bool:
        """Whether the same heartbeat arrived on the selected way not long ago: a router forwards it on both."""
        return any(
            number == sequence and message == heartbeat and at - when <= COPIES
            for number, message, when in self._copies
        )

    def _note_copy(self, claim: Claim, heartbeat: Heartbeat, sequence: int, at: float) -> None:
        """A copy says nothing new. A late one that says armed does not end what its way says of its own."""
        late = self.mine is not None and heartbeat != self.mine.heartbeat and is_armed(heartbeat)
        if not late or claim.copied:
            armed_at = claim.armed_at
            claim.hear(heartbeat, sequence, at)
            claim.copied, claim.armed_at = True, min(claim.armed_at, armed_at)

    def _counts_from(self, heartbeat: Heartbeat, at: float) -> float:
        """From when on a heartbeat counts for LIVE seconds: a statement of a HIGH_LATENCY2 counts until `lasts`."""
        return at + self.lasts - LIVE if is_statement(heartbeat) else at

    def _note(self, heartbeat: Heartbeat, at: float) -> None:
        """Note what another way says, or the selected one no longer says: it shows what all agree on in a conflict."""
        if is_armed(heartbeat) or not tells_armed(heartbeat):
            self.armed_at = max(self.armed_at, at)  # a way that is selected again may have said it long ago
        if not is_armed(heartbeat):
            self.disarmed_at = max(self.disarmed_at, at)

    def _compare(self, speaker: Hashable | None, now: Instant) -> None:
        """Compare the live claims with the selected way, after a heartbeat of `speaker` (None: the selected way)."""
        at, mine = now.mono, self.mine
        for key in [key for key, claim in self.others.items() if at - max(claim.at, claim.doubt_at) > HOLD]:
            del self.others[key]
        if mine is None or at - self._counts_from(mine.heartbeat, mine.at) > LIVE:
            return
        differing = None
        for key, claim in self.others.items():
            if claim.copied or at - claim.at > LIVE or is_statement(claim.heartbeat):
                continue
            moves = may_move(claim.heartbeat) != may_move(mine.heartbeat)
            if moves or (key == claim.way and _stance(claim.heartbeat) != _stance(mine.heartbeat)):
                differing = claim
                if key == claim.way == speaker and _kind(claim.heartbeat) != _kind(mine.heartbeat):
                    self.contradict("HEARTBEAT.type and autopilot differ", claim.way, now)
        if differing is None:
            self._apart_since = None
        elif self._apart_since is None:
            self._apart_since = at
        elif at - self._apart_since >= PERSISTS:
            self.contradict(f"{_difference(differing.heartbeat, mine.heartbeat)} at the same time", differing.way, now)


def _kind(heartbeat: Heartbeat) -> tuple[int, int]:
    """What no vehicle changes."""
    return heartbeat.autopilot, heartbeat.type


def _stance(heartbeat: Heartbeat) -> tuple[int, ...]:
    """What one vehicle says in the same way on all its ways."""
    return heartbeat.autopilot, heartbeat.type, heartbeat.base_mode, heartbeat.custom_mode


def _difference(one: Heartbeat, other: Heartbeat) -> str:
    """In what two senders differ."""
    if is_armed(one) != is_armed(other):
        return "armed and disarmed"
    return "two states" if may_move(one) != may_move(other) else "two modes"


def _disarms(heartbeat: Heartbeat, before: Heartbeat) -> bool:
    """Whether a heartbeat ends the claim that a vehicle can move, or that it may be armed."""
    if tells_armed(before):
        return may_move(before) and not may_move(heartbeat)
    return tells_armed(heartbeat) and not may_move(heartbeat)


def says_alike(one: Heartbeat, other: Heartbeat) -> bool:
    """Whether one vehicle may say both at the same time."""
    return _stance(one) == _stance(other)


def are_alike(one: float | None, other: float | None) -> bool:
    """Whether two boot times are known and may be those of one autopilot."""
    return one is not None and other is not None and abs(one - other) <= APART


def _are_apart(one: float | None, other: float | None) -> bool:
    return one is not None and other is not None and abs(one - other) > APART
