"""ArduPilot AntennaTracker. Modes: 0 MANUAL, 1 STOP, 2 SCAN, 3 SERVO_TEST, 10 AUTO. It turns and does not travel."""

from __future__ import annotations

from ..other_firmwares import TRACKER
from ..scenario import Scenario, Step, step

_STILL = (0.0, 0.0, 0.0)
_TURNING = (0.0, 0.1, 0.4)


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, TRACKER, TRACKER.ready, steps)


READY = _scenario("disarmed in MANUAL, ready to be armed; no steps")
BOOT = Scenario("power on until ready to be armed", TRACKER, TRACKER.booting, TRACKER.boot)
TRACKING = _scenario(
    "the antenna looks for a plane, follows it, and is stopped",
    step(3.0, "armed in SCAN: it turns", armed=True, custom_mode=2, rates=_TURNING),
    step(8.0, "AUTO: it has found the plane, which stands still", custom_mode=10, rates=_STILL),
    step(12.0, "the plane flies, the antenna follows", rates=_TURNING),
    step(16.0, "STOP", custom_mode=1, rates=_STILL),
    step(20.0, "SERVO_TEST: a person tests the servos", custom_mode=3),
)
SAFETY_SWITCH = _scenario(
    "the hardware safety switch is pressed: on a tracker that disarms, too",
    step(3.0, "AUTO", armed=True, custom_mode=10),
    step(6.0, "safety switch on", safety_switch=True, armed=False),
    step(12.0, "safety switch off", safety_switch=False, armed=True),
)
