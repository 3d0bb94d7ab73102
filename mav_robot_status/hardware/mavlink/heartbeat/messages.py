"""HEARTBEAT, and the state that a reboot, an arming and a long silence reset."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ....mavlink.decode import text
from ....mavlink.definitions import AutopilotVersion, AvailableModes, CurrentMode, Heartbeat
from ....mavlink.enumerations import MAV_STATE_BOOT, MAV_STATE_FLIGHT_TERMINATION, MAV_STATE_STANDBY, MAV_STATE_UNINIT
from ..autopilots import firmware
from ..autopilots.modes import AvailableMode
from ..autopilots.profile import EmergencyStop, Uninit
from ..estop import outputs
from ..estop import state as estop
from ..estop.messages import look_again
from ..faults import causes, latches, sensors
from ..faults.texts import pass_time
from ..identity import Family
from ..motion.state import Motion
from ..px4_events import sequence as event_sequence
from ..readiness import arming_report
from ..readiness import state as readiness
from ..satellite.state import is_statement
from ..state import LatestMessages, ToldFirmware, VehicleState, begin, heard, timeout_of
from .state import armed_before, next_heartbeat

if TYPE_CHECKING:
    from ....clock import Instant
    from ..options import HardwareOptions
    from ..state import VehicleState

SUDDEN: Final = 0.3
"""Seconds after an armed HEARTBEAT within which a disarmed one is not believed alone: the interval is 1 s."""
LONG_LOSS: Final = 30.0
"""Seconds of link loss after which all latched state is invalid."""
LONGEST_START: Final = 10.0
"""Seconds from the first heartbeat to the text that ends the start."""
FLIES: Final = frozenset({Family.COPTER, Family.PLANE})
"""An autopilot does not disarm these in motion, but for a crash, a termination or a forced disarm."""
TICKS: Final = 1.5
"""Seconds within which a clock counts as running."""


def heartbeat(state: VehicleState, message: Heartbeat, now: Instant, options: HardwareOptions) -> None:
    """A HEARTBEAT: edges of armed and state, stop values, and whether the autopilot has rebooted."""
    satellite, state.high_latency = state.high_latency, None
    is_another = (message.autopilot, message.type) != (state.autopilot, state.vehicle_type)
    if is_another or (satellite is not None and _sent_none(state)):
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
    seen.heartbeat = heard(message, now.mono, seen.heartbeat)
    _look_for_reboot(state, previous, message, now)
    if now.mono - last > LONG_LOSS:
        state.latches, state.readiness = latches.NO_LATCHES, readiness.NOTHING
        state.failsafe_cleared = state.failsafe = None
    if not connected:
        _reconnected(state, now)
    if heartbeats.armed:
        state.disarmed_at, state.unexplained = None, False
        if not (before.armed and connected):
            state.armed_after = seen.sys_status.message if seen.sys_status is not None else None
        if not before.armed:
            _armed(state, last, now)
    elif before.armed:
        _disarmed(state, last, now)
    if state.profile.stops.shown_by is EmergencyStop.STATE and message.system_status == MAV_STATE_FLIGHT_TERMINATION:
        state.stop = estop.NOTHING  # its state shows its stops, so what it said is not needed
    look_again(state, now.mono)
    if heartbeats.calm_since == now.mono:
        state.failsafe = None
        state.latches = latches.calmed(state.latches, before.state_since.mono)


def _look_for_reboot(state: VehicleState, previous: Heartbeat, message: Heartbeat, now: Instant) -> None:
    """A HEARTBEAT, or a text since the one before, may say that the autopilot starts."""
    if starts_anew(previous, message, state):
        rebooted(state, now.mono, now)
    if state.started_at is not None:
        started, state.started_at = state.started_at, None
        if _is_another_run(state, started):
            rebooted(state, started, now)


def _reconnected(state: VehicleState, now: Instant) -> None:
    """The first HEARTBEAT after a link loss: what may have changed in between is invalid."""
    state.motion, state.gps_motion, state.rotation = Motion(), Motion(), Motion()
    state.stop = estop.unsure(state.stop, estop.LINK_LOST, now.mono)._replace(ready=0)
    state.arming = arming_report.NOTHING  # a newer one may be lost
    state.assumed_free = False


def _disarmed(state: VehicleState, previous_beat: float, now: Instant) -> None:
    """The first disarmed HEARTBEAT after an armed one."""
    if now.mono - previous_beat < SUDDEN:
        state.told_armed = now.mono + 1e-6
    if state.motion.value is TriState.TRUE and state.family in FLIES:
        state.disarmed_at = now.mono
        state.note_loss(state.lost_at)
    state.stop = state.stop._replace(ready=0)
    state.assumed_free = False


def _another(state: VehicleState, message: Heartbeat, now: Instant) -> None:
    """Another autopilot: the state of the old one is invalid."""
    new = begin(message, now)
    new.boots = state.boots
    state.become(new)


def _sent_none(state: VehicleState) -> bool:
    """Whether a vehicle sent no HEARTBEAT before, only HIGH_LATENCY2."""
    beat = state.latest.heartbeat
    return beat is not None and is_statement(beat.message)


def starts_anew(previous: Heartbeat, message: Heartbeat, state: VehicleState) -> bool:
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
    return not ticks and started - state.booted > LONGEST_START


def exchanged(state: VehicleState, booted: float, now: Instant) -> None:
    """The clock is ahead of every one before: another vehicle has these ids now."""
    beat = state.latest.heartbeat
    assert beat is not None  # a state begins with a heartbeat
    new = begin(beat.message, now)
    new.booted, new.has_clock, new.boots, new.heartbeats = booted, True, state.boots + 1, state.heartbeats
    new.latest.heartbeat, new.told_armed = beat, now.mono
    state.become(new)


def rebooted(state: VehicleState, booted: float, now: Instant, *, by_clock: bool = False) -> None:
    """After a reboot the state of the old run is invalid. A reboot while armed is an error."""
    seen = state.latest
    status = seen.sys_status if seen.sys_status is not None and seen.sys_status.at > booted else None
    counts_anew = state.events.since > booted
    new = VehicleState(
        latest=LatestMessages(heartbeat=seen.heartbeat, sys_status=status),
        heartbeats=state.heartbeats,
        booted=booted,
        has_clock=by_clock,
        vehicle_type=state.vehicle_type,
        autopilot=state.autopilot,
        shown=state.shown,
        watch=outputs.Watch(functions=state.watch.functions),
        switches=state.switches,
        modes=state.modes,
        firmware=state.firmware if state.firmware is not None and state.firmware.at > booted else None,
        asked=state.asked,
        events=state.events if counts_anew else event_sequence.NOTHING,
        arming=state.arming if counts_anew else arming_report.NOTHING,
        boots=state.boots + 1,
    )
    armed = causes.REBOOT_WHILE_ARMED in state.latches or armed_before(state.heartbeats, booted, LONG_LOSS)
    if armed:
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


MOST_MODES: Final = 256


def current_mode(state: VehicleState, message: CurrentMode, now: Instant, options: HardwareOptions) -> None:
    """CURRENT_MODE: the present standard mode."""
    seen = state.latest
    seen.current_mode = heard(message, now.mono, seen.current_mode)


def available_modes(state: VehicleState, message: AvailableModes, now: Instant, options: HardwareOptions) -> None:
    """AVAILABLE_MODES: one entry of the autopilot's list, with its name."""
    if message.custom_mode not in state.modes and len(state.modes) >= MOST_MODES:
        return
    name = text(message.mode_name)
    mode = AvailableMode(name, message.standard_mode, message.properties)
    state.modes = {**state.modes, message.custom_mode: mode}


def autopilot_version(state: VehicleState, message: AutopilotVersion, now: Instant, options: HardwareOptions) -> None:
    """AUTOPILOT_VERSION: the version of the firmware."""
    version = firmware.of_number(message.flight_sw_version)
    if version is not None:
        state.firmware = ToldFirmware(version, now.mono, f"AUTOPILOT_VERSION {version}")
