"""mode: who decides the next motion, a person or a program, from the tables in `modes/`.

ArduPilot and PX4 are told by custom_mode alone: their base_mode flags mislead (ArduPilot sets GUIDED in pilot modes,
PX4's OFFBOARD sets neither MANUAL nor AUTO). INAV, speaking as ArduPilot, uses ArduPlane's numbers for all but copters.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ..interface.status import RobotMode
from .identity import CUSTOM_MODE, Family, Stack
from .modes import ardupilot, px4, standard
from .observation import is_fresh

if TYPE_CHECKING:
    from ..mavlink.definitions import Heartbeat
    from .observation import Heard

CURRENT_MODE_FRESH: Final = 5.0  # seconds

ARDUPILOT_TABLES: Final = {
    Family.COPTER: ardupilot.COPTER,
    Family.PLANE: ardupilot.PLANE,
    Family.ROVER: ardupilot.ROVER,
    Family.SUB: ardupilot.SUB,
    Family.TRACKER: ardupilot.TRACKER,
    Family.BLIMP: ardupilot.BLIMP,
}
INITIALISING_FAMILIES: Final = frozenset({Family.PLANE, Family.ROVER, Family.TRACKER})
# INAV's "no valid mapping" and beyond
INAV_LIMITS: Final = {Family.COPTER: 22, Family.PLANE: 23}


class AvailableMode(NamedTuple):
    """What the autopilot says of one of its modes (AVAILABLE_MODES)."""

    name: str
    standard_mode: int
    properties: int


class FlightMode(NamedTuple):
    """The mode that the vehicle flies or drives in."""

    mode: RobotMode
    name: str | None
    """None where there is no custom mode."""
    rule: str


class ModeSources(NamedTuple):
    """What beside the heartbeat tells of modes."""

    available: Mapping[int, AvailableMode] = {}
    current: Heard | None = None
    overrides: Mapping[Any, Mapping[int, RobotMode]] = {}


def flight_mode(heartbeat: Heartbeat, stack: Stack, family: Family, sources: ModeSources, now: float) -> FlightMode:
    """The flight mode of a heartbeat: the user's override, then the autopilot's table, then what MAVLink offers."""
    number = heartbeat.custom_mode
    key = "px4" if stack is Stack.PX4 else family.value
    override = sources.overrides.get(key, {}).get(number)
    if stack is Stack.PX4:
        found = _px4(number, sources)
    elif stack is Stack.ARDUPILOT:
        found = _table(ARDUPILOT_TABLES.get(family, {}), number, f"ArduPilot's {family.value} table", sources)
    elif stack is Stack.INAV:
        found = _inav(number, family, sources)
    else:
        found = _standard(heartbeat, sources, now)
    return found._replace(mode=override, rule="mode_overrides") if override is not None else found


def is_initialising(heartbeat: Heartbeat, stack: Stack, family: Family) -> bool:
    """True while an ArduPilot says in its mode that it is still starting."""
    return (
        heartbeat.custom_mode == ardupilot.INITIALISING and stack is Stack.ARDUPILOT and family in INITIALISING_FAMILIES
    )


def _table(table: ardupilot.ModeTable, number: int, rule: str, sources: ModeSources) -> FlightMode:
    if number in table:
        name, mode = table[number]
        return FlightMode(mode, name, rule)
    return FlightMode(RobotMode.UNKNOWN, _other_name(number, sources), f"mode {number} is not in {rule}")


def _px4(number: int, sources: ModeSources) -> FlightMode:
    main, sub = number >> 16 & 0xFF, number >> 24 & 0xFF
    if (main, sub) in px4.SUB:
        name, mode = px4.SUB[main, sub]
    elif main in px4.MAIN:
        main_name, mode = px4.MAIN[main]
        name = main_name if sub == 0 else _other_name(number, sources, f"{main_name}.{sub}")
    else:
        return FlightMode(RobotMode.UNKNOWN, _other_name(number, sources), f"main mode {main} is not in PX4's table")
    return FlightMode(mode, name, "PX4's table")


def _inav(number: int, family: Family, sources: ModeSources) -> FlightMode:
    told_as = Family.COPTER if family is Family.COPTER else Family.PLANE
    if number >= INAV_LIMITS[told_as]:
        return FlightMode(RobotMode.UNKNOWN, _other_name(number, sources), "INAV: no mapping for its mode")
    return _table(ARDUPILOT_TABLES[told_as], number, f"INAV in ArduPilot's {told_as.value} numbers", sources)


def _standard(heartbeat: Heartbeat, sources: ModeSources, now: float) -> FlightMode:
    """Every other autopilot: its standard mode, else its mode's properties, else the base_mode flags."""
    custom = bool(heartbeat.base_mode & CUSTOM_MODE)
    number = heartbeat.custom_mode
    entry = sources.available.get(number)
    name = _other_name(number, sources) if custom or entry else None
    current = sources.current
    if (
        current is not None
        and is_fresh(current, now, CURRENT_MODE_FRESH)
        and current.message.custom_mode == number
        and current.message.standard_mode in standard.STANDARD_MODES
    ):
        standard_name, mode = standard.STANDARD_MODES[current.message.standard_mode]
        return FlightMode(mode, name, f"CURRENT_MODE.standard_mode {standard_name}")
    if entry is not None and entry.standard_mode in standard.STANDARD_MODES:
        standard_name, mode = standard.STANDARD_MODES[entry.standard_mode]
        return FlightMode(mode, name, f"AVAILABLE_MODES.standard_mode {standard_name}")
    if entry is not None and entry.properties & standard.PROPERTY_AUTO_MODE:
        return FlightMode(RobotMode.AUTO, name, "AVAILABLE_MODES property AUTO_MODE")
    for flags, words, mode in standard.BASE_MODE_FLAGS:
        if heartbeat.base_mode & flags:
            return FlightMode(mode, name, f"base_mode {words}")
    return FlightMode(RobotMode.UNKNOWN, name, "base_mode says nothing")


def _other_name(number: int, sources: ModeSources, otherwise: str | None = None) -> str:
    entry = sources.available.get(number)
    if entry is not None and entry.name:
        return entry.name
    return otherwise if otherwise is not None else f"CMODE({number})"
