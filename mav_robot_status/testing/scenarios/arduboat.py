"""ArduPilot Rover as a boat. Modes: 0 MANUAL, 4 HOLD, 5 LOITER, 15 GUIDED. Its type is 11, SURFACE_BOAT."""

from __future__ import annotations

from ..other_firmwares import ARDUBOAT
from ..scenario import Scenario, Step, step

_STILL = (0.0, 0.0, 0.0)

_CAST_OFF = (
    step(3.0, "the skipper arms", armed=True),
    step(4.0, "the skipper drives off", velocity=(1.5, 0.0, 0.0), throttle=40),
)


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, ARDUBOAT, ARDUBOAT.ready, steps)


READY = _scenario("disarmed in MANUAL, ready to be armed; no steps")
DRIFT = _scenario(
    "LOITER: the boat drifts, rolls in the waves, and returns to its position",
    *_CAST_OFF,
    step(7.0, "LOITER, in still water", custom_mode=5, velocity=_STILL, throttle=0),
    step(
        11.0,
        "waves: heave and roll do not count as motion of a boat",
        velocity=(0.0, 0.05, 0.6),
        rates=(0.5, 0.3, 0.01),
    ),
    step(15.0, "it drifts", velocity=(0.0, 0.4, 0.6)),
    step(19.0, "HOLD: the motor is off, it drifts on", custom_mode=4),
    step(23.0, "disarmed and drifting faster", armed=False, velocity=(0.0, 0.7, 0.0), rates=_STILL),
)
GCS_FAILSAFE = _scenario(
    "the ground station is lost in GUIDED; the boat reports a radio failsafe",
    *_CAST_OFF,
    step(6.0, "GUIDED", custom_mode=15),
    step(
        9.0,
        "the ground station is lost: CRITICAL, HOLD",
        (4, "Radio Failsafe"),
        custom_mode=4,
        failsafe=True,
        velocity=_STILL,
        throttle=0,
    ),
    step(15.0, "it is back", (6, "Radio Failsafe Cleared"), failsafe=False),
    step(18.0, "GUIDED again", custom_mode=15, velocity=(1.5, 0.0, 0.0), throttle=40),
)
