"""What was reported about an emergency stop, and when that ends.

Evidence of a stop has a kind. What is measured counts more than what is shown, what is shown more than what is said:

* said: a text, or a command with its acknowledgement. A text or command can get lost, and so can its opposite. What was
  said ends with the opposite, with a link loss, with passing pre-arm checks that include the stop, with the next arming
  and with a sign of power: a driven motor, or rpm or motion under throttle while the outputs do not show the stop.
* shown: the state in the HEARTBEAT, the safety switch and PREARM_CHECK in SYS_STATUS, RS_STOP of the applet. It ends
  when it is too old, and when the opposite arrives.
* measured: the motor outputs (`outputs`).

If evidence of a stop ends without evidence of a release, a doubt remains: the stop may last, so nothing proves that
the drives have power. A doubt ends with a release, a driven motor, passing checks, the applet or an arming.

On ArduPilot an e-stop by RC switch or command changes neither HEARTBEAT nor, while armed, SYS_STATUS. Without other
evidence an armed vehicle is UNKNOWN. PX4 shows every stop as state FLIGHT_TERMINATION; versions before 1.12 only send
texts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import TriState
from ..faults.sensors import readiness, safety_switch_on

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ....clock import Instant
    from ....mavlink.definitions import SysStatus
    from ..autopilots import Autopilot
    from ..autopilots.firmware import Firmware
    from ..heartbeat.state import HeartbeatHistory
    from ..identity import Family

MOTOR_ESTOP: Final = 31
"""RCn_OPTION of a switch that stops in its high position. Also the auxiliary function of MAV_CMD_DO_AUX_FUNCTION."""
ARM_EMERGENCY_STOP: Final = 165
"""RCn_OPTION of a switch that stops in its low position, where it is parked: the pre-arm checks ignore that stop."""
SETTLING: Final = 2.0
"""Seconds after a disarm, a connection or a report of the stop before a healthy PREARM_CHECK bit is used: ArduPilot
recomputes it once a second, and forces it healthy while armed."""
READY_MESSAGES: Final = 2
OUTLASTS_LOSS: Final = 5.0
"""Seconds after which what was said once is unknown, if frames were lost since."""
REPEATED: Final = 35.0
"""Seconds after which a PreArm text that is no longer repeated (every 30 s) is over."""


REFUSES: Final = "Emergency Stopped"
"""In the texts of ArduPilot's pre-arm checks and of a refused arming."""
MOVED_SWITCH: Final = "MotorEStop"
"""The text of a switch of option 31 when it moves (RC_Channel.cpp): `RC7: MotorEStop HIGH`."""
MOVES: Final = 1.5
"""Seconds after that text in which RC_CHANNELS may be older than the text."""


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
    """The number of healthy SYS_STATUS in a row while disarmed."""
    ready_at: float = 0.0
    doubt: str | None = None
    """Why a stop may last: there was evidence of it, and none of its end. None: no such evidence."""
    lost_at: float | None = None
    """Since when frames are lost after the report: one of them may have said the opposite."""
    rested: bool = False
    """Whether the vehicle was seen at rest since the report."""


FRAMES_LOST: Final = "a stop was reported, and frames have been lost since"
STARTED: Final = "a stop was reported, and since then the vehicle has started from rest"
LINK_LOST: Final = "a stop was reported, and the link has been lost since"
UNDER_POWER: Final = "a stop was reported, and since then there are signs of power"
UNANSWERED: Final = "a command to stop or to release has no clear acknowledgement"
HELD: Final = "the motor outputs were held by a stop, and no release was seen"
LATE: Final = "a text that refuses the arming has arrived while the vehicle is armed"
SWITCHED_BACK: Final = "a switch reported a stop, and is not in its stop position any more"
SHUT_DOWN: Final = "the motors were switched off while armed, and have not been driven since"
ARMED: Final = "a stop was reported before the arming, and this firmware may arm while it is stopped"
APPLET_SILENT: Final = "the applet reported a stop, and has been silent since"
"""The doubts."""
NOTHING: Final = Stop()


def said(stop: Stop, engaged: bool, text: str | None, now: Instant, source: str | None = None) -> Stop:
    """`stop` after a report that an emergency stop is engaged or released: in a text, or by another `source`."""
    value = TriState.TRUE if engaged else TriState.FALSE
    if now.mono < stop.last and stop.said is not TriState.UNKNOWN:
        return stop  # it arrives late: a newer report is known
    return Stop(
        said=value,
        text=text,
        source=source or f"STATUSTEXT: {text}",
        since=stop.since if stop.said is value else now,
        last=now.mono,
        repeats=engaged and text is not None and REFUSES in text,
        ready=0 if engaged else stop.ready,
        ready_at=stop.ready_at,
    )


def lost(stop: Stop, since: float) -> Stop:
    """`stop` after frames were lost since a time. The first loss after the report counts."""
    if stop.said is TriState.UNKNOWN or stop.lost_at is not None or since < stop.last:
        return stop
    return stop._replace(lost_at=since)


def moved(stop: Stop, moves: TriState, now: float) -> Stop:
    """`stop` while the vehicle is at rest or in motion: a stopped one may coast, but does not start from rest."""
    if stop.said is not TriState.TRUE or moves is TriState.UNKNOWN:
        return stop
    if moves is TriState.FALSE:
        return stop if stop.rested else stop._replace(rested=True)
    return doubted(stop, STARTED, now) if stop.rested else stop


def doubted(stop: Stop, why: str, now: float) -> Stop:
    """`stop` after evidence of a stop that has ended without evidence of a release. Also ends a reported release."""
    if stop.doubt is not None:
        return stop
    return Stop(text=stop.text, source=stop.source, last=now, doubt=why)


def switched_back(stop: Stop, now: float) -> Stop:
    """`stop` while no switch of option 31 is in its stop position: a text of one that says "engaged" is over."""
    if stop.said is TriState.TRUE and MOVED_SWITCH in (stop.text or "") and now > stop.last + MOVES:
        return doubted(stop, SWITCHED_BACK, now)
    return stop


def ended(stop: Stop) -> Stop:
    """`stop` after evidence that none is engaged: a driven motor, or the word of the applet."""
    return NOTHING if stop.said is TriState.TRUE or stop.doubt is not None else stop


def unsure(stop: Stop, why: str, now: float) -> Stop:
    """`stop` when nothing that was said counts any more: if that was a stop, a doubt remains."""
    if stop.said is TriState.TRUE or stop.doubt is not None:
        return doubted(stop, why, now)
    return NOTHING


def includes_stop(profile: Autopilot, family: Family, version: Firmware | None, reports_mission: bool) -> bool:
    """Whether the pre-arm checks of this firmware fail while a stop is engaged.

    Without a known `version` its least value follows from what the firmware sends: PREARM_CHECK in SYS_STATUS, or
    MISSION_CURRENT with a mission_state.
    """
    check = profile.stops.check
    if check is None or family not in check.first:
        return False
    least = check.mission_state if reports_mission else check.prearm_check
    return (version or least) >= check.first[family]


def heard_sys_status(
    stop: Stop, status: SysStatus, heartbeats: HeartbeatHistory, profile: Autopilot, checked: bool, now: float
) -> Stop:
    """`stop` after one more SYS_STATUS: two ready ones in a row, some time after the disarm, clear what was said.

    `checked`: `includes_stop` of this vehicle.
    """
    if (
        not checked
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
