"""ArduPilot Sub. Modes: 2 ALT_HOLD, 4 GUIDED, 9 SURFACE, 16 POSHOLD, 19 MANUAL. It has no landed state."""

from __future__ import annotations

from ..other_firmwares import ARDUSUB
from ..scenario import Scenario, Step, step

_STILL = (0.0, 0.0, 0.0)

_DIVE = (
    step(3.0, "the pilot arms: ACTIVE", armed=True),
    step(5.0, "ALT_HOLD: down", custom_mode=2, velocity=(0.0, 0.0, 0.4), throttle=30),
    step(9.0, "it holds its depth", velocity=_STILL, throttle=50),
)


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, ARDUSUB, ARDUSUB.ready, steps)


READY = _scenario("disarmed in MANUAL, ready to be armed; no steps")
BOOT = Scenario("power on until ready to be armed", ARDUSUB, ARDUSUB.booting, ARDUSUB.boot)
DIVE = _scenario(
    "a dive by joystick, then in GUIDED, then the ascent",
    *_DIVE,
    step(12.0, "POSHOLD: the joystick flies it, although the GUIDED bit is set", custom_mode=16),
    step(16.0, "GUIDED: AUTO", custom_mode=4, velocity=(0.5, 0.0, 0.0)),
    step(20.0, "SURFACE: automatic ascent", custom_mode=9, velocity=(0.0, 0.0, -0.4)),
    step(26.0, "at the surface: ALT_HOLD", custom_mode=2, velocity=_STILL),
    step(29.0, "disarmed", armed=False, throttle=0),
)
LEAK = _scenario(
    "a leak: SURFACE; only a text reports it, every 20 s while the sensor is wet",
    *_DIVE,
    step(12.0, "automatic ascent", (2, "Leak Detected"), custom_mode=9, velocity=(0.0, 0.0, -0.35)),
    step(26.0, "at the surface: ALT_HOLD", custom_mode=2, velocity=_STILL),
    step(32.0, "still wet", (2, "Leak Detected")),
    step(52.0, "still wet: the last text", (2, "Leak Detected")),
    step(60.0, "dry: no message reports it", throttle=50),
)
PILOT_LOST = _scenario(
    "the joystick is lost: CRITICAL until it is back",
    *_DIVE,
    step(12.0, "manual control is lost", (2, "Lost manual control"), failsafe=True),
    step(20.0, "the joystick is back", failsafe=False),
)
