"""e_stopped: what shows an emergency stop, by autopilot, and what shows that there is none.

On ArduPilot an e-stop by RC switch or command changes neither HEARTBEAT nor, while armed, SYS_STATUS: an armed vehicle
of which nothing more is heard is UNKNOWN. PX4 shows every stop as state FLIGHT_TERMINATION.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ..interface.status import TriState
from .identity import Stack
from .sensors import is_ready, safety_switch_on

if TYPE_CHECKING:
    from ..clock import Instant
    from ..mavlink.definitions import SysStatus
    from .pulse import Pulse

SETTLING: Final = 2.0
"""Seconds after a disarm (or after connecting) before a healthy PREARM_CHECK bit says anything: it is recomputed once a
second, and forced healthy while armed."""
READY_MESSAGES: Final = 2
REPEATED: Final = 35.0
"""Seconds after which a PreArm text that is no longer repeated (every 30 s) is over."""


class Stop(NamedTuple):
    """What texts, and the pre-arm check that includes the stop, have said."""

    said: TriState = TriState.UNKNOWN
    """TRUE engaged, FALSE released, UNKNOWN nothing said."""
    text: str = ""
    since: Instant | None = None
    last: float = 0.0
    repeats: bool = False
    """Whether the text is one that ArduPilot repeats while it is so."""
    ready: int = 0
    """Healthy SYS_STATUS in a row while disarmed."""
    ready_at: float = 0.0


NOTHING: Final = Stop()


def said(stop: Stop, engaged: bool, text: str, now: Instant) -> Stop:
    """`stop` after a text about an emergency stop."""
    value = TriState.TRUE if engaged else TriState.FALSE
    since = stop.since if stop.said is value else now
    repeats = engaged and "MotorEStop" not in text
    return Stop(value, text, since, now.mono, repeats, 0 if engaged else stop.ready, stop.ready_at)


def heard_sys_status(stop: Stop, status: SysStatus, pulse: Pulse, stack: Stack, now: float) -> Stop:
    """`stop` after one more SYS_STATUS: two in a row that are ready, well after the disarm, end what texts said."""
    if (
        stack is not Stack.ARDUPILOT
        or pulse.armed
        or safety_switch_on(status)
        or not is_ready(status, stack)
        or now - pulse.edge.mono < SETTLING
    ):
        return stop._replace(ready=0) if stop.ready else stop
    ready = stop.ready + 1
    if ready >= READY_MESSAGES:
        return Stop(ready=ready, ready_at=now)
    return stop._replace(ready=ready, ready_at=now)


def still_said(stop: Stop, now: float) -> TriState:
    """What the texts say at `now`."""
    if stop.repeats and now - stop.last >= REPEATED:
        return TriState.UNKNOWN
    return stop.said
