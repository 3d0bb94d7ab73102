"""HEARTBEAT, and what a reboot, an arming and a long silence end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...interface.status import TriState
from ...mavlink.definitions import Heartbeat
from .. import boot as boot_rules
from .. import causes, estop, outputs, sensors
from ..flight_mode import is_initialising
from ..identity import PX4
from ..memory import Memory, begin
from ..motion import Motion
from ..observation import Observation, heard
from ..pulse import TERMINATED, armed_before, next_beat
from .words import pass_time

if TYPE_CHECKING:
    from ...clock import Instant
    from ..options import HardwareOptions

LONG_LOSS: Final = 30.0
"""Seconds of link loss after which nothing that was latched is believed."""
TURN: Final = 10.0
"""Seconds within which two autopilots with the same ids take turns."""
UNINIT, BOOT, STANDBY = 0, 1, 3  # MAV_STATE


def heartbeat(memory: Memory, message: Heartbeat, now: Instant, options: HardwareOptions) -> None:
    """A HEARTBEAT: edges of armed and state, stop values, and whether the autopilot has started anew."""
    if (message.autopilot, message.type) != (memory.autopilot, memory.vehicle_type):
        _another(memory, message, now)
        return
    pass_time(memory, now, options)
    before = memory.pulse
    last = before.runs[-1].last
    connected = now.mono - last <= options.heartbeat_timeout
    pulse = memory.pulse = next_beat(before, message, now, connected)
    enabled = not pulse.armed and _outputs_enabled(memory)
    outputs.heard_beat(memory.watch, pulse, before, enabled, memory.vehicle_type, now.mono)
    seen = memory.observation
    previous: Heartbeat = seen.heartbeat.message if seen.heartbeat else message
    seen.heartbeat = heard(message, now.mono, seen.heartbeat)
    if message != previous and _starts_anew(previous, message, memory):
        rebooted(memory, boot_rules.Boot(now.mono), now)
    if now.mono - last > LONG_LOSS:
        memory.latches, memory.stop = causes.NO_LATCHES, estop.NOTHING
        memory.not_ready = memory.failsafe = None
    if not connected:
        memory.motion, memory.gps_motion = Motion(), Motion()
    if not connected or (before.armed and not pulse.armed):
        memory.stop = memory.stop._replace(ready=0)
        memory.assumed_free = False
    if pulse.armed and not before.armed:
        _armed(memory, last, now)
    if memory.stack is PX4 and message.system_status == TERMINATED:
        memory.stop = estop.NOTHING  # it shows its stops, and need not be believed on its word
    if pulse.calm_since == now.mono:
        memory.failsafe = None


def _another(memory: Memory, message: Heartbeat, now: Instant) -> None:
    """Another autopilot: nothing that was said of the old one counts. Two that take turns claim the same ids."""
    new = begin(message, now)
    new.boots, new.formerly = memory.boots, (memory.autopilot, memory.vehicle_type)
    if memory.formerly == (message.autopilot, message.type) and now.mono - memory.pulse.since.mono <= TURN:
        kept = {code: latch for code, latch in memory.latches.items() if code == 9002}
        new.latches = causes.announce(kept, 9002, None, now, "HEARTBEAT.type and autopilot")
    memory.become(new)


def _starts_anew(previous: Heartbeat, message: Heartbeat, memory: Memory) -> bool:
    """The heartbeat says that the autopilot is starting, and the one before said that it had."""
    state, before = message.system_status, previous.system_status
    if state == BOOT and before >= STANDBY:
        return True
    if state == UNINIT and before >= STANDBY and memory.stack is not PX4:
        return True
    starting = is_initialising(message, memory.stack, memory.family)
    return starting and not is_initialising(previous, memory.stack, memory.family)


def rebooted(memory: Memory, boot: boot_rules.Boot, now: Instant) -> None:
    """After a reboot nothing that the old run said counts; one while armed is an error."""
    seen = memory.observation
    status = seen.sys_status if seen.sys_status is not None and seen.sys_status.at > boot.at else None
    new = Memory(
        observation=Observation(heartbeat=seen.heartbeat, sys_status=status),
        pulse=memory.pulse,
        boot=boot,
        vehicle_type=memory.vehicle_type,
        autopilot=memory.autopilot,
        impostor=memory.impostor,
        watch=outputs.Watch(functions=memory.watch.functions),
        switches=memory.switches,
        modes=memory.modes,
        version=memory.version,
        asked=memory.asked,
        boots=memory.boots + 1,
        formerly=memory.formerly,
    )
    if boot.in_turn:
        new.latches = causes.announce(new.latches, 9002, None, now, "time_boot_ms of two clocks in turn")
    elif 5004 in memory.latches or armed_before(memory.pulse, boot.at, LONG_LOSS):
        new.latches = causes.announce(new.latches, 5004, None, now, "time_boot_ms")
    memory.become(new)


def _armed(memory: Memory, previous_beat: float, now: Instant) -> None:
    """Arming acknowledges: it is refused while stopped or crashed, so what was said before is over.

    What was said since the heartbeat before stays: it may have been said after the arming.
    """
    memory.latches = {
        code: latch
        for code, latch in memory.latches.items()
        if causes.CAUSES[code].clears is not causes.Clears.ARMING or latch.last > previous_beat
    }
    stop = memory.stop
    checked = stop.ready >= estop.READY_MESSAGES and not estop.is_excused(memory.switches)
    free = checked or estop.still_said(stop, now.mono) is TriState.FALSE
    new = stop.said is TriState.TRUE and stop.last > previous_beat and not stop.repeats
    memory.stop = stop._replace(ready=0) if new else estop.NOTHING
    memory.not_ready = None
    memory.assumed_free = free and not new


def _outputs_enabled(memory: Memory) -> bool:
    status = memory.observation.sys_status
    return status is not None and not sensors.safety_switch_on(status.message)
