"""When a status can change: at once, because something that matters was heard, or later, by time alone.

Deriving a status costs ten times what hearing a message does, and most messages of a vehicle on its way change nothing.
"""

from __future__ import annotations

from math import inf, nextafter
from operator import attrgetter
from typing import TYPE_CHECKING, Final

from ..mavlink import definitions as mav
from . import boot, causes, estop, motion, outputs, sensors, statustext
from .flight_mode import CURRENT_MODE_FRESH
from .hearing.movement import driving_speed, speed_over_ground
from .motion import FALSE, TRUE, UNKNOWN
from .observation import slowly_fresh_until

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from .memory import Memory
    from .options import HardwareOptions

    Part = Callable[[Memory, HardwareOptions], tuple[object, ...]]
    Matters = Mapping[type | None, tuple[object, ...]]


def _of_clock(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    """Every clock dates the boot a little better; only faults wait for that."""
    return memory.boots, memory.faults and memory.boot.at


def _is_vetoed(memory: Memory) -> bool:
    watch, speed = memory.watch, driving_speed(memory)
    return outputs.is_vetoed(watch, memory.family, memory.vehicle_type, speed, memory.turning)


def _of_attitude(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    seen, held = memory.observation.attitude, memory.watch.held_since is not None
    return seen and seen.since, memory.faults and memory.boot.at, held and _is_vetoed(memory)


def _of_global_position(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    moving, seen = memory.motion, memory.observation.global_position
    return (
        seen and seen.since,
        memory.faults and memory.boot.at,
        moving.value,
        moving.value is UNKNOWN and moving.slow_since is None,
        moving.speed is None,
        # whether the receiver stands still while the estimate of a disarmed vehicle moves
        moving.value is TRUE
        and memory.gps_motion.value is FALSE
        and not memory.pulse.armed
        and speed_over_ground(memory) > options.v_on_disarmed,
    )


def _of_local_position(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    moving, seen = memory.motion, memory.observation.local_position
    return (
        seen and seen.since,
        memory.faults and memory.boot.at,
        moving.value,
        moving.value is UNKNOWN and moving.slow_since is None,
        moving.speed is None,
    )


def _of_vfr_hud(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    moving, seen = memory.motion, memory.observation.vfr_hud
    return (
        seen and seen.since,
        moving.value,
        moving.value is UNKNOWN and moving.slow_since is None,
        moving.speed is None,
        memory.watch.held_since is not None and _is_vetoed(memory),
    )


def _of_gps(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    seen = memory.observation.gps
    return seen and seen.since, memory.gps_motion.value


def _of_outputs(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    watch = memory.watch
    return (
        watch.driven,
        watch.held_since,
        memory.observation.esc and outputs.is_at_stop(watch, memory.vehicle_type),
        memory.stop.said,  # ended by a motor that is driven
        memory.switches,
    )


def _of_heartbeat(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    """A heartbeat like the last one, in time, only lets time pass, and confirms the outputs at rest."""
    seen = memory.observation.heartbeat
    return (
        seen and (seen.since, seen.message),
        memory.latches.keys(),
        seen and causes.has_outlived_termination(memory.latches, memory.pulse.armed, seen.at),
        memory.observation.esc and outputs.is_at_stop(memory.watch, memory.vehicle_type),
    )


def _of_sys_status(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    seen = memory.observation.sys_status
    return (
        seen and (seen.since, seen.message[:3]),
        memory.faults and [(bit, fault.messages >= sensors.DEBOUNCE_MESSAGES) for bit, fault in memory.faults.items()],
        memory.stop.said,
        memory.stop.ready >= estop.READY_MESSAGES,
        len(memory.latches),
        memory.not_ready,
        memory.internal_errors_since,
        memory.rc_lost_since,
        memory.impostor,
    )


def _of_landed_state(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    seen = memory.observation.extended_sys_state
    return seen and seen.since, seen and seen.message


def _of_estimator(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    """It is looked at with the next speed."""
    return ()


def _of_current_mode(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    seen = memory.observation.current_mode
    return seen and seen.since, seen and seen.message


def _of_esc(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    seen = memory.observation.esc
    return seen and seen.since, seen and outputs.is_at_stop(memory.watch, memory.vehicle_type)


def _of_the_rest(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    """What the vehicle says of itself, and the streams of which a message in PARTS is none."""
    seen = memory.observation
    return (
        seen.extended_sys_state and seen.extended_sys_state.message,
        seen.current_mode and seen.current_mode.message,
        [heard.since for heard in seen if heard is not None],
        memory.stop.text,
        [(code, latch.text) for code, latch in memory.latches.items()],
        memory.failsafe,
        memory.modes,
        memory.version,
        memory.assumed_free,
    )


PARTS: Final[Mapping[type, Part]] = {
    mav.Attitude: _of_attitude,
    mav.CurrentMode: _of_current_mode,
    mav.EkfStatusReport: _of_estimator,
    mav.EscStatus: _of_esc,
    mav.EscTelemetry1To4: _of_esc,
    mav.EscTelemetry5To8: _of_esc,
    mav.EscTelemetry9To12: _of_esc,
    mav.ExtendedSysState: _of_landed_state,
    mav.GlobalPositionInt: _of_global_position,
    mav.GpsRawInt: _of_gps,
    mav.Heartbeat: _of_heartbeat,
    mav.LocalPositionNed: _of_local_position,
    mav.ParamValue: _of_outputs,
    mav.ServoOutputRaw: _of_outputs,
    mav.SysStatus: _of_sys_status,
    mav.SystemTime: _of_clock,
    mav.VfrHud: _of_vfr_hud,
}
"""All that each of the messages that come several times a second can change, but for times of arrival."""


MOTIONS: Final[Mapping[type, Callable[[Memory], motion.Motion]]] = {
    mav.GlobalPositionInt: attrgetter("motion"),
    mav.GpsRawInt: attrgetter("gps_motion"),
    mav.LocalPositionNed: attrgetter("motion"),
    mav.VfrHud: attrgetter("motion"),
}
"""The motion that a message may begin, or end, a while after it was heard."""


def matters(memory: Memory, options: HardwareOptions) -> Matters:
    """All that a status depends on but times of arrival: if equal before and after a message, it changed nothing."""
    found: dict[type | None, tuple[object, ...]] = {kind: part(memory, options) for kind, part in PARTS.items()}
    found[None] = _of_the_rest(memory, options)
    return found


UNLIKE_ALL: Final[Matters] = dict.fromkeys(PARTS, ("never",))
"""Differs from whatever matters: every message then counts as one that changes something."""


def next_change(memory: Memory, after: float, options: HardwareOptions) -> float:
    """The first time (monotonic seconds) later than `after` at which the status may change though nothing is heard."""
    first = inf
    for at in _ends(memory, options):
        if after < at < first:
            first = at
    stale = nextafter(_first_stale(memory, after, options), inf)  # what is fresh at its limit is not old
    return stale if stale < first else first


def _first_stale(memory: Memory, after: float, options: HardwareOptions) -> float:
    """The first limit, at `after` or later, up to which something that was heard counts."""
    seen = memory.observation
    beat, status, mode = seen.heartbeat, seen.sys_status, seen.current_mode
    first = inf
    for heard in seen:
        if heard is None:
            continue
        least = motion.FRESH
        if heard is beat:
            least = options.heartbeat_timeout
        elif heard is status:
            least = options.sys_status_timeout
        elif heard is mode:
            least = CURRENT_MODE_FRESH
        limit = heard.at + least
        if limit < after and heard is not beat:
            limit = slowly_fresh_until(heard)
        if after <= limit < first:
            first = limit
    at = memory.watch.at
    return at + motion.FRESH if at is not None and after <= at + motion.FRESH < first else first


def _ends(memory: Memory, options: HardwareOptions) -> Iterator[float]:
    """When latches end and doubts are settled."""
    if memory.watch.held_since is not None:
        yield memory.watch.held_since + outputs.HOLD
    yield motion.settles_at(memory.motion)
    yield motion.settles_at(memory.gps_motion)
    for fault in memory.faults.values():
        yield fault.since.mono + sensors.DEBOUNCE_SECONDS
    for code, latch in memory.latches.items():
        yield causes.ends_at(code, latch, memory.pulse, options.text_hold_s)
    for _, partial in memory.texts:
        yield partial.at + statustext.PATIENCE
    if memory.stop.repeats:
        yield memory.stop.last + estop.REPEATED
    yield memory.boot.at + boot.GRACE
