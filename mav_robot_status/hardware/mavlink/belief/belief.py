"""`Belief`: all speakers with the ids of one vehicle. `hear` gives each frame its speaker, verdict and time."""

from __future__ import annotations

import math
from enum import Enum
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ....mavlink import enumerations as mavlink
from ....mavlink.definitions import CRC_EXTRA
from ..armed import may_move
from .clock import NEAR, NOT_LATE, Change, Clock, turned
from .copies import PROOF, Copies, Original
from .counts import LATE_FOR, MAX_MISORDER, Count
from .speakers import DIFFERS, HOLD, Conflict, Said, Speaker, began_after, differ, has_booted, is_same_boot

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence

    from ....clock import Instant
    from ....mavlink.definitions import Heartbeat
    from ....mavlink.framing import Values

HEARTBEAT_ID: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
COUNTED_APART: Final = mavlink.MAVLINK_MSG_ID_MISSION_CURRENT
"""Betaflight counts its sequence numbers apart from those of all other messages (recorded)."""
CLOCKED: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_SYSTEM_TIME,
        mavlink.MAVLINK_MSG_ID_ATTITUDE,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    }
)
"""Messages with time_boot_ms."""
SAID_ONCE: Final = frozenset(
    {
        mavlink.MAVLINK_MSG_ID_STATUSTEXT,
        mavlink.MAVLINK_MSG_ID_EVENT,
        mavlink.MAVLINK_MSG_ID_CURRENT_EVENT_SEQUENCE,
        mavlink.MAVLINK_MSG_ID_RESPONSE_EVENT_ERROR,
        mavlink.MAVLINK_MSG_ID_COMMAND_ACK,
        mavlink.MAVLINK_MSG_ID_COMMAND_LONG,
        mavlink.MAVLINK_MSG_ID_COMMAND_INT,
        mavlink.MAVLINK_MSG_ID_PARAM_VALUE,
        mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
        mavlink.MAVLINK_MSG_ID_MESSAGE_INTERVAL,
        mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES,
        mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA,
        mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL,
    }
)
"""Events and answers: a late one counts although a newer one was used."""
SURE: Final = 0.1
"""Seconds after the next number by which a clock shows that a frame is not a late one of this count."""
JITTER: Final = 0.5
"""Seconds by which the time of a state may go back: two lags are never known exactly."""
SILENT: Final = 1.5
"""Seconds after which a count gives way to a more recent one on its channel that a frame continues, too.

More than the interval of HEARTBEATs: some senders send nothing else."""
MOST_SPEAKERS: Final = 12
MOST_NEW: Final = 2
"""New speakers on one channel that do not say armed. A further one takes the place of the first of them."""
FORGOTTEN: Final = 25.0
"""Seconds of silence after which a speaker is forgotten, unless it is the main one."""


class Verdict(Enum):
    """What a frame is."""

    NEWS = "news"
    LATE = "late"
    COPY = "copy"


class Heard(NamedTuple):
    """The result of `Belief.hear`."""

    verdict: Verdict
    speaker: Speaker | None = None
    """Who sent it; None: nobody is shown to be alive by it."""
    said: Instant | None = None
    """When it was said; None: it changes no state."""


class Joined(NamedTuple):
    """A new speaker was proven to be an older one."""

    speaker: Speaker
    kept: tuple[Said, ...]
    """What the new one said so far."""
    booted: float | None
    """When the vehicle booted, if the new one is its next boot."""


class Rebooted(NamedTuple):
    """The clock of a speaker began anew."""

    speaker: Speaker
    change: Change


COPY: Final = Heard(Verdict.COPY)


class Belief:
    """The speakers of one vehicle, most often one. Bounded for any number of senders."""

    def __init__(self) -> None:
        self.copied = 0
        """Frames that were copies."""
        self.forget()

    def forget(self) -> None:
        """Forget every speaker. The next one is believed as the first."""
        self.speakers: list[Speaker] = []
        self.main: Speaker | None = None
        """The speaker whose state is that of the vehicle while no other one claims the ids."""
        self.conflict: Conflict | None = None
        """The latest conflict between speakers. It ends HOLD after its `last`."""
        self.changes: list[Joined | Rebooted] = []
        """What `hear` has found beside its result. The owner takes it after each call."""
        self._on: dict[Hashable, list[Count]] = {}
        self._copies = Copies()
        self._differ_since: float | None = None

    # a frame

    def hear(self, frame: Values, channel: Hashable, now: Instant, lag: float = 0.0) -> Heard:
        """The verdict on a frame that arrived on `channel`. `lag`: how late it is by its signature, seconds."""
        message_id, _, sequence, message, raw, _ = frame
        at, key, counts = now.mono, hash(raw), self._on.get(channel, ())
        if message is None and message_id not in CRC_EXTRA:
            _fill(counts, sequence)
            return COPY
        original = self._copies.original(key, at)
        if original is not None and not self._is_said_anew(message_id, sequence, channel, original, counts, at):
            self._copy(channel, sequence, original, counts, at)
            if message_id == HEARTBEAT_ID:
                original.heard_in.speaker.claim_again(message, at)
            _fill(counts, sequence)
            return COPY
        clock = message.time_boot_ms / 1000 if message_id in CLOCKED and message is not None else None
        signed = lag if lag > NOT_LATE else 0.0
        count, place = self._count_of(message_id, sequence, clock, counts, now, signed)
        if count is None:
            beat = message if message_id == HEARTBEAT_ID else None
            count, place = self._begin(channel, sequence, clock, beat, counts, at), 1
        late = max(signed, self._lag(count, place, clock, at, signed))
        said = count.said_behind(-place, at - late) if place < 0 else max(at - late, count.last_said)
        self._note(count, place, key, at, said)
        speaker = count.speaker  # after a proof another one
        speaker.heard_at = max(speaker.heard_at, at)
        if _is_trusted(channel):
            speaker.trusted_at = at
        if message is None:
            return Heard(Verdict.LATE if place < 0 else Verdict.NEWS, speaker)
        if message_id not in SAID_ONCE and not _is_newest(speaker, message_id, said, 0.0 if place < 0 else JITTER):
            claims = message_id == HEARTBEAT_ID and speaker.claim_late(message, at)
            return Heard(Verdict.LATE, speaker if claims else None)
        speaker.said_at = max(speaker.said_at, said)
        when = now if said == at else now._replace(mono=said, unix_us=now.unix_us - round((at - said) * 1e6))
        if not speaker.proven or len(self.speakers) > 1 or at - speaker.since < DIFFERS:
            speaker.kept.append(Said(message_id, message, when))
        return Heard(Verdict.LATE if place < 0 else Verdict.NEWS, speaker, when)

    def _is_said_anew(
        self, message_id: int, sequence: int, channel: Hashable, original: Original, counts: Iterable[Count], now: float
    ) -> bool:
        if message_id in CLOCKED or message_id in SAID_ONCE:
            return False
        places = [place for count in counts if (place := count.place(sequence, now)) is not None and place > 0]
        return self._copies.is_said_anew(channel, sequence, original, min(places, default=None), now)

    def _copy(self, channel: Hashable, sequence: int, original: Original, counts: Iterable[Count], now: float) -> None:
        """Note a copy. PROOF of them on the channel of another speaker prove that it is the same."""
        self.copied += 1
        self._copies.copied(channel, sequence, original, now)
        known: Speaker = original.heard_in.speaker
        known.heard_on(channel, now)
        if original.heard_in.channel is channel or any(count.speaker is known for count in counts):
            return
        spoke = (count for count in counts if now - count.at <= LATE_FOR)
        nearest = min(spoke, key=lambda count: count.distance(sequence), default=None)
        if nearest is not None and nearest.distance(sequence) <= MAX_MISORDER and known in self.speakers:
            other: Speaker = nearest.speaker
            other.copies[known] = other.copies.get(known, 0) + 1
            if other.copies[known] >= PROOF:
                self._join(other, known, now, "the same frames")

    def _count_of(
        self, message_id: int, sequence: int, clock: float | None, counts: Sequence[Count], now: Instant, signed: float
    ) -> tuple[Count | None, int]:
        """The count that a frame continues best, and its place there: 0 if it is counted apart."""
        if message_id == COUNTED_APART and counts:
            _fill(counts, sequence)
            return max(counts, key=lambda count: count.at), 0
        best, place, refused = None, 0, None
        ordered = sorted(counts, key=lambda c: max(now.mono - c.at, SILENT)) if len(counts) > 1 else counts
        for count in ordered:
            found = count.place(sequence, now.mono)
            if found is None or (best is not None and (abs(found) >= abs(place) or now.mono - count.at > SILENT)):
                continue
            if count is not ordered[0] and now.mono - count.at > LATE_FOR:
                break  # another count took its place
            if signed and found > 0 and now.mono - signed < count.last_said - NEAR:
                continue  # by its signature it is older than the newest frame of that count
            if clock is not None and _contradicts(count, found, clock, now.mono):
                refused = count if refused is None and found > 0 else refused
                continue
            best, place = count, found
        if refused is not None:
            self._refuse(refused, best, sequence, now)
        return best, place

    def _refuse(self, refused: Count, best: Count | None, sequence: int, now: Instant) -> None:
        """Another clock ticks where the next frame of a count was due: two vehicles in one count, if that repeats."""
        speaker: Speaker = refused.speaker
        nearer = best is None or (refused.place(sequence, now.mono) or 0) < (best.place(sequence, now.mono) or 0)
        if nearer and speaker.clocks_alternate(now.mono):
            for one in {speaker} if best is None else {speaker, best.speaker}:
                one.contradict("time_boot_ms of two clocks in turn", now)

    def _begin(
        self,
        channel: Hashable,
        sequence: int,
        clock: float | None,
        beat: Heartbeat | None,
        counts: Sequence[Count],
        now: float,
    ) -> Count:
        """A count for a frame that continues none: of the speaker whose frames the channel repeats, or of a new one."""
        echo = self._copies.echoes.get(channel)
        new = [count.speaker for count in counts if not count.speaker.proven and not count.speaker.armed]
        if not counts and echo is not None and echo.repeats(sequence, now):
            count = Count(echo.heard_in.speaker, channel, sequence, now, echo.heard_in)
        elif counts and _is_sparse(counts, clock, beat, now):
            count = Count(counts[0].speaker, channel, sequence, now)
            count.lag = counts[0].lag
            self._break(count.speaker, list(counts), now)
        else:
            if len(new) >= MOST_NEW:
                self._drop(new[0])
            count = Count(self._new_speaker(channel, now), channel, sequence, now)
        count.speaker.counts.append(count)
        if count.speaker not in self.speakers:
            self.speakers.append(count.speaker)
        self._on.setdefault(channel, []).append(count)
        return count

    def _new_speaker(self, channel: Hashable, now: float) -> Speaker:
        speaker = Speaker(channel, now)
        if not self.speakers:
            speaker.proven, speaker.proof, self.main = True, "first heard", speaker
        elif len(self.speakers) >= MOST_SPEAKERS:
            others = (one for one in self.speakers if one is not self.main)
            self._drop(min(others, key=lambda one: (one.armed and one.state is not None, one.heard_at)))
        return speaker

    def _lag(self, count: Count, place: int, clock: float | None, at: float, signed: float) -> float:
        """How late a frame is by the clock of its speaker, seconds."""
        speaker: Speaker = count.speaker
        if place > 0 and clock is not None:
            change = speaker.clock.hear(clock, at, count.lag, signed)
            if change is not None:
                self.changes.append(Rebooted(speaker, change))
            self._prove(speaker, at)
            count.ticked_at = at - count.lag.seconds
            return count.lag.seconds
        echo = self._copies.echoes.get(count.channel) if count.source is not None else None
        if echo is not None and at - echo.at <= NEAR and echo.delay > NOT_LATE:
            return echo.delay  # what it brings is as late as its copies
        held = count.held_for(place, at) if place > 0 and speaker.clock.booted is not None else 0.0
        if held:
            count.lag.hold(held + (count.lag.seconds if count.lag.at <= count.at else 0.0), at)
        return count.lag.near(at)

    def _note(self, count: Count, place: int, key: int, at: float, said: float) -> None:
        speaker: Speaker = count.speaker
        if place > 0:
            lost_since = count.advance(place, at, said)
            if lost_since is not None:
                speaker.lost(lost_since)
        self._copies.remember(key, Original(at, count))
        speaker.heard_on(count.channel, at)

    # who is who

    def _prove(self, speaker: Speaker, now: float) -> None:
        """Join the speakers that the clock of this one proves to be one."""
        for other in self._main_first() if len(self.speakers) > 1 else ():
            if other is speaker:
                continue
            young, old = (speaker, other) if speaker.since >= other.since else (other, speaker)
            if is_same_boot(young, old, now):
                self._join(young, old, now, "the same boot time")
                return
            if young is speaker and has_booted(young, old, now):
                self._join(young, old, now, "booted, by its clock", young.clock.booted)
                return

    def starts(self, speaker: Speaker, says_so: Callable[[Speaker], bool], now: float) -> bool:
        """Join a new speaker that says that it starts to the silent one whose channel it is on. True if it did."""
        for old in self._main_first():
            if old is not speaker and old.kind == speaker.kind and speaker.follows(old) and says_so(old):
                self._join(speaker, old, now, "booted, as it says", starts=True)
                return True
        return False

    def _main_first(self) -> list[Speaker]:
        """The speakers: one that was the vehicle long ago is not the one that booted now."""
        return sorted(self.speakers, key=lambda one: one is not self.main)

    def _join(
        self, one: Speaker, other: Speaker, now: float, proof: str, booted: float | None = None, *, starts: bool = False
    ) -> None:
        """Two speakers are one. The elder keeps its state, and then gets what the younger said.

        `booted` or `starts`: the younger is its next boot, whose clock counts from now on.
        """
        young, old = (one, other) if one.since > other.since else (other, one)
        if booted is None and began_after(young, old):
            booted = young.clock.booted
        counts, young.counts = young.counts, []
        for count in counts:
            count.speaker = old
            broken = [c for c in old.counts if c.channel is count.channel and c.is_silent(count.began)]
            self._break(old, broken, now)
            old.counts.append(count)
        if starts or booted is not None:
            old.gaps.clear()
        if starts or booted is not None or old.clock.booted is None:
            old.clock = young.clock
        else:
            later = old.clock.adopt(young.clock)
            for count in counts:
                count.lag.shift(later)
        old.proven, old.proof = True, proof
        old.heard_at = max(old.heard_at, young.heard_at)
        old.trusted_at = max(old.trusted_at, young.trusted_at)
        self.speakers.remove(young)
        if young is self.main:
            self.main = old
        old.kept.extend(young.kept)  # it may itself be proven to be another one
        self.changes.append(Joined(old, tuple(young.kept), booted))

    def _break(self, speaker: Speaker, counts: Iterable[Count], now: float) -> None:
        """The counts of a speaker broke: frames are lost since."""
        for count in counts:
            speaker.lost(count.at)
            speaker.gaps.append(now)
            self._drop_count(count)

    def _drop_count(self, count: Count) -> None:
        count.speaker.counts.remove(count)
        left = [other for other in self._on.get(count.channel, ()) if other is not count]
        if left:
            self._on[count.channel] = left
        else:
            self._on.pop(count.channel, None)  # it is gone already if the channel has a new connection

    def _drop(self, speaker: Speaker) -> None:
        for count in list(speaker.counts):
            self._drop_count(count)
        self.speakers.remove(speaker)

    def choose(self, is_connected: Callable[[Speaker], bool], now: float, timeout: float) -> Speaker | None:
        """The main speaker: it stays while it is connected. One that is heard on a trusted link goes first.

        One that sends HEARTBEATs goes before one that does not.
        """
        main = self.main
        alive = [one for one in self.speakers if one.counts and one.state is not None and is_connected(one)]
        if main is not None and main.armed and main not in alive and now - main.heard_at <= FORGOTTEN:
            alive = [one for one in alive if one.armed or not (one.is_stated and one.beats)]
        heard = [one for one in alive if now - one.trusted_at <= timeout] or alive
        heard = [one for one in heard if not one.is_stated] or heard
        silent = [one for one in heard if not one.beats]
        if main not in heard and heard:
            self.main = main = min(heard, key=lambda one: one.since)
            main.proven, main.proof = True, "heard when the one before was lost"
        elif main in silent:  # what never says armed or disarmed may come from a new port each time: by satellite
            self.main = main = max(silent, key=lambda one: one.heard_at)
        for one in self.speakers[:]:
            if one is not main and now - one.heard_at > FORGOTTEN:
                self._drop(one)
        return main

    def rivals(self, now: float, timeout: float) -> list[Speaker]:
        """The other speakers that claim the ids now."""
        main = self.main
        if len(self.speakers) < 2 or main is None:
            return []
        trusts = now - main.trusted_at <= timeout
        others = (one for one in self.speakers if one is not main and one.state is not None)
        return [one for one in others if now <= one.stands_until and not (trusts and one.trusted_at < main.since)]

    def compare(self, rivals: Iterable[Speaker], now: Instant) -> tuple[Conflict | None, float]:
        """The conflict that lasts, and when (monotonic seconds) that may change."""
        main, at = self.main, now.mono
        found = ((one, differ(one, main)) for one in rivals if main is not None and main.heard_at > one.since)
        rival, why = next(((one, why) for one, why in found if why is not None), (None, None))
        due = math.inf
        if why is None:
            self._differ_since = None
        elif self._differ_since is None:
            self._differ_since = at
        if why is not None and rival is not None and self._differ_since is not None:
            if at - self._differ_since >= DIFFERS:
                begun = self.conflict is None or at - self.conflict.last > HOLD
                self.conflict = Conflict(
                    now if begun or self.conflict is None else self.conflict.since, rival.beats[-1], why
                )
            else:
                due = self._differ_since + DIFFERS
        if self.conflict is None or at - self.conflict.last > HOLD:
            return None, due
        return self.conflict, due

    def mixed(self, speakers: Iterable[Speaker], now: float) -> Conflict | None:
        """The conflict of two vehicles that cannot be told apart, if one of these speakers is both."""
        found = (one.conflict for one in speakers if one.conflict is not None and now - one.conflict.last <= HOLD)
        return next(found, None)

    @staticmethod
    def ends(conflict: Conflict) -> float:
        """When (monotonic seconds) a conflict ends without further evidence."""
        return math.nextafter(conflict.last + HOLD, math.inf)

    # channels

    @property
    def channel(self) -> Any:
        """Where the vehicle is best reached; None if it was not heard."""
        return None if self.main is None or self.main.state is None else self.main.channel

    def hears(self, channel: Hashable) -> bool:
        """Whether the main speaker is heard there."""
        return self.main is not None and any(count.channel is channel for count in self.main.counts)

    def channels(self, since: float) -> Iterator[Any]:
        """The channels on which somebody spoke since a time."""
        return (channel for channel, counts in self._on.items() if any(count.at >= since for count in counts))

    def keep(self, stays: Callable[[Any], bool]) -> None:
        """Forget the channels that are gone. What was said once there is in doubt. Without a channel, forget all.

        What was said armed there still claims the ids.
        """
        for channel in [channel for channel in self._on if not stays(channel)]:
            for count in list(self._on[channel]):
                count.speaker.lost(count.at)
                self._drop_count(count)
        self._copies.echoes = {c: echo for c, echo in self._copies.echoes.items() if stays(c)}
        heard = [one for one in self.speakers if one.counts]
        self.speakers = [one for one in self.speakers if one.counts or one.armed]
        if self.main not in heard:
            self.main = heard[0] if heard else None
        for speaker in heard:
            if not stays(speaker.channel):
                speaker.channel = speaker.counts[0].channel

    def reconnected(self, channels: Callable[[Any], bool]) -> None:
        """These channels have new connections: their counts begin anew, and what was said once is in doubt."""
        for channel in [channel for channel in self._on if channels(channel)]:
            for count in self._on[channel]:
                count.speaker.lost(count.at)
            self._on.pop(channel)
            self._copies.echoes.pop(channel, None)


def _fill(counts: Iterable[Count], sequence: int) -> None:
    """A number is used, by a frame that says nothing: of an unknown message, a copy, or one that is counted apart."""
    for count in counts:
        count.fill(sequence)


def _is_newest(speaker: Speaker, message_id: int, said: float, jitter: float) -> bool:
    """Whether a state is the newest of its kind, which is then noted."""
    newest = speaker.newest.get(message_id, -math.inf)
    if said > newest:
        speaker.newest[message_id] = said
    return said >= newest - jitter


def _contradicts(count: Count, place: int, clock: float, now: float) -> bool:
    """Whether a clock is not that of a count whose own clock was heard lately.

    A frame ahead of the count was not said before the newest one, and a frame behind it not after the next number.
    """
    known: Clock = count.speaker.clock
    if known.booted is None:
        return False
    said = now - max(0.0, turned(now - clock - known.booted))
    if place < 0:
        following = count.said_after(-place)
        return not following - LATE_FOR <= said <= following + SURE
    return said < count.ticked_at - LATE_FOR or (now - known.heard_at <= NEAR and not known.fits(clock, now))


def _is_sparse(counts: Sequence[Count], clock: float | None, beat: Heartbeat | None, now: float) -> bool:
    """Whether a frame that continues no count is one more gap in that of the only speaker of the channel."""
    speaker: Speaker = counts[0].speaker
    alone = all(count.speaker is speaker for count in counts)
    if beat is not None and speaker.armed is not may_move(beat):
        return False  # a second vehicle would say so, too
    return alone and speaker.is_sparse(now) and (clock is None or speaker.clock.fits(clock, now))


def _is_trusted(channel: Any) -> bool:
    return getattr(channel, "trusted", False) is True
