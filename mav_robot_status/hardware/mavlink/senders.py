"""The senders that speak as a vehicle, for a person: where each is heard, and how it is known to be the vehicle."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ...mavlink.definitions import TYPE_NAMES
from .armed import is_armed
from .belief.speakers import HOLD, differ
from .identity import named
from .satellite.state import tells_armed

if TYPE_CHECKING:
    from collections.abc import Iterable

    from .belief import Belief, Speaker
    from .state import VehicleState

STRANGER: Final = 3.0
"""Seconds after which a speaker that is not proven to be the vehicle is told. A boot is proven sooner."""
LATE: Final = 3.0
"""Seconds of lag that are told."""


class Sender(NamedTuple):
    """One sender with the ids of a vehicle that sent a HEARTBEAT."""

    address: str
    """Where it is heard best: `10.1.2.3:14550, listening on 0.0.0.0:14550/udp`; "the link" if it is not known."""
    counts: int
    """How many counts of sequence numbers it has: one for each channel, or more behind a router."""
    lag: float
    """How late it is heard, seconds; 0 if it is not late."""
    proof: str
    """How it is known to be the vehicle: "first heard", "the same frames", "not proven", ..."""
    type: str
    """MAV_TYPE without prefix."""
    armed: bool | None
    """None: it does not say."""
    claims: float
    """Seconds for which it still claims the ids; 0 if it does not."""

    @property
    def words(self) -> str:
        """All of it in one line."""
        armed = {True: "armed", False: "disarmed", None: "armed or not is unknown"}[self.armed]
        counts = f"{self.counts} count{'' if self.counts == 1 else 's'} of sequence numbers"
        late = f", {self.lag:.1f} s late" if self.lag else ""
        claims = f"claims the ids for {self.claims:.1f} s" if self.claims else "claims nothing"
        return f"{self.address}: {self.type}, {armed}, {counts}{late}, {self.proof}, {claims}"


class Strangers(NamedTuple):
    """Two senders speak as one vehicle."""

    who: str
    """Who they are, and in what they differ if that is known."""
    mine: str | None
    """The connection that hears only the main one; None where a connection cannot name it."""


def senders(belief: Belief, now: float) -> tuple[Sender, ...]:
    """The senders of one vehicle, the main one first. Empty if there is only one, and it is not late."""
    speakers = sorted(
        (one for one in belief.speakers if one.state is not None), key=lambda one: (one is not belief.main, one.since)
    )
    found = tuple(_sender(one, now) for one in speakers)
    return found if len(found) > 1 or any(one.lag for one in found) else ()


def _sender(speaker: Speaker, now: float) -> Sender:
    state: VehicleState | None = speaker.state
    beat = None if state is None or state.latest.heartbeat is None else state.latest.heartbeat.message
    return Sender(
        "the link" if speaker.channel is None else str(speaker.channel),
        len(speaker.counts),
        round(speaker.lag, 3),
        speaker.proof,
        named(TYPE_NAMES, 0 if speaker.kind is None else speaker.kind[1]),
        is_armed(beat) if beat is not None and tells_armed(beat) else None,
        round(max(0.0, speaker.stands_until - now), 3),
    )


def stranger(main: Speaker, rivals: Iterable[Speaker], now: float) -> Strangers | None:
    """Another sender that claims the ids beside the main one, if it is none that a boot or a gap explains."""
    other = next((one for one in rivals if one.kind != main.kind or now - one.since >= STRANGER), None)
    if other is None or main.heard_at <= other.since or other.heard_at < main.since:  # one after the other
        return None
    one, two = (getattr(s.channel, "address", None) or str(s.channel or "the link") for s in (main, other))
    who = f"two on {one}" if one == two else f"{one} and {two}"
    why = differ(other, main)
    mine, theirs = (getattr(s.channel, "named", None) for s in (main, other))
    return Strangers(f"{who} ({why})" if why else who, mine if mine != theirs else None)


def strangers(belief: Belief, now: float, timeout: float) -> Strangers | None:
    """The two senders that speak as one vehicle now, or, in a log, the latest two that did."""
    main = belief.main
    if main is None:
        return None
    found = stranger(main, belief.rivals(now, timeout), now)
    if found is not None:
        return found
    conflicts = (belief.conflict, *(one.conflict for one in belief.speakers))
    latest = max((one for one in conflicts if one is not None), key=lambda one: one.last, default=None)
    if latest is None:
        return None
    past = "" if now - latest.last <= HOLD else f", until {now - latest.last:.0f} s ago"
    return Strangers(f"{latest.why}{past}", None)
