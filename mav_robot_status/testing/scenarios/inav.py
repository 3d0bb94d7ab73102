"""INAV, which may identify as ArduPilot; its SYS_STATUS identifies it.

Its rover numbers its modes as ArduPilot Plane (4 ACRO, 5 FBWA, 10 AUTO, 11 RTL, 23 "no mapping"), its quad as ArduPilot
Copter (1 ACRO, 6 RTL, 22 "no mapping"). Texts are padded to 50 characters.
"""

from __future__ import annotations

from ..other_firmwares import INAV_QUAD, INAV_ROVER
from ..scenario import RC_RECEIVER, Scenario, Step, step

_STILL = (0.0, 0.0, 0.0)
_NO_RC = INAV_ROVER.ready.sensors_health & ~RC_RECEIVER
_UNABLE, _NO_LINK, _SWITCH = (
    (severity, text.ljust(50))
    for severity, text in ((4, "UNABLE TO ARM"), (5, "NO RC LINK"), (5, "DISABLE ARM SWITCH FIRST"))
)


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, INAV_ROVER, INAV_ROVER.ready, steps)


READY = _scenario("a rover, disarmed in ACRO, ready to be armed; no steps")
BOOT = Scenario("power on until ready to be armed", INAV_ROVER, INAV_ROVER.booting, INAV_ROVER.boot)
DRIVE = _scenario(
    "a rover driven by hand, then by its mission",
    step(3.0, "armed in ACRO, which is the number of ArduPilot Rover's HOLD", armed=True),
    step(5.0, "it drives", velocity=(0.8, 0.0, 0.0), throttle=40),
    step(8.0, "ANGLE, reported as FBWA: the number of ArduPilot Rover's LOITER", custom_mode=5),
    step(11.0, "the mission, reported as AUTO", custom_mode=10),
    step(14.0, "it stops: without a position a speed of zero means unknown", velocity=_STILL, throttle=0),
    step(17.0, "disarmed", armed=False, custom_mode=4),
)
RC_LOST = _scenario(
    "the remote control of a rover is lost: it disarms, and its mode has no number",
    step(3.0, "armed", armed=True),
    step(6.0, "lost", armed=False, custom_mode=23, sensors_health=_NO_RC),
    step(7.0, "two texts alternate with the reason why it cannot be armed", _UNABLE, _NO_LINK, prearm="NO RC LINK"),
    step(9.0, "and again", _UNABLE, _NO_LINK),
    step(12.0, "the remote control is back", custom_mode=4, sensors_health=INAV_ROVER.ready.sensors_health),
    step(13.0, "its arm switch is still on", _UNABLE, _SWITCH, prearm="DISABLE ARM SWITCH FIRST"),
    step(15.0, "the arm switch is off", prearm=""),
)
RETURN_TO_HOME = Scenario(
    "the remote control of a quad is lost in flight: CRITICAL, it returns automatically",
    INAV_QUAD,
    INAV_QUAD.ready,
    (
        step(3.0, "armed in ACRO", armed=True),
        step(5.0, "it flies", velocity=(2.0, 0.0, -1.0), throttle=50),
        step(9.0, "lost", custom_mode=6, failsafe=True, sensors_health=_NO_RC, velocity=(3.0, 0.0, 0.0)),
        step(14.0, "back", custom_mode=1, failsafe=False, sensors_health=INAV_QUAD.ready.sensors_health),
    ),
)
