"""The events that need no table: their ids, and where their arguments are.

Arguments are little-endian, in order, without padding.
"""

from __future__ import annotations

from struct import Struct
from typing import TYPE_CHECKING, Final

from ..faults import causes

if TYPE_CHECKING:
    from ....mavlink.definitions import Event

AUTOPILOT: Final = 1
"""The component id of the name space of PX4's own events."""
ALL_MODES: Final = 0xFFFFFFFF
"""The mask of every mode group (PX4: `NavModes::All`)."""
PROTOCOL: Final = 8
"""The log level of an event that is not shown (libevents: `Log::Protocol`). Less urgent than any other."""


def event_id(name: str, component: int = AUTOPILOT) -> int:
    """The id of an event: the component above the lower 24 bits of the FNV-1a hash of the name."""
    digest = 0x811C9DC5
    for byte in name.encode():
        digest = (digest ^ byte) * 0x01000193 & 0xFFFFFFFF
    return component << 24 | digest & 0xFFFFFF


ARMING_SUMMARY: Final = event_id("commander_arming_check_summary")
"""Begins a report of the arming checks."""
HEALTH_SUMMARY: Final = event_id("commander_health_summary")
"""Ends it. Between them is one event for each failing check."""
SUMMARY: Final = Struct("<BIIII")
"""ARMING_SUMMARY: chunk, components with errors and with warnings, mode groups that can be armed and that can run.
HEALTH_SUMMARY: chunk, components present, with errors, with warnings."""
CHECK: Final = Struct("<IB")
"""The first arguments of a failing check: the mask of the mode groups, and the index of the health component."""

HEALTH_COMPONENTS: Final = (
    "none absolute_pressure differential_pressure gps optical_flow vision_position distance_sensor remote_control "
    "motors_escs utm logging battery communication_links rate_controller attitude_controller position_controller "
    "attitude_estimate local_position_estimate mission avoidance system camera gimbal payload "
    "global_position_estimate storage parachute magnetometer accel gyro open_drone_id traffic_avoidance"
).split()
"""The health components by index (PX4, src/lib/events/enums.json)."""

FAILSAFE_CAUSES: Final = {
    1: causes.RC_LOST,
    2: causes.GCS_LOST,
    3: causes.BATTERY_LOW,
    4: causes.BATTERY_CRITICAL,
    5: causes.BATTERY_CRITICAL,
    6: causes.BATTERY_LOW,  # the remaining flight time is that of the battery
}
"""By PX4's `failsafe_cause_t`. 0 is any other cause."""
CAUSE_AT: Final = {
    event_id("commander_failsafe_enter"): 5,  # after the mode and the action
    event_id("commander_failsafe_enter_hold"): 7,  # after the mode, the action and the delay
    event_id("commander_failsafe_enter_warn"): 4,  # after the mode
}
"""The place of the cause in the arguments of the events that begin a failsafe."""
NAMED_CAUSES: Final = {
    event_id("commander_failsafe_enter_low_bat"): causes.BATTERY_LOW,
    event_id("commander_failsafe_enter_crit_bat_warn"): causes.BATTERY_CRITICAL,
    event_id("commander_failsafe_enter_crit_low_bat_warn"): causes.BATTERY_CRITICAL,
    event_id("commander_failsafe_enter_low_flight_time_warn"): causes.BATTERY_LOW,
}
"""The events that name the cause of a failsafe themselves (PX4: `Commander`, `onNotifyUser` of the failsafe)."""


def failsafe_cause(event: Event) -> int | None:
    """The code of the failsafe that an event reports exactly; None if it reports none, or any other cause."""
    place = CAUSE_AT.get(event.id)
    if place is None:
        return NAMED_CAUSES.get(event.id)
    arguments = event.arguments
    return FAILSAFE_CAUSES.get(arguments[place]) if place < len(arguments) else None


def component_name(index: int) -> str:
    """The name of a health component."""
    return HEALTH_COMPONENTS[index] if index < len(HEALTH_COMPONENTS) else f"component {index}"
