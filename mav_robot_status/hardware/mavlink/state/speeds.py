"""Speeds from the latest messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ..identity import ROVER

if TYPE_CHECKING:
    from ..identity import Family
    from .latest_messages import LatestMessages


def speed_over_ground(latest: LatestMessages) -> float:
    """The estimated speed over ground in m/s; 0 until one arrives."""
    position = latest.global_position
    return 0.0 if position is None else math.hypot(position.message.vx, position.message.vy) / 100


def driving_speed(latest: LatestMessages, family: Family) -> float:
    """The speed that grows if the motors really run: speed over ground of a rover, climb of a copter; m/s."""
    hud = latest.vfr_hud
    if hud is None:
        return 0.0
    speed: float = hud.message.groundspeed if family is ROVER else hud.message.climb
    return speed if math.isfinite(speed) else 0.0
