"""Facts in, RobotStatus out: one pure function for each field.

Invariants of every status (checked in `tests/`): I1 e_stopped TRUE => drives_powered FALSE. I2 drives_powered FALSE =>
motion_possible FALSE. I3 error_code != 0 <=> in_error TRUE. I4 link stale => everything UNKNOWN, code 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from ...interface.fields import STATES
from ...interface.status import Detail, Inhibit, LinkState, RobotStatus, Vehicle
from ...mavlink.definitions import AUTOPILOT_NAMES, STATE_NAMES, TYPE_NAMES
from ...values import NamedTuple
from . import causes
from .identity import named
from .rules import high_latency
from .rules.arming import can_arm
from .rules.claimed import agreed
from .rules.drives_powered import drives_powered, motion_possible
from .rules.e_stopped import e_stopped
from .rules.errors import active_errors, in_error
from .rules.flight_mode import flight_mode
from .rules.in_motion import in_motion
from .rules.inhibits import inhibit, inhibits
from .rules.reason import FALSE, TRUE, UNKNOWN, Finding, Reason, Source

if TYPE_CHECKING:
    from ...clock import Instant
    from ...interface.status import TriState
    from .autopilots.modes import FlightMode
    from .facts import Facts, Seldom
    from .options import HardwareOptions


class Derived(NamedTuple):
    """The values for a handle, with a reason for each field."""

    status: RobotStatus
    detail: Detail
    reasons: Mapping[str, Reason]


LOST: Final = Reason("no heartbeat within heartbeat_timeout", Source.HEARTBEAT)


def derive(facts: Facts, ids: tuple[int, int], before: Detail, now: Instant, options: HardwareOptions) -> Derived:
    """The status of the vehicle with these (system, component) ids at `now`; `before` is the previous detail."""
    if not facts.fresh.heartbeat:
        return _lost(facts, ids, before, now, options)
    mode = flight_mode(facts, options)
    found = _seldom(facts.seldom, facts, options, mode) if facts.seldom else _found(facts, options, mode)
    (stopped, why_stopped), (drives, why_drives), (possible, why_possible), (moving, why_moving) = found
    why_mode, doubted = Reason(mode.rule, Source.MODE_NUMBER), facts.claimed.doubted
    if doubted:
        known = agreed(facts.claimed, mode.mode, drives)
        mode, why_mode = mode._replace(mode=known.mode[0]), known.mode[1]
        (stopped, why_stopped), (drives, why_drives) = known.e_stopped, known.drives_powered
        (possible, why_possible), (moving, why_moving) = known.motion_possible, known.in_motion
    errors = active_errors(facts)
    wrong, why_wrong = in_error(facts, errors)
    status = RobotStatus(
        mode=mode.mode,
        e_stopped=stopped,
        drives_powered=drives,
        motion_possible=possible,
        in_motion=moving,
        in_error=wrong,
        error_code=errors[0].cause.code if errors else 0,
    )
    detail = Detail(
        system=ids[0],
        component=ids[1],
        errors=tuple(error.cause for error in errors),
        inhibits=_why_not(facts, possible, options, mode, (stopped, why_stopped), before, now),
        vehicle=_vehicle(facts) if doubted and not facts.claimed.one_mode else _running(facts, mode),
        link=LinkState.CONNECTED,
    )
    reasons = {
        "mode": why_mode,
        "e_stopped": why_stopped,
        "drives_powered": why_drives,
        "motion_possible": why_possible,
        "in_motion": why_moving,
        "in_error": why_wrong,
    }
    return Derived(status, detail, reasons)


def _found(facts: Facts, options: HardwareOptions, mode: FlightMode) -> tuple[Finding, Finding, Finding, Finding]:
    """e_stopped, drives_powered, motion_possible and in_motion of a vehicle that sends HEARTBEATs."""
    stopped = e_stopped(facts, options)
    drives = drives_powered(facts, options, *stopped)
    return stopped, drives, motion_possible(facts, options, mode, *drives), in_motion(facts, options)


def _seldom(
    told: Seldom, facts: Facts, options: HardwareOptions, mode: FlightMode
) -> tuple[Finding, Finding, Finding, Finding]:
    """The same for a vehicle that is heard only through HIGH_LATENCY2."""
    drives = high_latency.drives_powered(told, facts, options)
    possible = high_latency.motion_possible(facts, options, mode, drives)
    return high_latency.e_stopped(options), drives, possible, high_latency.in_motion(told)


def _why_not(
    facts: Facts,
    possible: TriState,
    options: HardwareOptions,
    mode: FlightMode,
    stopped: Finding,
    before: Detail,
    now: Instant,
) -> tuple[Inhibit, ...]:
    """The inhibits. While senders differ, what one of them says is not a reason."""
    if possible is TRUE:
        return ()
    if facts.claimed.doubted and possible is not FALSE:
        return (inhibit("SENDER_UNCERTAIN", None, before, now),)
    return inhibits(facts, options, mode, stopped, before, now)


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
    return Derived(status, detail, dict.fromkeys((field.name for field in STATES), LOST))


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
