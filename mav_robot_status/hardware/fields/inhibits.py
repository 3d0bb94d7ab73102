"""The inhibits: every reason why motion is not possible."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...interface.status import Inhibit, RobotMode, TriState
from .. import sensors
from ..flight_mode import is_initialising
from ..identity import ARDUPILOT, HIL, PX4
from .view import BOOT, CALIBRATING, EMERGENCY, POWEROFF, TERMINATED, TRUE, UNINIT, View

if TYPE_CHECKING:
    from ...clock import Instant
    from ...interface.status import Detail
    from ..flight_mode import FlightMode

INHIBITS: Final = (
    "LINK_STALE DISARMED E_STOPPED SAFETY_SWITCH PREARM_FAILING INITIALISING CALIBRATING POWERING_OFF TERMINATION "
    "EMERGENCY HIL SYS_STATUS_MISSING MODE_MANUAL"
).split()
BITS: Final = {name: bit for bit, name in enumerate(INHIBITS)}


def inhibits(view: View, mode: FlightMode, stopped: TriState, before: Detail, now: Instant) -> tuple[Inhibit, ...]:
    """Every reason why motion is not possible."""
    memory, state = view.memory, view.state
    not_ready = memory.not_ready.text if memory.not_ready is not None else None
    failsafe = memory.failsafe.text if memory.failsafe is not None else None
    initialising = is_initialising(view.heartbeat, memory.stack, memory.family)
    switch = (memory.stack is ARDUPILOT and view.status is not None and sensors.safety_switch_on(view.status)) or (
        not view.armed and not_ready == "Preflight Fail: Press safety button first"
    )
    termination = memory.latches.get(1002)
    reasons: dict[str, str | None] = {}
    if not view.armed:
        reasons["DISARMED"] = None
    if stopped is TRUE:
        reasons["E_STOPPED"] = memory.stop.text
    if switch:
        reasons["SAFETY_SWITCH"] = None
    if not view.armed and _is_not_ready(view):
        reasons["PREARM_FAILING"] = not_ready
    if initialising or state == BOOT or (state == UNINIT and memory.stack is not PX4):
        reasons["INITIALISING"] = None
    elif state == CALIBRATING:
        reasons["CALIBRATING"] = None
    if state == POWEROFF:
        reasons["POWERING_OFF"] = None
    if (state == TERMINATED and not view.heartbeat.base_mode & HIL) or termination is not None:
        reasons["TERMINATION"] = termination.text if termination is not None else failsafe
    if state == EMERGENCY:
        reasons["EMERGENCY"] = None
    if view.hil:
        reasons["HIL"] = None
    if view.status is None:
        reasons["SYS_STATUS_MISSING"] = None
    if view.options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        reasons["MODE_MANUAL"] = None
    return tuple(inhibit(name, text, before, now) for name, text in reasons.items())


def _is_not_ready(view: View) -> bool:
    """The pre-arm checks fail, as far as the vehicle says so."""
    stack = view.memory.stack
    if stack is PX4 and view.state == UNINIT:
        return True
    if view.status is None or not sensors.tells_readiness(view.status, stack):
        return False
    return not sensors.is_ready(view.status, stack)


def inhibit(name: str, text: str | None, before: Detail, now: Instant) -> Inhibit:
    """A reason, since when it has been one without interruption."""
    since = next((i.since_us for i in before.inhibits if i.name == name), now.unix_us)
    return Inhibit(BITS[name], name, text, since)
