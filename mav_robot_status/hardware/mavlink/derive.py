"""Facts in, RobotStatus out: one pure function for each field.

Invariants of every status (checked in `tests/`): I1 e_stopped TRUE => drives_powered FALSE. I2 drives_powered FALSE =>
motion_possible FALSE. I3 error_code != 0 <=> in_error TRUE. I4 link stale => everything UNKNOWN, code 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...interface.fields import STATES
from ...interface.status import Detail, Inhibit, LinkState, RobotMode, RobotStatus, Vehicle
from ...mavlink.definitions import AUTOPILOT_NAMES, STATE_NAMES, TYPE_NAMES
from .estop.rule import e_stopped
from .faults import causes
from .faults.rule import active_errors, in_error
from .heartbeat.rule import flight_mode, heartbeat_words, mode_number_words
from .identity import named
from .motion.rule import in_motion
from .power import drives_powered, motion_possible
from .readiness.rule import can_arm, inhibit, inhibits
from .reason import CLAIMED, TRUE, UNKNOWN, Reason
from .satellite import rule as high_latency
from .satellite.rule import high_latency_words

if TYPE_CHECKING:
    from ...clock import Instant
    from .autopilots.modes import FlightMode
    from .facts import Facts, Seldom
    from .options import HardwareOptions


class Derived(NamedTuple):
    """The values for a handle, with a reason for each field."""

    status: RobotStatus
    detail: Detail
    reasons: Mapping[str, Reason]


LATE: Final = Reason("frames arrive, but the latest HEARTBEAT is old", heartbeat_words)
LOST: Final = Reason("no frame within heartbeat_timeout", heartbeat_words)


def derive(facts: Facts, ids: tuple[int, int], before: Detail, now: Instant, options: HardwareOptions) -> Derived:
    """The status of the vehicle with these (system, component) ids at `now`; `before` is the previous detail."""
    if not facts.fresh.heartbeat and not facts.fresh.link:
        return _lost(facts, ids, before, now, options)
    mode = flight_mode(facts, options)
    found = _seldom(facts.seldom, facts, options, mode) if facts.seldom else _found(facts, options, mode)
    errors = active_errors(facts)
    found["mode"], found["in_error"] = (
        (mode.mode, Reason(mode.rule, high_latency_words if facts.seldom else mode_number_words)),
        in_error(facts, errors),
    )
    hidden = _hidden(facts)
    if hidden is not None:
        name, why, fields = hidden
        found |= dict.fromkeys(fields, (UNKNOWN, why)) | {"mode": (RobotMode.UNKNOWN, why)}
    status = RobotStatus(**{field: value for field, (value, _) in found.items()})
    status = status._replace(error_code=errors[0].cause.code if errors and status.in_error is TRUE else 0)
    if status.motion_possible is TRUE:
        inhibited: tuple[Inhibit, ...] = ()
    elif hidden is not None:
        inhibited = (inhibit(name, None, before, now),)
    else:
        inhibited = inhibits(facts, options, mode, found["e_stopped"], before, now)
    detail = Detail(
        system=ids[0],
        component=ids[1],
        errors=tuple(error.cause for error in errors),
        inhibits=inhibited,
        vehicle=_running(facts, mode) if hidden is None else _vehicle(facts),
        link=LinkState.CONNECTED,
    )
    return Derived(status, detail, {field: reason for field, (_, reason) in found.items()})


def _missing(why: Reason, facts: Facts) -> Reason:
    """The reason that a HEARTBEAT is missing; of a vehicle behind a satellite, a HIGH_LATENCY2."""
    return why._replace(words=high_latency_words) if facts.seldom else why


Hidden = tuple[str, Reason, "tuple[str, ...]"]
"""Why fields are unknown: the inhibit, the reason, and the fields beside the mode."""


def _hidden(facts: Facts) -> Hidden | None:
    """What cannot be known, although frames arrive: what rests on a late HEARTBEAT, or on one of two vehicles."""
    fresh = facts.fresh
    if facts.claimed.mixed:
        return "SENDER_UNCERTAIN", CLAIMED, ("e_stopped", "drives_powered", "motion_possible", "in_motion")
    if fresh.heartbeat:
        return None
    moves = () if fresh.velocity is not None or fresh.landed_state or fresh.gps else ("in_motion",)
    return "HEARTBEAT_LATE", _missing(LATE, facts), ("e_stopped", "drives_powered", "motion_possible", *moves)


def _found(facts: Facts, options: HardwareOptions, mode: FlightMode) -> dict[str, tuple[Any, Reason]]:
    """e_stopped, drives_powered, motion_possible and in_motion of a vehicle that sends HEARTBEATs."""
    stopped = e_stopped(facts, options)
    drives = drives_powered(facts, options, *stopped)
    return {
        "e_stopped": stopped,
        "drives_powered": drives,
        "motion_possible": motion_possible(facts, options, mode, *drives),
        "in_motion": in_motion(facts, options),
    }


def _seldom(told: Seldom, facts: Facts, options: HardwareOptions, mode: FlightMode) -> dict[str, tuple[Any, Reason]]:
    """The same for a vehicle that is heard only through HIGH_LATENCY2."""
    drives = high_latency.drives_powered(told, facts, options)
    return {
        "e_stopped": high_latency.e_stopped(options),
        "drives_powered": drives,
        "motion_possible": high_latency.motion_possible(facts, options, mode, drives),
        "in_motion": high_latency.in_motion(told),
    }


def _lost(facts: Facts, ids: tuple[int, int], before: Detail, now: Instant, options: HardwareOptions) -> Derived:
    """I4: without a fresh heartbeat every field is UNKNOWN."""
    status = RobotStatus()
    detail = Detail(
        system=ids[0],
        component=ids[1],
        inhibits=(inhibit("LINK_STALE", None, before, now),),
        vehicle=_vehicle(facts),
        link=LinkState.LOST,
    )
    if options.link_loss_is_error:
        since = next((e.since_us for e in before.errors if e.code == causes.LINK_LOST), now.unix_us)
        status = status._replace(in_error=TRUE, error_code=causes.LINK_LOST)
        detail = detail._replace(errors=(causes.error(causes.LINK_LOST, None, since),))
    return Derived(status, detail, dict.fromkeys((field.name for field in STATES), _missing(LOST, facts)))


def _vehicle(facts: Facts) -> Vehicle:
    """The part of the detail that stays valid while the link is lost."""
    kind = facts.kind
    return Vehicle(
        autopilot=named(AUTOPILOT_NAMES, kind.autopilot),
        type=named(TYPE_NAMES, kind.vehicle_type),
        firmware=None if kind.firmware is None else str(kind.firmware),
    )


def _running(facts: Facts, mode: FlightMode) -> Vehicle:
    """The whole of it while the link is connected."""
    armable = can_arm(facts)
    return _vehicle(facts)._replace(
        flight_mode=mode.name,
        custom_mode=facts.heartbeat.custom_mode,
        state=None if facts.seldom else named(STATE_NAMES, facts.heartbeat.system_status),
        can_arm=None if armable is UNKNOWN else armable is TRUE,
        modes_blocked=facts.arming.modes_blocked,
    )
