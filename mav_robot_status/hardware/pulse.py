"""The vehicle's heartbeats as edges: since when connected, armed, in this state; and what was so before a reboot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from .identity import ARMED

if TYPE_CHECKING:
    from ..clock import Instant
    from ..mavlink.definitions import Heartbeat

CRITICAL: Final = 5  # MAV_STATE
TERMINATED: Final = 8
RUNS: Final = 6
new: Final = tuple.__new__  # as in `framing`


class Run(NamedTuple):
    """Heartbeats in a row that were all armed, or all disarmed: first and last arrival."""

    armed: bool
    first: float
    last: float


class Pulse(NamedTuple):
    """What the heartbeats up to now say."""

    since: Instant
    """The first heartbeat of this connection; a gap longer than the time-out starts a new one."""
    armed: bool
    edge: Instant
    """Since when armed or disarmed as now: the edge, or the first heartbeat of the connection."""
    edge_seen: bool
    """Whether the edge itself was seen, rather than joined."""
    state: int
    state_since: Instant
    calm_since: float | None
    """Since when the state is not CRITICAL; None while it is."""
    runs: tuple[Run, ...]


def first_beat(heartbeat: Heartbeat, now: Instant) -> Pulse:
    """The pulse of a vehicle just heard for the first time."""
    armed = bool(heartbeat.base_mode & ARMED)
    state = heartbeat.system_status
    calm = None if state == CRITICAL else now.mono
    return Pulse(now, armed, now, False, state, now, calm, (Run(armed, now.mono, now.mono),))


def next_beat(pulse: Pulse, heartbeat: Heartbeat, now: Instant, connected: bool) -> Pulse:
    """The pulse after one more heartbeat; `connected` is false if the time-out had passed before it."""
    armed = bool(heartbeat.base_mode & ARMED)
    state = heartbeat.system_status
    last = pulse.runs[-1]
    if armed == last.armed:
        runs = (*pulse.runs[:-1], new(Run, (armed, last.first, now.mono)))
    else:
        runs = (*pulse.runs[-RUNS + 1 :], Run(armed, now.mono, now.mono))
    calm = pulse.calm_since if pulse.calm_since is not None else now.mono
    turned = armed != pulse.armed
    since = pulse.since if connected else now
    edge = now if turned or not connected else pulse.edge
    edge_seen = turned or (connected and pulse.edge_seen)
    state_since = now if state != pulse.state else pulse.state_since
    return new(Pulse, (since, armed, edge, edge_seen, state, state_since, None if state == CRITICAL else calm, runs))


def armed_before(pulse: Pulse, moment: float, longest: float) -> bool:
    """True if the last heartbeat before `moment` was armed and at most `longest` seconds older."""
    for run in reversed(pulse.runs):
        if run.first < moment:
            # a run that began before and went on after the moment was heard in between at an unknown time
            return run.armed and moment - min(run.last, moment) <= longest
    return False
