"""What was heard from one vehicle, and when. Times are seconds on the monotonic clock of arrival.

No values but records, which each message changes in place: it happens for every message, many times a second.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from operator import attrgetter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

LONGEST_INTERVALS = 10.0  # seconds: three intervals of a slow stream count for at most this long
SILENCE = 2.0
"""Seconds after which the next message of its kind may make fresh again what had become too old."""
REMEMBERED = 6  # arrivals, hence five intervals


@dataclass(slots=True)
class Heard:
    """The latest message of one kind and the arrivals before it."""

    message: Any
    at: float
    times: deque[float]
    """The last arrivals, this one included."""
    since: float
    """Since when it is heard without a SILENCE."""


def heard(message: Any, at: float, before: Heard | None) -> Heard:
    """`message`, heard at `at` after `before`, which is changed and returned if there is one."""
    if before is None:
        return Heard(message, at, deque((at,), REMEMBERED), at)
    if at - before.at > SILENCE:
        before.since = at
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
    """Until when a slow stream's message counts: three of its intervals, at most LONGEST_INTERVALS."""
    return what.at + min(3 * interval(what), LONGEST_INTERVALS)


def interval(what: Heard) -> float:
    """The median of the last intervals in seconds; 0 while there is none."""
    times = what.times
    if len(times) < 2:
        return 0.0
    gaps = sorted(b - a for a, b in pairwise(times))
    return gaps[len(gaps) // 2]


@dataclass(slots=True)
class Observation:
    """The latest message of each kind that a status is derived from; None until heard."""

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

    def __iter__(self) -> Iterator[Heard | None]:
        """All of them."""
        return iter(_ALL(self))


_ALL = attrgetter(*Observation.__slots__)
