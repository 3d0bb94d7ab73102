"""Latched causes: how long a cause from a text stays active.

A text or an event sets a latch. Each latch also ends without the text that clears it, because texts get lost.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from .causes import CAUSES, EVENTS, TERMINATION_ANNOUNCED, TIMED_TEXTS, Clears

if TYPE_CHECKING:
    from ....clock import Instant
    from ..heartbeat.state import HeartbeatHistory

TERMINATING: Final = 1.5
"""Seconds after the announcement of a termination in which a heartbeat may be older than the termination."""


TOGETHER: Final = 2.0
"""Seconds by which an event may precede the state CRITICAL of the same failsafe: the HEARTBEAT follows it."""
CLEARED: Final = 1.5
"""Seconds after a text that ends a failsafe in which a HEARTBEAT may be older than that end."""


class Latch(NamedTuple):
    """An announced cause."""

    text: str | None
    since: Instant
    last: float
    """Monotonic seconds of the latest announcement."""
    source: str
    """The message that announced it, with its text if it has one."""


Latches = Mapping[int, Latch]
NO_LATCHES: Final[Latches] = {}


def has_outlived_termination(latches: Latches, armed: bool, heard_at: float) -> bool:
    """Whether a heartbeat shows that the announced termination is a landing under power.

    ArduPilot terminates by disarming in the same instant, or by landing, if AFS_TERM_ACTION is set to that.
    """
    latch = latches.get(TERMINATION_ANNOUNCED)
    return latch is not None and armed and heard_at > latch.since.mono + TERMINATING


def announce(latches: Latches, code: int, text: str | None, now: Instant, source: str | None = None) -> Latches:
    """`latches` after `code` was announced: with this text of the autopilot, or by another `source`."""
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


def calmed(latches: Latches, critical_since: float) -> Latches:
    """`latches` after a state CRITICAL has ended: the failsafe that events have announced with it ends too."""
    return {
        code: latch for code, latch in latches.items() if code not in EVENTS or latch.last < critical_since - TOGETHER
    }


def lasting(
    latches: Latches, heartbeats: HeartbeatHistory, errors: Collection[int], now: float, text_hold: float
) -> Latches:
    """The latches that are still active at `now`, by time and by the state of the vehicle."""
    if not latches:
        return latches
    return {code: latch for code, latch in latches.items() if now < ends_at(code, latch, heartbeats, errors, text_hold)}


def ends_at(code: int, latch: Latch, heartbeats: HeartbeatHistory, errors: Collection[int], text_hold: float) -> float:
    """When (monotonic seconds) a latch ends without further messages; inf: never.

    `errors` are the bits of SYS_STATUS that are errors: a latch does not end before the bit of its condition, whose
    code would be less exact.
    """
    cause = CAUSES[code]
    if cause.shown_by in errors:
        return math.inf
    if cause.clears is Clears.FAILSAFE:
        if heartbeats.calm_since is None:
            return math.inf
        calm = heartbeats.calm_since + 2.0
        return max(latch.last + 5.0, calm if heartbeats.armed else min(calm, heartbeats.edge.mono + 5.0))
    hold = text_hold if code in TIMED_TEXTS else cause.hold
    return math.inf if hold is None else latch.last + hold
