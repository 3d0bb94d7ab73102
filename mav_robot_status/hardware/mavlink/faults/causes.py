"""The causes of in_error: their codes, their order, and the conditions that end a latched one.

Codes are stable: they are never reused, and new ones are appended.
"""

from __future__ import annotations

from enum import Enum
from typing import Final, NamedTuple

from ....interface.status import ErrorCause
from ....mavlink.definitions import EXTENDED_SENSOR_NAMES, SENSOR_NAMES, SEVERITY_NAMES
from ....mavlink.enumerations import (
    MAV_SYS_STATUS_AHRS,
    MAV_SYS_STATUS_GEOFENCE,
    MAV_SYS_STATUS_SENSOR_BATTERY,
    MAV_SYS_STATUS_SENSOR_GPS,
    MAV_SYS_STATUS_SENSOR_RC_RECEIVER,
    MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL,
)

FLIGHT_TERMINATION: Final = 1001
TERMINATION_ANNOUNCED: Final = 1002
FAILSAFE: Final = 2000
RC_LOST: Final = 2001
GCS_LOST: Final = 2002
BATTERY_LOW: Final = 2003
BATTERY_CRITICAL: Final = 2004
ESTIMATOR: Final = 2005
TERRAIN: Final = 2006
TRAFFIC: Final = 2007
GPS: Final = 2008
GEOFENCE: Final = 2009
LEAK: Final = 2010
PRESSURE: Final = 2011
TEMPERATURE: Final = 2012
DEPTH_SENSOR: Final = 2013
BATTERY_FAULT: Final = 2014
OFFBOARD_LOST: Final = 2015
MISSION: Final = 2016
EMERGENCY: Final = 4000
CRASH: Final = 4001
HARD_LANDING: Final = 4002
THRUST_LOSS: Final = 4003
PARACHUTE: Final = 4004
YAW_IMBALANCE: Final = 4005
ATTITUDE_FAILURE: Final = 4006
ESC_FAILURE: Final = 4007
INTERNAL_ERROR: Final = 5001
CONFIGURATION: Final = 5002
WATCHDOG_RESET: Final = 5003
REBOOT_WHILE_ARMED: Final = 5004
TEXT_EMERGENCY: Final = 6000
TEXT_ALERT: Final = 6001
TEXT_CRITICAL: Final = 6002
LINK_LOST: Final = 9001
SYSTEM_ID_CONFLICT: Final = 9002
SENSOR: Final = 3000
"""Code of bit 0 of SYS_STATUS."""
EXTENDED_SENSOR: Final = 3100
"""Code of bit 0 of its extended word."""
TEXT: Final = TEXT_EMERGENCY
"""Code of an unclassified text of severity 0."""
EVENT: Final = 7000
"""Code of an EVENT of level 0."""


class Clears(Enum):
    """How a latch ends without a text that clears it."""

    FAILSAFE = "state not CRITICAL for 2 s, at the earliest 5 s after the text; or 5 s disarmed and not CRITICAL"
    HOLD = "a time without repetition"
    ARMING = "the next arming; an autopilot reboot"
    REBOOT = "an autopilot reboot"


class Cause(NamedTuple):
    """One row of the error table."""

    name: str
    priority: int
    """The lowest active one is published as error_code."""
    clears: Clears = Clears.REBOOT
    hold: float | None = None
    """Seconds after the last text."""
    worse: int | None = None
    """The code of the more severe cause. While that one is active, this one is not raised beside it."""
    shown_by: int | None = None
    """The bit of SYS_STATUS that shows the same condition. The latch does not end while that bit is an error."""


def _bit(mask: int) -> int:
    return mask.bit_length() - 1


CAUSES: Final[dict[int, Cause]] = {
    FLIGHT_TERMINATION: Cause("FLIGHT_TERMINATION", 1),
    TERMINATION_ANNOUNCED: Cause("TERMINATION_ANNOUNCED", 2),
    CRASH: Cause("CRASH", 3, Clears.ARMING),
    ATTITUDE_FAILURE: Cause("ATTITUDE_FAILURE", 4, Clears.ARMING),
    THRUST_LOSS: Cause("THRUST_LOSS", 5, Clears.ARMING, 30.0),
    PARACHUTE: Cause("PARACHUTE", 6, Clears.ARMING),
    HARD_LANDING: Cause("HARD_LANDING", 7, Clears.ARMING),
    EMERGENCY: Cause("EMERGENCY", 8),
    LEAK: Cause("LEAK", 9, Clears.HOLD, 45.0),
    BATTERY_CRITICAL: Cause("BATTERY_CRITICAL", 10, Clears.FAILSAFE, shown_by=_bit(MAV_SYS_STATUS_SENSOR_BATTERY)),
    ESTIMATOR: Cause("ESTIMATOR", 11, Clears.FAILSAFE, shown_by=_bit(MAV_SYS_STATUS_AHRS)),
    RC_LOST: Cause("RC_LOST", 12, Clears.FAILSAFE, shown_by=_bit(MAV_SYS_STATUS_SENSOR_RC_RECEIVER)),
    GCS_LOST: Cause("GCS_LOST", 13, Clears.FAILSAFE),
    BATTERY_LOW: Cause(
        "BATTERY_LOW",
        14,
        Clears.FAILSAFE,
        worse=BATTERY_CRITICAL,
        shown_by=_bit(MAV_SYS_STATUS_SENSOR_BATTERY),
    ),
    TERRAIN: Cause("TERRAIN", 15, Clears.FAILSAFE),
    TRAFFIC: Cause("TRAFFIC", 16, Clears.FAILSAFE),
    GPS: Cause("GPS", 17, Clears.HOLD, 60.0, shown_by=_bit(MAV_SYS_STATUS_SENSOR_GPS)),
    GEOFENCE: Cause("GEOFENCE", 18, Clears.HOLD, 30.0, shown_by=_bit(MAV_SYS_STATUS_GEOFENCE)),
    PRESSURE: Cause("PRESSURE", 19, Clears.HOLD, 65.0),
    TEMPERATURE: Cause("TEMPERATURE", 20, Clears.HOLD, 65.0),
    DEPTH_SENSOR: Cause("DEPTH_SENSOR", 21, Clears.HOLD, 30.0),
    YAW_IMBALANCE: Cause("YAW_IMBALANCE", 22, Clears.ARMING, 30.0),
    INTERNAL_ERROR: Cause("INTERNAL_ERROR", 23),
    CONFIGURATION: Cause("CONFIGURATION", 24, Clears.HOLD, 15.0),
    WATCHDOG_RESET: Cause("WATCHDOG_RESET", 25, Clears.ARMING),
    REBOOT_WHILE_ARMED: Cause("REBOOT_WHILE_ARMED", 26, Clears.ARMING),
    FAILSAFE: Cause("FAILSAFE", 27, Clears.FAILSAFE),
    ESC_FAILURE: Cause("ESC_FAILURE", 28),
    BATTERY_FAULT: Cause("BATTERY_FAULT", 29),
    OFFBOARD_LOST: Cause("OFFBOARD_LOST", 30),
    MISSION: Cause("MISSION", 31),
    SYSTEM_ID_CONFLICT: Cause("SYSTEM_ID_CONFLICT", 32, Clears.HOLD, 10.0),
    LINK_LOST: Cause("LINK_LOST", 33),
    **{EXTENDED_SENSOR + bit: Cause(f"SENSOR_{EXTENDED_SENSOR_NAMES.get(bit, bit)}", 200 + bit) for bit in range(32)},
    **{SENSOR + bit: Cause(f"SENSOR_{SENSOR_NAMES[bit]}", 100 + bit) for bit in range(31)},
    **{TEXT + level: Cause(f"TEXT_{SEVERITY_NAMES[level]}", 400 + level, Clears.HOLD) for level in range(3)},
    **{EVENT + level: Cause(f"EVENT_{level}", 500 + level, Clears.HOLD, 10.0) for level in range(3)},
}

SOFT_AFTER: Final = 50  # every SOFT bit ranks after every HARD one

TIMED_TEXTS: Final = frozenset({TEXT_EMERGENCY, TEXT_ALERT, TEXT_CRITICAL})  # held for `text_hold_s`


def of_sensor(bit: int) -> int:
    """The code of a SYS_STATUS bit; bits of the extended word count from 32."""
    return SENSOR + bit if bit < 32 else EXTENDED_SENSOR + bit - 32


def _of(mask: int) -> int:
    return of_sensor(_bit(mask))


NAMED_FAILSAFES: Final = frozenset(
    {
        *range(RC_LOST, DEPTH_SENSOR + 1),
        _of(MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL),
        _of(MAV_SYS_STATUS_SENSOR_RC_RECEIVER),
        _of(MAV_SYS_STATUS_GEOFENCE),
        _of(MAV_SYS_STATUS_AHRS),
        _of(MAV_SYS_STATUS_SENSOR_BATTERY),
        INTERNAL_ERROR,
    }
)
"""State CRITICAL means that a failsafe is active; each of these causes identifies it."""
EVENTS: Final = frozenset(range(EVENT, EVENT + 3))
NAMED_EMERGENCIES: Final = frozenset(range(CRASH, ATTITUDE_FAILURE + 1))
"""State EMERGENCY without one of these is EMERGENCY."""


def error(code: int, text: str | None, since_us: int) -> ErrorCause:
    """The published form of a cause."""
    return ErrorCause(code, CAUSES[code].name, text, since_us)
