"""Speeds from the latest messages."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .latest_messages import LatestMessages


def speed_over_ground(latest: LatestMessages) -> float:
    """The estimated speed over ground in m/s; 0 until one arrives."""
    position = latest.global_position
    return 0.0 if position is None else math.hypot(position.message.vx, position.message.vy) / 100


def hud_speeds(latest: LatestMessages) -> tuple[float, float]:
    """The speed over ground and the climb in VFR_HUD, m/s; 0 until one arrives."""
    hud = latest.vfr_hud
    if hud is None:
        return 0.0, 0.0
    speed, climb = hud.message.groundspeed, hud.message.climb
    return speed if math.isfinite(speed) else 0.0, climb if math.isfinite(climb) else 0.0
