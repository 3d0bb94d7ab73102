"""The fields of a vehicle that is heard only through HIGH_LATENCY2.

It says nothing of MAV_STATE, of an emergency stop or of the outputs. It says armed or disarmed on ArduPilot only. It
proves motion, but never rest: its samples are a minute apart, and the vehicle may have started since the last.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import RobotMode
from .drives_powered import is_initialising, off
from .reason import FALSE, TRUE, UNKNOWN, Finding, Reason, Source
from .simulation import actuators_blocked

if TYPE_CHECKING:
    from ..autopilots.modes import FlightMode
    from ..facts import Facts, Seldom
    from ..options import HardwareOptions

SOURCE: Final = Source.HIGH_LATENCY
ARMED_UNTOLD: Final = Reason("this HIGH_LATENCY2 does not say whether the vehicle is armed", SOURCE)
STATE_UNTOLD: Final = Reason("armed, but HIGH_LATENCY2 does not report MAV_STATE", SOURCE)
MOVES: Final = Reason("two messages show motion", SOURCE)
NOT_MOVING: Final = Reason("nothing shows motion, and samples so far apart cannot show rest", SOURCE)


def e_stopped(options: HardwareOptions) -> Finding:
    """Never known."""
    if options.estop_unknown_as == "false":
        return FALSE, Reason("estop_unknown_as: false")
    return UNKNOWN, Reason("HIGH_LATENCY2 does not show an emergency stop", SOURCE)


def drives_powered(told: Seldom, facts: Facts, options: HardwareOptions) -> Finding:
    """Armed, if the message says whether it is armed."""
    if told.armed is UNKNOWN:
        return UNKNOWN, ARMED_UNTOLD
    if told.armed is FALSE:
        return FALSE, Reason("disarmed", SOURCE)
    if actuators_blocked(facts, options):
        return FALSE, Reason("hardware in the loop: actuators blocked", SOURCE)
    return TRUE, Reason("armed", SOURCE)


def motion_possible(facts: Facts, options: HardwareOptions, mode: FlightMode, drives: Finding) -> Finding:
    """Impossible without power; otherwise unknown, because the state is."""
    powered, why = drives
    if powered is FALSE:
        return FALSE, why._replace(rule=off(why.rule))
    if options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        return FALSE, Reason("manual mode (manual_blocks_motion)", SOURCE)
    if powered is UNKNOWN:
        return UNKNOWN, why
    return (FALSE, Reason("mode INITIALIZING", SOURCE)) if is_initialising(facts) else (UNKNOWN, STATE_UNTOLD)


def in_motion(told: Seldom) -> Finding:
    """Proven by two messages, or unknown."""
    return (TRUE, MOVES) if told.moves else (UNKNOWN, NOT_MOVING)


def inhibits(told: Seldom, facts: Facts, options: HardwareOptions, mode: FlightMode) -> list[str]:
    """The reasons that the message shows. What it does not show is not a reason."""
    reasons = {
        "DISARMED": told.armed is FALSE,
        "INITIALISING": told.armed is not UNKNOWN and is_initialising(facts),
        "HIL": told.armed is not UNKNOWN and actuators_blocked(facts, options),
        "MODE_MANUAL": options.manual_blocks_motion and mode.mode is RobotMode.MANUAL,
    }
    return [name for name, applies in reasons.items() if applies]
