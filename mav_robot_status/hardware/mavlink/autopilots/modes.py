"""Flight modes: the form of a table, and MAVLink's standard modes and flags for autopilots without one.

MAV_STANDARD_MODE and MAV_MODE_FLAG of common.xml. Each determines who decides the next motion.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import RobotMode
from ....mavlink import enumerations as mavlink

if TYPE_CHECKING:
    from ....mavlink.definitions import Heartbeat
    from ..identity import Family

MANUAL, AUTO = RobotMode.MANUAL, RobotMode.AUTO

ModeTable = dict[int, tuple[str, RobotMode]]
"""custom_mode -> (name, who decides the next motion)."""

STANDARD_MODES: Final[ModeTable] = {
    mavlink.MAV_STANDARD_MODE_POSITION_HOLD: ("POSITION_HOLD", MANUAL),
    mavlink.MAV_STANDARD_MODE_ORBIT: ("ORBIT", AUTO),
    mavlink.MAV_STANDARD_MODE_CRUISE: ("CRUISE", MANUAL),
    mavlink.MAV_STANDARD_MODE_ALTITUDE_HOLD: ("ALTITUDE_HOLD", MANUAL),
    mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY: ("SAFE_RECOVERY", AUTO),
    mavlink.MAV_STANDARD_MODE_MISSION: ("MISSION", AUTO),
    mavlink.MAV_STANDARD_MODE_LAND: ("LAND", AUTO),
    mavlink.MAV_STANDARD_MODE_TAKEOFF: ("TAKEOFF", AUTO),
}

PROPERTY_AUTO_MODE: Final = 4  # MAV_MODE_PROPERTY_AUTO_MODE, which pymavlink's definitions do not have yet

# MAV_MODE_FLAG, in the order in which they decide.
BASE_MODE_FLAGS: Final[tuple[tuple[int, str, RobotMode], ...]] = (
    (mavlink.MAV_MODE_FLAG_AUTO_ENABLED | mavlink.MAV_MODE_FLAG_GUIDED_ENABLED, "AUTO or GUIDED", AUTO),
    (
        mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED,
        "MANUAL_INPUT or STABILIZE",
        MANUAL,
    ),
)


class AvailableMode(NamedTuple):
    """The autopilot's description of one of its modes (AVAILABLE_MODES)."""

    name: str
    standard_mode: int
    properties: int


class FlightMode(NamedTuple):
    """The mode that the vehicle flies or drives in."""

    mode: RobotMode
    name: str | None
    """None without a custom mode."""
    rule: str


class ModeHints(NamedTuple):
    """The mode according to messages other than HEARTBEAT."""

    available: AvailableMode | None = None
    """The AVAILABLE_MODES entry of the mode."""
    standard_mode: int = mavlink.MAV_STANDARD_MODE_NON_STANDARD
    """MAV_STANDARD_MODE of a fresh CURRENT_MODE that names this mode."""


ModeRule = Callable[["Heartbeat", "Family", ModeHints], FlightMode]


def by_table(tables: Mapping[Family, ModeTable], named: str) -> ModeRule:
    """The rule of an autopilot with one table for each family; `named` is the name of a table, {} the family.

    custom_mode alone decides: ArduPilot sets GUIDED in base_mode in pilot modes.
    """

    def flight_mode(heartbeat: Heartbeat, family: Family, hints: ModeHints) -> FlightMode:
        return look_up(tables.get(family, {}), heartbeat.custom_mode, named.format(family.value), hints)

    return flight_mode


def look_up(table: ModeTable, number: int, rule: str, hints: ModeHints) -> FlightMode:
    """The mode with this number in the table; UNKNOWN if the table lacks it."""
    if number in table:
        name, mode = table[number]
        return FlightMode(mode, name, rule)
    return FlightMode(RobotMode.UNKNOWN, other_name(number, hints), f"mode {number} is not in {rule}")


def standard(heartbeat: Heartbeat, family: Family, hints: ModeHints) -> FlightMode:
    """The rule of an autopilot without a table: its standard mode, else its mode's properties, else base_mode."""
    number, entry = heartbeat.custom_mode, hints.available
    custom = bool(heartbeat.base_mode & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
    name = other_name(number, hints) if custom or entry else None
    if hints.standard_mode in STANDARD_MODES:
        standard_name, mode = STANDARD_MODES[hints.standard_mode]
        return FlightMode(mode, name, f"CURRENT_MODE.standard_mode {standard_name}")
    if entry is not None and entry.standard_mode in STANDARD_MODES:
        standard_name, mode = STANDARD_MODES[entry.standard_mode]
        return FlightMode(mode, name, f"AVAILABLE_MODES.standard_mode {standard_name}")
    if entry is not None and entry.properties & PROPERTY_AUTO_MODE:
        return FlightMode(AUTO, name, "AVAILABLE_MODES property AUTO_MODE")
    for flags, words, mode in BASE_MODE_FLAGS:
        if heartbeat.base_mode & flags:
            return FlightMode(mode, name, f"base_mode {words}")
    return FlightMode(RobotMode.UNKNOWN, name, "base_mode says nothing")


def other_name(number: int, hints: ModeHints, otherwise: str | None = None) -> str:
    """The name of a mode without a table entry."""
    if hints.available is not None and hints.available.name:
        return hints.available.name
    return otherwise if otherwise is not None else f"CMODE({number})"
