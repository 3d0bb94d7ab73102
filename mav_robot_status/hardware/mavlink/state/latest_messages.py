"""The latest messages of one vehicle, and when they arrived. Times are seconds on the monotonic clock of arrival.

Records that each message changes in place, because this runs for every message, many times a second.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from collections.abc import Iterator

FRESH: Final = 2.5  # seconds, or three measured intervals
LONGEST_INTERVALS = 10.0  # seconds: limit for three intervals of a slow stream
SILENCE = 2.0
"""Seconds of silence after which the next message of its kind may turn stale data fresh again."""
REMEMBERED = 6  # arrivals, hence five intervals


@dataclass(slots=True)
class Heard:
    """The latest message of one kind and the arrivals before it."""

    message: Any
    at: float
    times: deque[float]
    """The last arrivals, this one included."""
    since: float
    """The first arrival after the last SILENCE."""


def heard(latest: LatestMessages, message: Any, at: float, before: Heard | None) -> Heard:
    """`message`, received at `at` after `before`. Changes and returns `before` if it exists.

    The first one, and the first after a SILENCE, unsettle the facts.
    """
    if before is None:
        latest.unsettled = True
        return Heard(message, at, deque((at,), REMEMBERED), at)
    if at - before.at > SILENCE:
        before.since = at
        latest.unsettled = True
    before.message = message
    before.at = at
    before.times.append(at)
    return before


def is_fresh(what: Heard | None, now: float, least: float) -> bool:
    """True while `what` is not older than `least` seconds, or than three measured intervals if that is longer."""
    if what is None:
        return False
    return now <= what.at + least or now <= slowly_fresh_until(what)


def slowly_fresh_until(what: Heard) -> float:
    """The time until which a message of a slow stream is fresh: three of its intervals, at most LONGEST_INTERVALS."""
    return what.at + min(3 * interval(what), LONGEST_INTERVALS)


def interval(what: Heard) -> float:
    """The median of the last intervals in seconds; 0 without intervals."""
    times = what.times
    if len(times) < 2:
        return 0.0
    gaps = sorted(b - a for a, b in pairwise(times))
    return gaps[len(gaps) // 2]


@dataclass(slots=True)
class LatestMessages:
    """The latest message of each kind that a status needs; None until it arrives."""

    heartbeat: Heard | None = None
    sys_status: Heard | None = None
    extended_sys_state: Heard | None = None
    global_position: Heard | None = None
    local_position: Heard | None = None
    vfr_hud: Heard | None = None
    gps: Heard | None = None
    """GPS_RAW_INT with a fix and a speed."""
    attitude: Heard | None = None
    current_mode: Heard | None = None
    esc: Heard | None = None
    """The latest ESC telemetry that showed a turning motor."""
    unsettled: bool = True
    """Whether a fact outside the row of the message in `MOVES` may have changed."""

    def __iter__(self) -> Iterator[Heard | None]:
        """All of them."""
        return iter(_ALL(self))


_ALL = attrgetter(*(name for name in LatestMessages.__slots__ if name != "unsettled"))
