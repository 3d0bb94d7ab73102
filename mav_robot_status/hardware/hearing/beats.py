"""HEARTBEAT, and what a reboot, an arming and a long silence end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ...interface.status import TriState
from ...mavlink.definitions import Heartbeat
from .. import boot as boot_rules
from .. import causes, estop, motion, outputs, sensors, statustext
from ..flight_mode import is_initialising
from ..identity import Stack
from ..memory import begin
from ..observation import Observation, heard
from ..pulse import armed_before, next_beat
from .words import pass_time

if TYPE_CHECKING:
    from ...clock import Instant
    from ..memory import Memory
    from ..options import HardwareOptions

LONG_LOSS: Final = 30.0
"""Seconds of link loss after which nothing that was latched is believed."""
TURN: Final = 10.0
"""Seconds within which two autopilots with the same ids take turns."""
UNINIT, BOOT, STANDBY = 0, 1, 3  # MAV_STATE


def heartbeat(memory: Memory, message: Heartbeat, now: Instant, options: HardwareOptions) -> Memory:
    """A HEARTBEAT: edges of armed and state, stop values, and whether the autopilot has started anew."""
    if (message.autopilot, message.type) != (memory.autopilot, memory.vehicle_type):
        return _another(memory, message, now)
    last = memory.pulse.runs[-1].last
    memory = pass_time(memory, now, options)
    before = memory.pulse
    previous: Heartbeat = memory.observation.heartbeat.message if memory.observation.heartbeat else message
    connected = now.mono - last <= options.heartbeat_timeout
    pulse = next_beat(before, message, now, connected)
    memory = memory._replace(
        observation=memory.observation._replace(heartbeat=heard(message, now.mono, memory.observation.heartbeat)),
        pulse=pulse,
        watch=outputs.heard_beat(memory.watch, pulse, before, _outputs_enabled(memory), memory.vehicle_type, now.mono),
    )
    if _starts_anew(previous, message, memory):
        memory = rebooted(memory, boot_rules.Boot(now.mono), now)
    if now.mono - last > LONG_LOSS:
        memory = memory._replace(latches=causes.NO_LATCHES, stop=estop.NOTHING, not_ready=None, failsafe=None)
    if not connected:
        memory = memory._replace(
            stop=memory.stop._replace(ready=0), motion=motion.UNKNOWN, gps_motion=motion.UNKNOWN, assumed_free=False
        )
    if pulse.armed and not before.armed:
        memory = _armed(memory, last, now)
    elif before.armed and not pulse.armed:
        memory = memory._replace(stop=memory.stop._replace(ready=0), assumed_free=False)
    return memory._replace(failsafe=None) if pulse.calm_since == now.mono else memory


def _another(memory: Memory, message: Heartbeat, now: Instant) -> Memory:
    """Another autopilot: nothing that was said of the old one counts. Two that take turns claim the same ids."""
    new = begin(message, now)._replace(boots=memory.boots, formerly=(memory.autopilot, memory.vehicle_type))
    in_turn = memory.formerly == (message.autopilot, message.type) and now.mono - memory.pulse.since.mono <= TURN
    if not in_turn:
        return new
    kept = {code: latch for code, latch in memory.latches.items() if code == 9002}
    return new._replace(latches=causes.announce(kept, 9002, None, now, "HEARTBEAT.type and autopilot"))


def _starts_anew(previous: Heartbeat, message: Heartbeat, memory: Memory) -> bool:
    """The heartbeat says that the autopilot is starting, and the one before said that it had."""
    state, before = message.system_status, previous.system_status
    if state == BOOT and before >= STANDBY:
        return True
    if state == UNINIT and before >= STANDBY and memory.stack is not Stack.PX4:
        return True
    starting = is_initialising(message, memory.stack, memory.family)
    return starting and not is_initialising(previous, memory.stack, memory.family)


def rebooted(memory: Memory, boot: boot_rules.Boot, now: Instant) -> Memory:
    """After a reboot nothing that the old run said counts; one while armed is an error."""
    latches: causes.Latches = {}
    if 5004 in memory.latches or armed_before(memory.pulse, boot.at, LONG_LOSS):
        latches = causes.announce(latches, 5004, None, now, "time_boot_ms")
    observation = memory.observation
    status = observation.sys_status
    return memory._replace(
        observation=Observation(
            heartbeat=observation.heartbeat,
            sys_status=status if status is not None and status.at > boot.at else None,
        ),
        boot=boot,
        faults=sensors.NO_FAULTS,
        latches=latches,
        stop=estop.NOTHING,
        motion=motion.UNKNOWN,
        gps_motion=motion.UNKNOWN,
        watch=outputs.Watch(functions=memory.watch.functions),
        texts=statustext.EMPTY,
        not_ready=None,
        failsafe=None,
        internal_errors_since=None,
        rc_lost_since=None,
        assumed_free=False,
        event=None,
        boots=memory.boots + 1,
    )


def _armed(memory: Memory, previous_beat: float, now: Instant) -> Memory:
    """Arming acknowledges: it is refused while stopped or crashed, so what was said before is over.

    What was said since the heartbeat before stays: it may have been said after the arming.
    """
    latches = {
        code: latch
        for code, latch in memory.latches.items()
        if causes.CAUSES[code].clears is not causes.Clears.ARMING or latch.last > previous_beat
    }
    stop = memory.stop
    free = stop.ready >= estop.READY_MESSAGES or estop.still_said(stop, now.mono) is TriState.FALSE
    new = stop.said is TriState.TRUE and stop.last > previous_beat and not stop.repeats
    return memory._replace(
        latches=latches,
        stop=stop._replace(ready=0) if new else estop.NOTHING,
        not_ready=None,
        assumed_free=free and not new,
    )


def _outputs_enabled(memory: Memory) -> bool:
    status = memory.observation.sys_status
    return status is not None and not sensors.safety_switch_on(status.message)
