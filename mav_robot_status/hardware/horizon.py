"""When a status can change: at once, because something that matters was heard, or later, by time alone.

Deriving a status costs ten times what hearing a message does, and most messages of a vehicle on its way change nothing.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ..mavlink import definitions as mav
from . import boot, causes, estop, motion, outputs, sensors, statustext
from .flight_mode import CURRENT_MODE_FRESH
from .hearing.movement import driving_speed, speed_over_ground
from .observation import slowly_fresh_until

if TYPE_CHECKING:
    from collections.abc import Iterator

    from .memory import Memory
    from .options import HardwareOptions

MOVEMENT: Final = frozenset(
    {
        mav.Attitude,
        mav.GlobalPositionInt,
        mav.GpsRawInt,
        mav.LocalPositionNed,
        mav.ServoOutputRaw,
        mav.SystemTime,
        mav.VfrHud,
    }
)
"""The messages that come several times a second."""


def matters(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    """All that a status depends on but times of arrival: if equal before and after a message, it changed nothing."""
    return of_movement(memory, options), of_the_rest(memory)


def of_movement(memory: Memory, options: HardwareOptions) -> tuple[object, ...]:
    """The part of `matters` that a message in MOVEMENT can change, unless it shows a reboot."""
    seen, watch = memory.observation, memory.watch
    moving, gps = memory.motion, memory.gps_motion
    held = watch.held_since is not None
    return (
        moving.value,
        moving.fast_since,
        moving.slow_since,
        moving.speed is None,
        gps.value,
        gps.fast_since,
        gps.slow_since,
        gps.speed is None,
        not memory.pulse.armed and speed_over_ground(memory) > options.v_on_disarmed,
        watch.driven,
        seen.esc is not None and outputs.is_at_stop(watch, memory.vehicle_type),
        watch.held_since,
        held and outputs.is_vetoed(watch, memory.family, driving_speed(memory)),
        seen.vfr_hud if held else None,  # a speed that grows vetoes
        memory.stop.said,  # ended by a motor that is driven
        memory.boots,
        memory.boot.at if memory.faults else None,  # dated a little better by each clock, while faults wait for it
        *[heard.since for heard in seen if heard is not None],
    )


def of_the_rest(memory: Memory) -> tuple[object, ...]:
    """The other part: what the vehicle says of itself."""
    seen = memory.observation
    return (
        seen.heartbeat.message if seen.heartbeat is not None else None,
        seen.sys_status.message[:3] if seen.sys_status is not None else None,
        [bit for bit, fault in memory.faults.items() if fault.messages >= sensors.DEBOUNCE_MESSAGES],
        memory.faults.keys(),
        memory.stop.said,
        memory.stop.text,
        memory.stop.ready >= estop.READY_MESSAGES,
        [(code, latch.text) for code, latch in memory.latches.items()],
        memory.not_ready,
        memory.failsafe,
        memory.internal_errors_since,
        memory.rc_lost_since,
        seen.extended_sys_state.message if seen.extended_sys_state is not None else None,
        seen.current_mode.message if seen.current_mode is not None else None,
        memory.modes,
        memory.impostor,
        memory.assumed_free,
    )


def may_matter(memory: Memory, message: object, before: tuple[object, ...], options: HardwareOptions) -> bool:
    """Whether `message`, just heard, changed something that matters since `before`."""
    if type(message) in MOVEMENT:
        return of_movement(memory, options) != before[0]
    return matters(memory, options) != before


def next_change(memory: Memory, now: float, options: HardwareOptions) -> float:
    """The first time (monotonic seconds) after `now` at which the status may change though nothing is heard."""
    return min((at for at in _ends(memory, options) if at > now), default=math.inf)


def _ends(memory: Memory, options: HardwareOptions) -> Iterator[float]:
    """When what was heard becomes too old, latches end, doubts are settled."""
    seen = memory.observation
    if seen.heartbeat is not None:
        yield _after(seen.heartbeat.at + options.heartbeat_timeout)
    for heard in seen[1:]:
        if heard is not None:
            least = motion.FRESH
            if heard is seen.sys_status:
                least = options.sys_status_timeout
            elif heard is seen.current_mode:
                least = CURRENT_MODE_FRESH
            yield _after(max(heard.at + least, slowly_fresh_until(heard)))
    if memory.watch.at is not None:
        yield _after(memory.watch.at + motion.FRESH)
    if memory.watch.held_since is not None:
        yield memory.watch.held_since + outputs.HOLD
    for moving in (memory.motion, memory.gps_motion):
        if moving.fast_since is not None:
            yield moving.fast_since + motion.SUSTAIN_ON
        if moving.slow_since is not None:
            yield moving.slow_since + motion.SUSTAIN_OFF
    for fault in memory.faults.values():
        yield fault.since.mono + sensors.DEBOUNCE_SECONDS
    for code, latch in memory.latches.items():
        yield causes.ends_at(code, latch, memory.pulse, options.text_hold_s)
    for _, partial in memory.texts:
        yield partial.at + statustext.PATIENCE
    if memory.stop.repeats:
        yield memory.stop.last + estop.REPEATED
    yield memory.boot.at + boot.GRACE


def _after(at: float) -> float:
    """The first time that is later: what is fresh at its limit is not behind it."""
    return math.nextafter(at, math.inf)
