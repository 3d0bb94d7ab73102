"""HEARTBEAT: what the vehicle is, whether its messages are recent, and its flight mode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....mavlink.definitions import STATE_NAMES
from ....mavlink.enumerations import (
    MAV_LANDED_STATE_UNDEFINED,
    MAV_MODE_FLAG_HIL_ENABLED,
    MAV_STANDARD_MODE_NON_STANDARD,
)
from ..autopilots.modes import ModeHints
from ..facts import Facts, Fresh, Kind
from ..identity import named
from ..reason import Reason, at, words
from ..state import FRESH, timeout_of

if TYPE_CHECKING:
    from ....mavlink.definitions import Heartbeat
    from ..autopilots.modes import FlightMode
    from ..facts import Deadline, Facts
    from ..options import HardwareOptions
    from ..reason import Shown
    from ..state import VehicleState


CURRENT_MODE_FRESH: Final = 5.0
"""Seconds for which a CURRENT_MODE is valid."""

NO_HINTS: Final = ModeHints()


def kind(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Kind:
    """The kind of vehicle."""
    told = state.firmware
    return Kind(state.profile, state.family, state.vehicle_type, state.autopilot, told and told.firmware)


def heartbeat(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Heartbeat:
    """The latest heartbeat."""
    if state.high_latency is not None:
        return state.high_latency.statement
    seen = state.latest.heartbeat
    assert seen is not None  # a state begins with a heartbeat
    message: Heartbeat = seen.message
    return message


def state_since(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> int:
    """When it entered its MAV_STATE."""
    return state.heartbeats.state_since.unix_us


def fresh(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> Fresh:
    """Which messages are recent enough to be used."""
    latest, is_fresh = state.latest, deadline.is_fresh
    velocity = None
    for name, heard in (
        ("GLOBAL_POSITION_INT", latest.global_position),
        ("LOCAL_POSITION_NED", latest.local_position),
        ("VFR_HUD", latest.vfr_hud),
    ):
        if is_fresh(heard, FRESH):
            velocity = name
            break
    beat = state.high_latency or latest.heartbeat
    return Fresh(
        beat is not None and deadline.is_within(beat.at + timeout_of(state, options)),
        is_fresh(latest.sys_status, options.sys_status_timeout),
        is_fresh(latest.extended_sys_state, FRESH),
        velocity,
        velocity == "GLOBAL_POSITION_INT",
        is_fresh(latest.gps, FRESH),
        deadline.is_within(state.arrived + timeout_of(state, options)),
        beat is not None and state.told_armed > beat.at,
    )


def landed_state(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> int:
    """MAV_LANDED_STATE of the latest EXTENDED_SYS_STATE."""
    heard = state.latest.extended_sys_state
    return MAV_LANDED_STATE_UNDEFINED if heard is None else heard.message.landed_state


def mode_hints(state: VehicleState, deadline: Deadline, options: HardwareOptions) -> ModeHints:
    """The mode according to messages other than HEARTBEAT."""
    seen, current = state.latest.heartbeat, state.latest.current_mode
    if seen is None or (current is None and not state.modes):
        return NO_HINTS
    number = seen.message.custom_mode
    standard_mode = MAV_STANDARD_MODE_NON_STANDARD
    if current is not None and current.message.custom_mode == number and deadline.is_fresh(current, CURRENT_MODE_FRESH):
        standard_mode = current.message.standard_mode
    return ModeHints(state.modes.get(number), standard_mode)


def flight_mode(facts: Facts, options: HardwareOptions) -> FlightMode:
    """The flight mode: the site's override, else the meaning in the profile."""
    modes, family = facts.kind.profile.modes, facts.kind.family
    found = modes.flight_mode(facts.heartbeat, family, facts.mode_hints)
    overrides = options.mode_overrides.get(modes.overrides_key or family.value, {})
    override = overrides.get(facts.heartbeat.custom_mode)
    return found if override is None else found._replace(mode=override, rule="mode_overrides")


def is_simulated(facts: Facts) -> bool:
    """Whether the autopilot reports hardware-in-the-loop simulation."""
    return bool(facts.heartbeat.base_mode & MAV_MODE_FLAG_HIL_ENABLED)


def actuators_blocked(facts: Facts, options: HardwareOptions) -> bool:
    """Whether the simulation blocks the actuators."""
    return is_simulated(facts) and not options.treat_hil_as_live


def hides_armed(facts: Facts) -> bool:
    """Whether the heartbeat lacks the armed bit in a state in which that does not mean disarmed."""
    return not facts.armed and facts.heartbeat.system_status in facts.kind.profile.states.hides_armed


def is_initialising(facts: Facts) -> bool:
    """Whether the mode shows that the vehicle is still starting."""
    starting = facts.kind.profile.modes.initialising.get(facts.kind.family)
    return starting is not None and facts.heartbeat.custom_mode == starting


# -- evidence in words -------------------------------------------------------------------------------------------------


heartbeat_words: Final = words("HEARTBEAT", "heartbeat")
base_mode_words: Final = words("HEARTBEAT.base_mode {facts.heartbeat.base_mode}", "heartbeat")
custom_mode_words: Final = words("HEARTBEAT.custom_mode", "heartbeat")
mode_number_words: Final = words("HEARTBEAT.custom_mode {facts.heartbeat.custom_mode}", "heartbeat")


def state_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """The state by its name."""
    name = named(STATE_NAMES, facts.heartbeat.system_status)
    return f"HEARTBEAT.system_status {name}", at(state.latest.heartbeat)


def disarm_words(state: VehicleState, facts: Facts, reason: Reason) -> Shown:
    """What was said of a stop, if anything."""
    return state.stop.source, state.stop.last


UNEXPLAINED: Final = Reason("it was disarmed in motion, and frames that may tell why are lost", disarm_words)
