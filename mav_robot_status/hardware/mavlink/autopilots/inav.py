"""INAV that announces itself as ArduPilot, which is its default.

It uses ArduPlane's mode numbers for planes, rovers and boats, and ArduCopter's for all others. Its SYS_STATUS differs
from ArduPilot's: MOTOR_OUTPUTS is never present. INAV that announces itself as GENERIC uses the profile `generic`.
Source: INAV, telemetry/mavlink.c.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import RobotMode
from ....mavlink import enumerations as mavlink
from ..identity import Family
from . import ardupilot
from .generic import GENERIC
from .modes import FlightMode, ModeHints, look_up, other_name
from .profile import Autopilot, HudSpeed, Modes, Recognition, Speeds, ZeroSpeed

if TYPE_CHECKING:
    from ....mavlink.definitions import Heartbeat

LIMITS: Final = {Family.COPTER: 22, Family.PLANE: 23}
"""The first number that means "no valid mapping", by the family whose numbers INAV uses."""


def flight_mode(heartbeat: Heartbeat, family: Family, hints: ModeHints) -> FlightMode:
    """The mode by ArduPilot's numbers."""
    number = heartbeat.custom_mode
    numbers_of = Family.PLANE if family in (Family.PLANE, Family.ROVER) else Family.COPTER
    if number >= LIMITS[numbers_of]:
        return FlightMode(RobotMode.UNKNOWN, other_name(number, hints), "INAV: no mapping for its mode")
    return look_up(ardupilot.MODES[numbers_of], number, f"INAV in ArduPilot's {numbers_of.value} numbers", hints)


INAV: Final[Autopilot] = GENERIC._replace(
    name="INAV",
    recognition=Recognition(
        autopilots=ardupilot.ARDUPILOT.recognition.autopilots, lacks=mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    ),
    modes=Modes(flight_mode=flight_mode, overrides_key=None, initialising={}),
    speeds=Speeds(
        zero=ZeroSpeed.GPS_HEALTHY,  # it sends zero without GPS
        hud=HudSpeed.MOTION_AND_REST,
        needs_healthy_estimator=False,
        denied_by=None,
        hud_shows_thrust=False,
        reports_estimator=False,
    ),
)
