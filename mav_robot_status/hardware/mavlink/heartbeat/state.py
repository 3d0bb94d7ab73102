"""The edges in the vehicle's heartbeats: when it connected, was armed and entered its state; also before a reboot."""

from __future__ import annotations

from math import inf
from typing import TYPE_CHECKING, Final, NamedTuple

from ....mavlink.enumerations import MAV_MODE_FLAG_SAFETY_ARMED, MAV_STATE_CRITICAL

if TYPE_CHECKING:
    from ....clock import Instant
    from ....mavlink.definitions import Heartbeat

RUNS: Final = 6


class Run(NamedTuple):
    """Heartbeats in a row that were all armed, or all disarmed: first and last arrival."""

    armed: bool
    first: float
    last: float
    missed_at: float = inf
    """When other frames went on although the last one was older than the time-out. inf: they did not."""


class HeartbeatHistory(NamedTuple):
    """The summary of all heartbeats so far."""

    since: Instant
    """The first heartbeat of this connection; a gap longer than the time-out starts a new one."""
    armed: bool
    edge: Instant
    """When it was last armed or disarmed: the edge, or the first heartbeat of the connection."""
    edge_seen: bool
    """Whether the edge was received. False: it was before the connection."""
    state: int
    state_since: Instant
    calm_since: float | None
    """When the state stopped being CRITICAL; None while it is."""
    runs: tuple[Run, ...]


def first_heartbeat(heartbeat: Heartbeat, now: Instant) -> HeartbeatHistory:
    """The history after the first heartbeat of a vehicle."""
    armed = bool(heartbeat.base_mode & MAV_MODE_FLAG_SAFETY_ARMED)
    state = heartbeat.system_status
    calm = None if state == MAV_STATE_CRITICAL else now.mono
    return HeartbeatHistory(now, armed, now, False, state, now, calm, (Run(armed, now.mono, now.mono),))


def next_heartbeat(
    heartbeats: HeartbeatHistory, heartbeat: Heartbeat, now: Instant, connected: bool
) -> HeartbeatHistory:
    """The history after one more heartbeat; `connected` is false if the time-out had passed before it."""
    armed = bool(heartbeat.base_mode & MAV_MODE_FLAG_SAFETY_ARMED)
    state = heartbeat.system_status
    last = heartbeats.runs[-1]
    if armed == last.armed:
        runs = (*heartbeats.runs[:-1], Run(armed, last.first, now.mono))
    else:
        runs = (*heartbeats.runs[-RUNS + 1 :], Run(armed, now.mono, now.mono))
    calm = heartbeats.calm_since if heartbeats.calm_since is not None else now.mono
    turned = armed != heartbeats.armed
    since = heartbeats.since if connected else now
    edge = now if turned or not connected else heartbeats.edge
    edge_seen = turned or (connected and heartbeats.edge_seen)
    state_since = now if state != heartbeats.state else heartbeats.state_since
    return HeartbeatHistory(
        since, armed, edge, edge_seen, state, state_since, None if state == MAV_STATE_CRITICAL else calm, runs
    )


def missed(heartbeats: HeartbeatHistory, now: float) -> HeartbeatHistory:
    """The history after a frame that shows that heartbeats were lost: since then it may have been disarmed."""
    last = heartbeats.runs[-1]
    if last.missed_at <= now:
        return heartbeats
    return heartbeats._replace(runs=(*heartbeats.runs[:-1], last._replace(missed_at=now)))


def armed_before(heartbeats: HeartbeatHistory, moment: float, longest: float) -> bool:
    """True if the last heartbeat before `moment` was armed, at most `longest` seconds older, and none was missed."""
    for run in reversed(heartbeats.runs):
        if run.first < moment:
            # a run that spans the moment has a heartbeat before it at an unknown time
            return run.armed and moment - min(run.last, moment) <= longest and run.missed_at >= moment
    return False
