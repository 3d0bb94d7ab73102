"""What the estimator says about itself. Recorded: 14 m/s for a disarmed vehicle at rest, while it said it was wrong.

Sources: recorded; ArduPilot, `AP_Arming` (a failed check is repeated every 30 s) and `AP_AHRS::send_ekf_status_report`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ..estop.state import REPEATED
from ..faults import sensors

if TYPE_CHECKING:
    from ..state import LatestMessages, VehicleState

FRESH: Final = 10.0
"""Seconds for which an EKF_STATUS_REPORT is valid."""


def denied_until(state: VehicleState) -> float:
    """Until when (monotonic seconds) a disarmed vehicle itself says that its estimate is wrong: in SYS_STATUS, in a
    text of the pre-arm checks, or in EKF_STATUS_REPORT. -inf: it does not; inf: until another message.
    """
    if not state.profile.speeds.needs_healthy_estimator or state.heartbeats.armed:
        return -math.inf
    status = state.latest.sys_status
    if status is not None and sensors.estimate_is_faulty(status.message):
        return math.inf
    said = state.denied_at + REPEATED
    return max(said, state.unaided_at + FRESH) if state.tilted else said


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
