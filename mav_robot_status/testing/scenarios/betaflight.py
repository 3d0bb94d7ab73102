"""Betaflight: a GENERIC autopilot whose base_mode is always MANUAL. AVAILABLE_MODES describes its modes.

Modes: 0 Acro, 1 Angle, 2 Horizon, 3 Alt Hold, 4 Pos Hold, 5 Autopilot, 6 RTL, 7 Failsafe.
"""

from __future__ import annotations

from ..other_firmwares import BETAFLIGHT
from ..scenario import Scenario, Step, step

_STILL = (0.0, 0.0, 0.0)


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, BETAFLIGHT, BETAFLIGHT.ready, steps)


READY = _scenario("disarmed in Acro, ready to be armed; no steps")
BOOT = Scenario("power on until ready to be armed", BETAFLIGHT, BETAFLIGHT.booting, BETAFLIGHT.boot)
MANUAL = _scenario(
    "flown by hand, landed, disarmed",
    step(3.0, "armed in Acro", armed=True),
    step(6.0, "it flies in Angle", custom_mode=1, velocity=(3.0, 0.0, -1.0), throttle=50),
    step(10.0, "landed", velocity=_STILL, throttle=0),
    step(13.0, "disarmed", armed=False),
)
AUTOPILOT = _scenario(
    "the autopilot flies, then the pilot, then RTL",
    step(3.0, "armed in Angle", armed=True, custom_mode=1),
    step(6.0, "Autopilot: base_mode is still MANUAL", custom_mode=5, velocity=(3.0, 0.0, 0.0), throttle=50),
    step(11.0, "Pos Hold: the pilot", custom_mode=4, velocity=_STILL),
    step(15.0, "RTL: base_mode is still MANUAL", custom_mode=6, velocity=(3.0, 0.0, 0.0)),
)
FAILSAFE = _scenario(
    "the failsafe switch disarms it",
    step(3.0, "armed in Angle", armed=True, custom_mode=1),
    step(
        6.0,
        "failsafe",
        (5, "Arming disabled: FAILSAFE RXLOSS"),
        (5, "Arming disabled: FAILSAFE RXLOSS BOXFAILSAFE ARM_"),
        armed=False,
        custom_mode=7,
        prearm="FAILSAFE RXLOSS",
    ),
    step(
        12.0,
        "the failsafe ends",
        (5, "Arming disabled: THROTTLE ARM_SWITCH"),
        custom_mode=0,
        prearm="THROTTLE ARM_SWITCH",
    ),
    step(15.0, "the arm switch is off", prearm=""),
)
