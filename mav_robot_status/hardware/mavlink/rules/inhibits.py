"""The inhibits: every reason why motion is not possible."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import Inhibit, RobotMode
from ....mavlink.enumerations import (
    MAV_STATE_BOOT,
    MAV_STATE_CALIBRATING,
    MAV_STATE_EMERGENCY,
    MAV_STATE_FLIGHT_TERMINATION,
    MAV_STATE_POWEROFF,
    MAV_STATE_UNINIT,
)
from ..autopilots.profile import Uninit
from ..causes import TERMINATION_ANNOUNCED
from .drives_powered import is_initialising
from .reason import FALSE, TRUE
from .simulation import actuators_blocked, is_simulated

if TYPE_CHECKING:
    from ....clock import Instant
    from ....interface.status import Detail
    from ..autopilots.modes import FlightMode
    from ..facts import Facts
    from ..options import HardwareOptions
    from .reason import Finding

INHIBITS: Final = (
    "LINK_STALE DISARMED E_STOPPED SAFETY_SWITCH PREARM_FAILING INITIALISING CALIBRATING POWERING_OFF TERMINATION "
    "EMERGENCY HIL SYS_STATUS_MISSING MODE_MANUAL STOP_UNCERTAIN SENDER_UNCERTAIN"
).split()


def inhibits(
    facts: Facts, options: HardwareOptions, mode: FlightMode, stopped: Finding, before: Detail, now: Instant
) -> tuple[Inhibit, ...]:
    """Every reason why motion is not possible. `stopped` is e_stopped with its reason."""
    value, why = stopped
    reasons: dict[str, str | None] = {}
    if not facts.armed:
        reasons["DISARMED"] = None
    if value is TRUE:
        reasons["E_STOPPED"] = facts.stop.text
    elif why.doubt:
        reasons["STOP_UNCERTAIN"] = facts.stop.text
    if _switch_is_on(facts):
        reasons["SAFETY_SWITCH"] = None
    if not facts.armed and _is_not_ready(facts):
        reasons["PREARM_FAILING"] = facts.explained.not_ready
    reasons |= _of_state(facts)
    if actuators_blocked(facts, options):
        reasons["HIL"] = None
    if not facts.fresh.sys_status:
        reasons["SYS_STATUS_MISSING"] = None
    if options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        reasons["MODE_MANUAL"] = None
    return tuple(inhibit(name, text, before, now) for name, text in reasons.items())


def _of_state(facts: Facts) -> dict[str, str | None]:
    """The inhibits from MAV_STATE, the mode and an announced termination."""
    state = facts.heartbeat.system_status
    starting = state == MAV_STATE_UNINIT and facts.kind.profile.states.uninit is Uninit.STARTING
    termination = next((cause for cause in facts.latched.causes if cause.code == TERMINATION_ANNOUNCED), None)
    reasons: dict[str, str | None] = {}
    if is_initialising(facts) or state == MAV_STATE_BOOT or starting:
        reasons["INITIALISING"] = None
    elif state == MAV_STATE_CALIBRATING:
        reasons["CALIBRATING"] = None
    if state == MAV_STATE_POWEROFF:
        reasons["POWERING_OFF"] = None
    if termination is not None:
        reasons["TERMINATION"] = termination.text
    elif state == MAV_STATE_FLIGHT_TERMINATION and not is_simulated(facts):
        reasons["TERMINATION"] = facts.explained.failsafe
    if state == MAV_STATE_EMERGENCY:
        reasons["EMERGENCY"] = None
    return reasons


def _switch_is_on(facts: Facts) -> bool:
    """Whether the safety switch holds the outputs, by SYS_STATUS or by a text."""
    if facts.fresh.sys_status and facts.sys_status.safety_switch:
        return True
    return not facts.armed and facts.explained.not_ready in facts.kind.profile.texts.safety_switch


def _is_not_ready(facts: Facts) -> bool:
    """Whether the vehicle reports that its pre-arm checks fail."""
    uninit = facts.kind.profile.states.uninit
    if uninit is Uninit.NOT_READY and facts.heartbeat.system_status == MAV_STATE_UNINIT:
        return True
    return facts.fresh.sys_status and facts.sys_status.ready is FALSE


def inhibit(name: str, text: str | None, before: Detail, now: Instant) -> Inhibit:
    """A reason, with the time since which it has been active without interruption."""
    since = next((i.since_us for i in before.inhibits if i.name == name), now.unix_us)
    return Inhibit(name, text, since)
