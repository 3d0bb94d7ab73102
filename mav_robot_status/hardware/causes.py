"""The causes of in_error: their numbers, their order, and how long one that a text announced stays.

A latch is set by a text (or an event) and has always a second way out beside the text that clears it, because texts get
lost. Numbers are stable: they are never reused, new ones are appended.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum
from typing import TYPE_CHECKING, Final, NamedTuple

from ..interface.status import ErrorCause
from ..mavlink.definitions import EXTENDED_SENSOR_NAMES, SENSOR_NAMES, SEVERITY_NAMES

if TYPE_CHECKING:
    from ..clock import Instant
    from .pulse import Pulse


class Clears(Enum):
    """The second way out of a latch."""

    FAILSAFE = "state not CRITICAL for 2 s, at the earliest 5 s after the text; or 5 s disarmed and not CRITICAL"
    HOLD = "a time without repetition"
    ARMING = "the next arming; an autopilot reboot"
    REBOOT = "an autopilot reboot"


class Cause(NamedTuple):
    """One row of the error table."""

    name: str
    priority: int
    """The lowest active one is published as error_code."""
    clears: Clears = Clears.REBOOT
    hold: float | None = None
    """Seconds after the last text."""
    worse: int | None = None
    """A code that this one never takes back to itself."""


FAILSAFE, HOLD, ARMING = Clears.FAILSAFE, Clears.HOLD, Clears.ARMING

CAUSES: Final[dict[int, Cause]] = {
    1001: Cause("FLIGHT_TERMINATION", 1),
    1002: Cause("TERMINATION_ANNOUNCED", 2),
    4001: Cause("CRASH", 3, ARMING),
    4006: Cause("ATTITUDE_FAILURE", 4, ARMING),
    4003: Cause("THRUST_LOSS", 5, ARMING, 30.0),
    4004: Cause("PARACHUTE", 6, ARMING),
    4002: Cause("HARD_LANDING", 7, ARMING),
    4000: Cause("EMERGENCY", 8),
    2010: Cause("LEAK", 9, HOLD, 45.0),
    2004: Cause("BATTERY_CRITICAL", 10, FAILSAFE),
    2005: Cause("ESTIMATOR", 11, FAILSAFE),
    2001: Cause("RC_LOST", 12, FAILSAFE),
    2002: Cause("GCS_LOST", 13, FAILSAFE),
    2003: Cause("BATTERY_LOW", 14, FAILSAFE, worse=2004),
    2006: Cause("TERRAIN", 15, FAILSAFE),
    2007: Cause("TRAFFIC", 16, FAILSAFE),
    2008: Cause("GPS", 17, HOLD, 60.0),
    2009: Cause("GEOFENCE", 18, HOLD, 30.0),
    2011: Cause("PRESSURE", 19, HOLD, 65.0),
    2012: Cause("TEMPERATURE", 20, HOLD, 65.0),
    2013: Cause("DEPTH_SENSOR", 21, HOLD, 30.0),
    4005: Cause("YAW_IMBALANCE", 22, ARMING, 30.0),
    5001: Cause("INTERNAL_ERROR", 23),
    5002: Cause("CONFIGURATION", 24, HOLD, 15.0),
    5003: Cause("WATCHDOG_RESET", 25, ARMING),
    5004: Cause("REBOOT_WHILE_ARMED", 26, ARMING),
    2000: Cause("FAILSAFE", 27),
    9002: Cause("SYSTEM_ID_CONFLICT", 28, HOLD, 10.0),
    9001: Cause("LINK_LOST", 29),
    **{3100 + bit: Cause(f"SENSOR_{EXTENDED_SENSOR_NAMES.get(bit, bit)}", 200 + bit) for bit in range(32)},
    **{3000 + bit: Cause(f"SENSOR_{SENSOR_NAMES[bit]}", 100 + bit) for bit in range(31)},
    **{6000 + level: Cause(f"TEXT_{SEVERITY_NAMES[level]}", 400 + level, HOLD) for level in range(3)},
    **{7000 + level: Cause(f"EVENT_{level}", 500 + level, HOLD, 10.0) for level in range(3)},
}

SOFT_AFTER: Final = 50  # a SOFT bit comes after every HARD one

TIMED_TEXTS: Final = frozenset({6000, 6001, 6002})  # held for `text_hold_s`
# State CRITICAL says that some failsafe is active; each of these says which.
NAMED_FAILSAFES: Final = frozenset({*range(2001, 2014), 3014, 3016, 3020, 3021, 3025, 5001})
# State EMERGENCY without one of these is 4000.
NAMED_EMERGENCIES: Final = frozenset(range(4001, 4007))


TERMINATING: Final = 1.5
"""Seconds after the announcement of a termination in which a heartbeat may still be one from before it."""


class Latch(NamedTuple):
    """A cause that was announced."""

    text: str | None
    since: Instant
    last: float
    """Monotonic seconds of the latest announcement."""
    source: str
    """What announced it: a message, with the text where it has one."""


Latches = Mapping[int, Latch]
NO_LATCHES: Final[Latches] = {}


def has_outlived_termination(latches: Latches, armed: bool, heard_at: float) -> bool:
    """Whether a heartbeat shows that what was announced as a termination is a landing under power.

    ArduPilot terminates by disarming in the same instant, or, if the site wants that (AFS_TERM_ACTION), by landing.
    """
    latch = latches.get(1002)
    return latch is not None and armed and heard_at > latch.since.mono + TERMINATING


def announce(latches: Latches, code: int, text: str | None, now: Instant, source: str | None = None) -> Latches:
    """`latches` after `code` was announced: with these words of the autopilot, or by another `source`."""
    worse = CAUSES[code].worse
    if worse is not None and worse in latches:
        code, text = worse, latches[worse].text
    before = latches.get(code)
    return {
        **latches,
        code: Latch(text, before.since if before else now, now.mono, source or f"STATUSTEXT: {text}"),
    }


def clear(latches: Latches, codes: tuple[int, ...]) -> Latches:
    """`latches` without `codes`."""
    return {code: latch for code, latch in latches.items() if code not in codes}


def lasting(latches: Latches, pulse: Pulse, now: float, text_hold: float) -> Latches:
    """The latches that time and the state of the vehicle have not ended at `now`."""
    if not latches:
        return latches
    return {code: latch for code, latch in latches.items() if now < ends_at(code, latch, pulse, text_hold)}


def ends_at(code: int, latch: Latch, pulse: Pulse, text_hold: float) -> float:
    """When (monotonic seconds) a latch ends if nothing more is heard; never is infinity."""
    cause = CAUSES[code]
    if cause.clears is Clears.FAILSAFE:
        if pulse.calm_since is None:
            return math.inf
        calm = pulse.calm_since + 2.0
        return max(latch.last + 5.0, calm if pulse.armed else min(calm, pulse.edge.mono + 5.0))
    hold = text_hold if code in TIMED_TEXTS else cause.hold
    return math.inf if hold is None else latch.last + hold


def error(code: int, text: str | None, since_us: int) -> ErrorCause:
    """A cause as it is published."""
    return ErrorCause(code, CAUSES[code].name, text, since_us)
