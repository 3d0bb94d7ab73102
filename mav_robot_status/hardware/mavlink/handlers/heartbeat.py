"""HEARTBEAT, and the state that a reboot, an arming and a long silence reset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ....mavlink.definitions import Heartbeat
from ....mavlink.enumerations import (
    MAV_STATE_BOOT,
    MAV_STATE_FLIGHT_TERMINATION,
    MAV_STATE_STANDBY,
    MAV_STATE_UNINIT,
)
from .. import causes
from ..autopilots.profile import EmergencyStop, Uninit
from ..state import applet as applet_rules
from ..state import arming_report, estop, event_sequence, latches, outputs, readiness, sensors
from ..state import boot_clock as boot_rules
from ..state.heartbeat_history import armed_before, next_heartbeat
from ..state.high_latency import is_statement
from ..state.latest_messages import LatestMessages, heard
from ..state.motion import Motion
from ..state.vehicle_state import VehicleState, begin, honours_stop, timeout_of
from .outputs import look_again
from .statustext import pass_time

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions

LONG_LOSS: Final = 30.0
"""Seconds of link loss after which all latched state is invalid."""
LONGEST_START: Final = 10.0
"""Seconds from the first heartbeat to the text that ends the start."""
TICKS: Final = 1.5
"""Seconds within which a clock counts as running."""
BACK: Final = 10.0
"""Seconds after the link returns within which the clock shows whether this is the same vehicle."""


def heartbeat(state: VehicleState, message: Heartbeat, now: Instant, options: HardwareOptions) -> None:
    """A HEARTBEAT: edges of armed and state, stop values, and whether the autopilot has rebooted."""
    if (message.autopilot, message.type) != (state.autopilot, state.vehicle_type):
        _another(state, message, now)
        return
    if state.high_latency is not None:
        state.high_latency = None
        if _sent_none(state):
            _another(state, message, now)
            return
    pass_time(state, now, options)
    before = state.heartbeats
    last = before.runs[-1].last
    connected = now.mono - last <= timeout_of(state, options)
    heartbeats = state.heartbeats = next_heartbeat(before, message, now, connected)
    enabled = not heartbeats.armed and _outputs_enabled(state)
    outputs.heartbeat_arrived(state.watch, heartbeats, before, enabled, state.vehicle_type, now.mono)
    seen = state.latest
    previous: Heartbeat = seen.heartbeat.message if seen.heartbeat else message
    seen.heartbeat = heard(seen, message, now.mono, seen.heartbeat)
    if message != previous:
        seen.unsettled = True
        if _starts_anew(previous, message, state):
            rebooted(state, boot_rules.BootClock(now.mono), now)
    if state.started_at is not None:
        started, state.started_at = state.started_at, None
        if _is_another_run(state, started):
            rebooted(state, boot_rules.BootClock(started), now)
    if now.mono - last > LONG_LOSS:
        state.latches = latches.NO_LATCHES
        state.failsafe_cleared = None
        state.failsafe = None
        state.readiness = readiness.NOTHING
    if not connected:
        state.motion, state.gps_motion, state.rotation = Motion(), Motion(), Motion()
        state.stop = estop.unsure(state.stop, estop.LINK_LOST, now.mono)
        state.arming = arming_report.NOTHING  # a newer one may be lost
    if heartbeats.armed and not (before.armed and connected):
        state.armed_after = seen.sys_status.message if seen.sys_status is not None else None
    if not connected or (before.armed and not heartbeats.armed):
        state.stop = state.stop._replace(ready=0)
        state.assumed_free = False
    if heartbeats.armed and not before.armed:
        _armed(state, last, now)
    if state.profile.stops.shown_by is EmergencyStop.STATE and message.system_status == MAV_STATE_FLIGHT_TERMINATION:
        state.stop = estop.NOTHING  # its state shows its stops, so what it said is not needed
    look_again(state, now.mono)
    if heartbeats.calm_since == now.mono:
        state.failsafe = None
        state.latches = latches.calmed(state.latches, before.state_since.mono)
        seen.unsettled = True


def changed_way(state: VehicleState, now: float) -> None:
    """Another way of the vehicle counts now, and nothing shows that it is the same vehicle.

    What was said or shown of a stop may be that of another one: a doubt remains.
    """
    word, status = state.applet, state.latest.sys_status
    if word is not None:
        state.applet = None
        if applet_rules.stops(word, honours_stop(state)):
            state.stop = estop.doubted(state.stop, estop.ANOTHER_WAY, now)
    if status is not None and sensors.safety_switch_on(status.message):
        state.latest.sys_status = None
    state.stop = estop.unsure(state.stop, estop.ANOTHER_WAY, now)
    state.asked = ()
    state.latches = latches.clear(state.latches, (causes.TERMINATION_ANNOUNCED,))


def _another(state: VehicleState, message: Heartbeat, now: Instant) -> None:
    """Another autopilot: the state of the old one is invalid."""
    new = begin(message, now, state.claims)
    new.boots = state.boots
    state.become(new)


def _sent_none(state: VehicleState) -> bool:
    """Whether a vehicle sent no HEARTBEAT before, only HIGH_LATENCY2."""
    beat = state.latest.heartbeat
    return beat is not None and is_statement(beat.message)


def _starts_anew(previous: Heartbeat, message: Heartbeat, state: VehicleState) -> bool:
    """The heartbeat reports that the autopilot is starting, and the one before reported that it was running."""
    now_in, was_in = message.system_status, previous.system_status
    if now_in == MAV_STATE_BOOT and was_in >= MAV_STATE_STANDBY:
        return True
    if now_in == MAV_STATE_UNINIT and was_in >= MAV_STATE_STANDBY and state.profile.states.uninit is Uninit.STARTING:
        return True
    starting = state.profile.modes.initialising.get(state.family)
    return starting is not None and message.custom_mode == starting != previous.custom_mode


def _is_another_run(state: VehicleState, started: float) -> bool:
    """Whether a text that only a starting autopilot sends comes from another run than the known one.

    If a clock still arrives, the clock decides. Otherwise a run that was known for longer than a start takes has ended.
    """
    seen = state.latest
    clocks = (seen.attitude, seen.global_position, seen.local_position)
    ticks = any(clock is not None and started - clock.at < TICKS for clock in clocks)
    return not ticks and started - state.boot.at > LONGEST_START


def clock_changed(state: VehicleState, now: Instant) -> None:
    """The clock gives another boot time: a reboot, two clocks, or a correction, which matters only for faults."""
    boot = state.boot
    if boot.in_turn:
        state.claims.contradict("time_boot_ms of two clocks in turn", state.claims.way, now)
        state.latest.unsettled = True
    if boot.rebooted:
        rebooted(state, boot, now)
    elif boot.ahead and _is_back(state, now.mono):
        _exchanged(state, now)
    elif state.faults:
        state.latest.unsettled = True


def _is_back(state: VehicleState, now: float) -> bool:
    """Whether the link was lost, and came back not long ago."""
    since = state.heartbeats.since.mono
    return now - since <= BACK and state.heartbeats.runs[0].first < since


def _exchanged(state: VehicleState, now: Instant) -> None:
    """After a loss of the link the clock is far ahead: another vehicle, which has run for longer, has these ids now."""
    beat = state.latest.heartbeat
    assert beat is not None  # a state begins with a heartbeat
    new = begin(beat.message, now, state.claims)
    new.boot, new.boots, new.heartbeats = state.boot, state.boots + 1, state.heartbeats
    new.latest.heartbeat = beat
    state.become(new)


def rebooted(state: VehicleState, boot: boot_rules.BootClock, now: Instant) -> None:
    """After a reboot the state of the old run is invalid. A reboot while armed is an error."""
    seen = state.latest
    status = seen.sys_status if seen.sys_status is not None and seen.sys_status.at > boot.at else None
    counts_anew = state.events.since > boot.at
    new = VehicleState(
        latest=LatestMessages(heartbeat=seen.heartbeat, sys_status=status),
        heartbeats=state.heartbeats,
        boot=boot,
        vehicle_type=state.vehicle_type,
        autopilot=state.autopilot,
        shown=state.shown,
        watch=outputs.Watch(functions=state.watch.functions),
        switches=state.switches,
        modes=state.modes,
        firmware=state.firmware if state.firmware is not None and state.firmware.at > boot.at else None,
        asked=state.asked,
        events=state.events if counts_anew else event_sequence.NOTHING,
        arming=state.arming if counts_anew else arming_report.NOTHING,
        boots=state.boots + 1,
        claims=state.claims,
    )
    armed = causes.REBOOT_WHILE_ARMED in state.latches or armed_before(state.heartbeats, boot.at, LONG_LOSS)
    if armed and not boot.in_turn:
        new.latches = latches.announce(new.latches, causes.REBOOT_WHILE_ARMED, None, now, "time_boot_ms")
    state.become(new)


def _armed(state: VehicleState, previous_beat: float, now: Instant) -> None:
    """Arming ends earlier reports of stops and crashes, because the autopilot refuses to arm while they last.

    Reports since the previous heartbeat stay: they may be later than the arming.
    """
    state.latches = {
        code: latch
        for code, latch in state.latches.items()
        if causes.CAUSES[code].clears is not causes.Clears.ARMING or latch.last > previous_beat
    }
    stop = state.stop
    checked = stop.ready >= estop.READY_MESSAGES and not estop.is_excused(state.switches)
    free = checked or estop.still_said(stop, now.mono) is TriState.FALSE
    new = (stop.said is TriState.TRUE or stop.doubt is not None) and stop.last > previous_beat and not stop.repeats
    if new:
        state.stop = stop._replace(ready=0)
    else:
        state.stop = estop.unsure(stop, estop.ARMED, now.mono) if _may_arm_stopped(state) else estop.NOTHING
    state.readiness = readiness.NOTHING
    state.assumed_free = free and not new


def _may_arm_stopped(state: VehicleState) -> bool:
    """Whether this firmware may be armed while it is stopped, so that an arming does not prove a release."""
    profile = state.profile
    checked = estop.includes_stop(profile, state.family, state.version, state.reports_mission)
    return profile.stops.check is not None and not checked


def _outputs_enabled(state: VehicleState) -> bool:
    status = state.latest.sys_status
    return status is not None and not sensors.safety_switch_on(status.message)
