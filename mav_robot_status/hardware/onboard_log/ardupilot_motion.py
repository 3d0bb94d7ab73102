"""Speed and rotation in the records of an ArduPilot."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ...mavlink.definitions import TYPE_NAMES
from ...mavlink.enumerations import MAV_TYPE_SURFACE_BOAT
from ..mavlink.identity import Family
from .kinematics import FRESH, Kinematics, angle_between
from .numbers import Values, number, whole

if TYPE_CHECKING:
    from ...clock import Instant
    from .state import LogState

FIX_3D: Final = 3
LEAP_SECONDS: Final = 18
GPS_EPOCH: Final = 315_964_800
WEEK: Final = 604_800
CONST_POSITION, HORIZONTAL_SPEED = 1 << 7, 1 << 1
"""Bits of XKF4.SS."""


def utc_us(values: Values) -> int | None:
    """The UTC of a GPS record, in microseconds since 1970; None without a fix."""
    week, ms = whole(values, "GWk", "Week"), whole(values, "GMS", "TimeMS")
    if week < 1000 or ms < 0 or whole(values, "Status") < FIX_3D:
        return None
    return (GPS_EPOCH + week * WEEK - LEAP_SECONDS) * 1_000_000 + ms * 1000


class ArduPilotMotion:
    """What the records of motion mean. Each returns True if nothing has changed."""

    def __init__(self, state: LogState, moves: Kinematics) -> None:
        self.family: Family | None = None
        self._state = state
        self._moves = moves
        self._attitude: tuple[float, tuple[float, float, float]] | None = None
        self._gyro: tuple[float, float] = (0.0, -math.inf)
        """The fastest rotation, rad/s, and when."""
        self._estimates = self._has_estimate = False

    def gps(self, values: Values, now: Instant) -> bool:
        """GPS: the speed while there is no estimate."""
        if self._estimates and self._has_estimate:
            return True
        if whole(values, "Status") < FIX_3D:
            return self._moves.moved(None, "GPS", now)
        rise = number(values, "VZ", "VelZ")
        speed = number(values, "Spd")
        if self.family is not Family.ROVER and math.isfinite(rise):
            speed = math.hypot(speed, rise)
        return self._moves.moved(speed, "GPS.Spd", now)

    def throttle(self, values: Values, now: Instant) -> bool:
        """THR of a rover: its speed over ground comes earlier than that of the GPS, and is 0 if it is unknown."""
        speed = abs(number(values, "Speed"))
        return self._moves.proved(speed, now) if speed > 0 else True

    def estimate(self, values: Values, now: Instant) -> bool:
        """XKF1: the speed of the estimate."""
        self._estimates = True
        if not self._has_estimate:
            return True
        parts = [number(values, name) for name in ("VN", "VE", "VD")]
        return self._moves.moved(math.hypot(*parts[: 2 if self.family is Family.ROVER else 3]), "XKF1.VN", now)

    def estimate_status(self, values: Values, now: Instant) -> bool:
        """XKF4: whether there is an estimate of the speed."""
        flags = whole(values, "SS")
        self._has_estimate = flags > 0 and bool(flags & HORIZONTAL_SPEED) and not flags & CONST_POSITION
        return True

    def attitude(self, values: Values, now: Instant) -> bool:
        """ATT: the rotation between two records."""
        angles = (number(values, "Roll"), number(values, "Pitch"), number(values, "Yaw"))
        before, self._attitude = self._attitude, (now.mono, angles)
        if before is None or not all(map(math.isfinite, angles)) or now.mono <= before[0]:
            return True
        compared = range(2, 3) if self._state.vehicle.type == TYPE_NAMES[MAV_TYPE_SURFACE_BOAT] else range(3)
        turned = max(abs(angle_between(before[1][n], angles[n])) for n in compared)
        rate = math.radians(turned) / (now.mono - before[0])
        gyro, at = self._gyro
        return self._moves.turned(min(rate, gyro) if now.mono - at < FRESH else rate, now)

    def gyroscope(self, values: Values, now: Instant) -> bool:
        """IMU: vibration shows here alone, and an attitude that is corrected shows in ATT alone."""
        rates = [number(values, name) for name in ("GyrX", "GyrY", "GyrZ")]
        if all(map(math.isfinite, rates)):
            self._gyro = max(map(abs, rates)), now.mono
        return True
