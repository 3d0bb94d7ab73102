"""e_stopped: the evidence for an emergency stop, and against one, by autopilot.

On ArduPilot an e-stop by RC switch or command changes neither HEARTBEAT nor, while armed, SYS_STATUS. Without other
evidence an armed vehicle is UNKNOWN. PX4 shows every stop as state FLIGHT_TERMINATION; versions before 1.12
only send texts. A vehicle with a known older version (AUTOPILOT_VERSION) and without such a text is UNKNOWN.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import TriState
from .sensors import readiness, safety_switch_on

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ....clock import Instant
    from ....mavlink.definitions import SysStatus
    from ..autopilots import Autopilot
    from .heartbeat_history import HeartbeatHistory

ARM_EMERGENCY_STOP: Final = 165
"""RCn_OPTION of a switch that stops in its low position, where it is parked: the pre-arm checks ignore that stop."""
SETTLING: Final = 2.0
"""Seconds after a disarm, a connection or a report of the stop before a healthy PREARM_CHECK bit is used: ArduPilot
recomputes it once a second, and forces it healthy while armed."""
READY_MESSAGES: Final = 2
REPEATED: Final = 35.0
"""Seconds after which a PreArm text that is no longer repeated (every 30 s) is over."""


class Stop(NamedTuple):
    """The stop according to texts and to the pre-arm check that includes it."""

    said: TriState = TriState.UNKNOWN
    """TRUE engaged, FALSE released, UNKNOWN not reported."""
    text: str | None = None
    """The text of the autopilot, if it was a text."""
    source: str = ""
    """The message that reported it, with its text if it has one."""
    since: Instant | None = None
    last: float = 0.0
    repeats: bool = False
    """Whether ArduPilot repeats the text while the stop lasts."""
    ready: int = 0
    """Healthy SYS_STATUS in a row while disarmed."""
    ready_at: float = 0.0


NOTHING: Final = Stop()


def said(stop: Stop, engaged: bool, text: str | None, now: Instant, source: str | None = None) -> Stop:
    """`stop` after a report that an emergency stop is engaged or released: in a text, or by another `source`."""
    value = TriState.TRUE if engaged else TriState.FALSE
    return Stop(
        said=value,
        text=text,
        source=source or f"STATUSTEXT: {text}",
        since=stop.since if stop.said is value else now,
        last=now.mono,
        repeats=engaged and text is not None and "Emergency Stopped" in text,
        ready=0 if engaged else stop.ready,
        ready_at=stop.ready_at,
    )


def heard_sys_status(
    stop: Stop, status: SysStatus, heartbeats: HeartbeatHistory, profile: Autopilot, now: float
) -> Stop:
    """`stop` after one more SYS_STATUS: two ready ones in a row, some time after the disarm, clear the texts."""
    if (
        not profile.stops.ready_means_free
        or heartbeats.armed
        or safety_switch_on(status)
        or readiness(status, profile) is not TriState.TRUE
        or now - max(heartbeats.edge.mono, stop.last) < SETTLING
    ):
        return stop._replace(ready=0) if stop.ready else stop
    ready = stop.ready + 1
    if ready >= READY_MESSAGES:
        return Stop(ready=ready, ready_at=now)
    return stop._replace(ready=ready, ready_at=now)


def is_excused(switches: Mapping[int, int]) -> bool:
    """Whether the pre-arm checks may pass although the motors are stopped: by `switches`, RCn_OPTION by channel."""
    return ARM_EMERGENCY_STOP in switches.values()


def still_said(stop: Stop, now: float) -> TriState:
    """The stop according to the texts at `now`."""
    if stop.repeats and now >= stop.last + REPEATED:
        return TriState.UNKNOWN
    return stop.said
