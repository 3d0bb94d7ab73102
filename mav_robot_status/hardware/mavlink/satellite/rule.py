"""The fields of a vehicle that is heard only through HIGH_LATENCY2.

It says nothing of MAV_STATE, of an emergency stop or of the outputs. It says armed or disarmed on ArduPilot only. It
proves motion, but never rest: its samples are a minute apart, and the vehicle may have started since the last.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import RobotMode
from ..facts import Cause, Seldom
from ..heartbeat.rule import actuators_blocked, is_initialising
from ..reason import FALSE, TRUE, UNKNOWN, Finding, Reason, off
from .failure_flags import failures
from .state import speed

if TYPE_CHECKING:
    from ..autopilots.modes import FlightMode
    from ..facts import Deadline, Facts, Seldom
    from ..options import HardwareOptions
    from ..reason import Reason, Shown
    from ..state import VehicleState

# -- facts -------------------------------------------------------------------------------------------------------------


def seldom(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Seldom | None:
    """What HIGH_LATENCY2 tells of a vehicle that sends nothing else."""
    known = state.high_latency
    if known is None:
        return None
    found = tuple(Cause(code, None, since) for code, since in failures(known, options))
    return Seldom(known.armed, known.moves, found)


# -- evidence in words -------------------------------------------------------------------------------------------------


def high_latency_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """What HIGH_LATENCY2 says."""
    known = state.high_latency
    if known is None:
        return None, None
    m = known.message
    text = f"custom_mode {m.custom_mode}, custom0 {m.custom0}, failure_flags 0x{m.failure_flags:x}"
    return f"HIGH_LATENCY2: {text}, groundspeed {speed(m):g} m/s", known.at


# -- the rule ----------------------------------------------------------------------------------------------------------


ARMED_UNTOLD: Final = Reason("this HIGH_LATENCY2 does not say whether the vehicle is armed", high_latency_words)
STATE_UNTOLD: Final = Reason("armed, but HIGH_LATENCY2 does not report MAV_STATE", high_latency_words)
MOVES: Final = Reason("two messages show motion", high_latency_words)
NOT_MOVING: Final = Reason("nothing shows motion, and samples so far apart cannot show rest", high_latency_words)


def e_stopped(options: HardwareOptions) -> Finding:
    """Never known."""
    if options.estop_unknown_as == "false":
        return FALSE, Reason("estop_unknown_as: false")
    return UNKNOWN, Reason("HIGH_LATENCY2 does not show an emergency stop", high_latency_words)


def drives_powered(told: Seldom, facts: Facts, options: HardwareOptions) -> Finding:
    """Armed, if the message says whether it is armed."""
    if told.armed is UNKNOWN:
        return UNKNOWN, ARMED_UNTOLD
    if told.armed is FALSE and facts.fresh.arming_told:
        return UNKNOWN, Reason("another HIGH_LATENCY2, which is late, says that it is armed", high_latency_words)
    if told.armed is FALSE:
        return FALSE, Reason("disarmed", high_latency_words)
    if actuators_blocked(facts, options):
        return FALSE, Reason("hardware in the loop: actuators blocked", high_latency_words)
    return TRUE, Reason("armed", high_latency_words)


def motion_possible(facts: Facts, options: HardwareOptions, mode: FlightMode, drives: Finding) -> Finding:
    """Impossible without power; otherwise unknown, because the state is."""
    powered, why = drives
    if powered is FALSE:
        return FALSE, why._replace(rule=off(why.rule))
    if options.manual_blocks_motion and mode.mode is RobotMode.MANUAL:
        return FALSE, Reason("manual mode (manual_blocks_motion)", high_latency_words)
    if powered is UNKNOWN:
        return UNKNOWN, why
    return (
        (FALSE, Reason("mode INITIALIZING", high_latency_words)) if is_initialising(facts) else (UNKNOWN, STATE_UNTOLD)
    )


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
