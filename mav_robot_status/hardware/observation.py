"""What was heard from one vehicle, and when: a value that each message replaces.

Times are seconds on the monotonic clock of arrival.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

LONGEST_INTERVALS = 10.0  # seconds: three intervals of a slow stream count for at most this long
SILENCE = 2.0
"""Seconds after which the next message of its kind may make fresh again what had become too old."""
REMEMBERED = 6  # arrivals, hence five intervals


class Heard(NamedTuple):
    """The latest message of one kind and the arrivals before it."""

    message: Any
    at: float
    times: tuple[float, ...]
    """The last arrivals, this one included."""
    since: float
    """Since when it is heard without a SILENCE."""


def heard(message: Any, at: float, before: Heard | None) -> Heard:
    """`message`, heard at `at` after `before`."""
    if before is None:
        return Heard(message, at, (at,), at)
    times = before.times
    times = (*(times if len(times) < REMEMBERED else times[1:]), at)
    return Heard(message, at, times, at if at - before.at > SILENCE else before.since)


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


class Observation(NamedTuple):
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
