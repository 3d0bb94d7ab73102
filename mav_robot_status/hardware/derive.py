"""Memory and time in, RobotStatus out: one pure function for each field, and the evidence for its value.

Invariants of every status (checked in `tests/`): I1 e_stopped TRUE => drives_powered FALSE. I2 drives_powered FALSE =>
motion_possible FALSE. I3 error_code != 0 <=> in_error TRUE. I4 link stale => everything UNKNOWN, code 0.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from ..interface.status import Detail, Evidence, LinkState, RobotStatus, Vehicle
from ..mavlink.definitions import AUTOPILOT_NAMES, STATE_NAMES, TYPE_NAMES
from . import causes
from .fields.errors import active_errors, in_error
from .fields.inhibits import inhibit, inhibits
from .fields.moving import in_motion
from .fields.powered import drives_powered, motion_possible
from .fields.stopped import e_stopped
from .fields.view import TRUE, View, named
from .flight_mode import ModeSources, flight_mode
from .observation import is_fresh

if TYPE_CHECKING:
    from ..clock import Instant
    from .memory import Memory
    from .options import HardwareOptions


class Derived(NamedTuple):
    """What a handle is given."""

    status: RobotStatus
    detail: Detail
    evidence: Mapping[str, Evidence]


def derive(memory: Memory, ids: tuple[int, int], before: Detail, now: Instant, options: HardwareOptions) -> Derived:
    """The status of the vehicle with these (system, component) ids at `now`; `before` is the previous detail."""
    beat = memory.observation.heartbeat
    assert beat is not None  # a memory begins with a heartbeat
    if now.mono > beat.at + options.heartbeat_timeout:
        return _lost(memory, ids, before, now, options)
    sys_status = memory.observation.sys_status
    fresh = sys_status is not None and is_fresh(sys_status, now.mono, options.sys_status_timeout)
    view = View(
        memory,
        now.mono,
        options,
        beat.message,
        beat.at,
        sys_status.message if sys_status is not None and fresh else None,
        sys_status.at if sys_status is not None and fresh else None,
    )
    sources = ModeSources(memory.modes, memory.observation.current_mode, options.mode_overrides)
    mode = flight_mode(view.heartbeat, memory.stack, memory.family, sources, now.mono)
    stopped, why_stopped = e_stopped(view)
    drives, why_drives = drives_powered(view, stopped, why_stopped)
    possible, why_possible = motion_possible(view, mode, drives, why_drives)
    moving, why_moving = in_motion(view)
    errors = active_errors(view)
    wrong, why_wrong = in_error(view, errors)
    status = RobotStatus(mode.mode, stopped, drives, possible, moving, wrong, errors[0].cause.code if errors else 0)
    detail = Detail(
        ids[0],
        ids[1],
        tuple(error.cause for error in errors),
        () if possible is TRUE else inhibits(view, mode, stopped, before, now),
        Vehicle(
            named(AUTOPILOT_NAMES, view.heartbeat.autopilot),
            named(TYPE_NAMES, view.heartbeat.type),
            mode.name,
            view.heartbeat.custom_mode,
            named(STATE_NAMES, view.state),
        ),
        LinkState.CONNECTED,
    )
    evidence = {
        "mode": Evidence(mode.rule, f"HEARTBEAT.custom_mode {view.heartbeat.custom_mode}", beat.at),
        "e_stopped": why_stopped,
        "drives_powered": why_drives,
        "motion_possible": why_possible,
        "in_motion": why_moving,
        "in_error": why_wrong,
    }
    return Derived(status, detail, evidence)


def _lost(memory: Memory, ids: tuple[int, int], before: Detail, now: Instant, options: HardwareOptions) -> Derived:
    """I4: without a fresh heartbeat nothing is known."""
    vehicle = Vehicle(named(AUTOPILOT_NAMES, memory.autopilot), named(TYPE_NAMES, memory.vehicle_type))
    stale = inhibit("LINK_STALE", None, before, now)
    beat = memory.observation.heartbeat
    why = Evidence("no heartbeat within heartbeat_timeout", "HEARTBEAT", beat.at if beat else None)
    evidence = dict.fromkeys(RobotStatus._fields[:-1], why)
    status = RobotStatus()
    if options.link_loss_is_error:
        since = next((e.since_us for e in before.errors if e.code == 9001), now.unix_us)
        return Derived(
            status._replace(in_error=TRUE, error_code=9001),
            Detail(ids[0], ids[1], (causes.error(9001, None, since),), (stale,), vehicle, LinkState.LOST),
            evidence,
        )
    return Derived(status, Detail(ids[0], ids[1], (), (stale,), vehicle, LinkState.LOST), evidence)
