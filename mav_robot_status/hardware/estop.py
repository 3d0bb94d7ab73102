"""e_stopped: what shows an emergency stop, by autopilot, and what shows that there is none.

On ArduPilot an e-stop by RC switch or command changes neither HEARTBEAT nor, while armed, SYS_STATUS: an armed vehicle
of which nothing more is heard is UNKNOWN. PX4 shows every stop as state FLIGHT_TERMINATION; before 1.12 it did not, and
only said so: one that is known to be older (AUTOPILOT_VERSION) and says nothing is UNKNOWN.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ..interface.status import TriState
from .identity import ARDUPILOT, Family, Stack
from .sensors import is_ready, safety_switch_on

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..clock import Instant
    from ..mavlink.definitions import SysStatus
    from .pulse import Pulse

HONOURED_BY: Final = frozenset({Family.COPTER, Family.PLANE, Family.ROVER})
"""The ArduPilot vehicles whose motors an e-stop by switch or command stops. ArduSub 4.5.6 was recorded accepting the
command and driving on, and the others were never seen with one."""
ARM_EMERGENCY_STOP: Final = 165
"""RCn_OPTION of a switch that stops in its low position, where it is parked: the pre-arm checks excuse that stop."""
PX4_SHOWS: Final = 1, 12
"""The first version of PX4 whose state shows a kill (PX4-Autopilot pull request 17709); the ones before only say so."""
SETTLING: Final = 2.0
"""Seconds after a disarm, a connection or a word on the stop before a healthy PREARM_CHECK bit says anything: it is
recomputed once a second, and forced healthy while armed."""
READY_MESSAGES: Final = 2
REPEATED: Final = 35.0
"""Seconds after which a PreArm text that is no longer repeated (every 30 s) is over."""


class Stop(NamedTuple):
    """What texts, and the pre-arm check that includes the stop, have said."""

    said: TriState = TriState.UNKNOWN
    """TRUE engaged, FALSE released, UNKNOWN nothing said."""
    text: str | None = None
    """The autopilot's words, if it was a text."""
    source: str = ""
    """What said so: a message, with the text where it has one."""
    since: Instant | None = None
    last: float = 0.0
    repeats: bool = False
    """Whether the text is one that ArduPilot repeats while it is so."""
    ready: int = 0
    """Healthy SYS_STATUS in a row while disarmed."""
    ready_at: float = 0.0


NOTHING: Final = Stop()


def said(stop: Stop, engaged: bool, text: str | None, now: Instant, source: str | None = None) -> Stop:
    """`stop` after it was said that an emergency stop is engaged or released: in a text, or by another `source`."""
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


def heard_sys_status(stop: Stop, status: SysStatus, pulse: Pulse, stack: Stack, now: float) -> Stop:
    """`stop` after one more SYS_STATUS: two in a row that are ready, well after the disarm, end what texts said."""
    if (
        stack is not ARDUPILOT
        or pulse.armed
        or safety_switch_on(status)
        or not is_ready(status, stack)
        or now - max(pulse.edge.mono, stop.last) < SETTLING
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
    """What the texts say at `now`."""
    if stop.repeats and now >= stop.last + REPEATED:
        return TriState.UNKNOWN
    return stop.said
