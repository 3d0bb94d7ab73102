"""ArduPilot Rover. Modes: 0 MANUAL, 4 HOLD, 10 AUTO, 16 INITIALISING."""

from __future__ import annotations

from typing import Any

from ..firmwares import ARDUROVER
from ..scenario import RC_RECEIVER, Action, Scenario, Step, by_satellite, step, with_applet

Changes = dict[str, Any]
_HEALTH = ARDUROVER.ready.sensors_health
_STOPPED = (0.0, 0.0, 0.0)
STANDS: Changes = {"velocity": _STOPPED, "throttle": 0}
HOLDS: Changes = {"custom_mode": 4, "failsafe": True, **STANDS}
"""A failsafe: CRITICAL in HOLD."""
RADIO_LOST: Changes = {**HOLDS, "sensors_health": _HEALTH & ~RC_RECEIVER}
RADIO_BACK: Changes = {"failsafe": False, "sensors_health": _HEALTH}
RELEASED: Changes = {"emergency_stop": False, "velocity": (2.0, 0.0, 0.0), "throttle": 40}

_ARM_AND_DRIVE = (
    step(3.0, "the driver arms", armed=True),
    step(4.0, "the driver drives off", velocity=(1.0, 0.0, 0.0), throttle=31),
)
_AUTO = step(6.0, "AUTO: the mission drives", (6, "Mission: 1 WP"), custom_mode=10, velocity=(2.0, 0.0, 0.0))


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, ARDUROVER, ARDUROVER.ready, steps)


READY = _scenario("disarmed in MANUAL, ready to be armed; no steps")
BOOT = Scenario("power on until ready to be armed", ARDUROVER, ARDUROVER.booting, ARDUROVER.boot)
PREARM_FAILING = _scenario(
    "cannot be armed for a while",
    step(2.0, "the compass fails: so do the pre-arm checks", prearm="Compass not healthy", sensors_health=_HEALTH & ~4),
    step(4.0, "the driver tries to arm and is refused", (2, "Arm: Compass not healthy")),
    step(8.0, "the compass is back", prearm="", sensors_health=_HEALTH),
)
REASONS = Scenario(
    "cannot be armed for three reasons, of which two end; its first announcement comes before anybody listens",
    ARDUROVER,
    ARDUROVER.ready._replace(
        prearm=("3D Accel calibration needed", "GPS 1: Bad fix", "Compass not calibrated"), position=False
    ),
    (
        step(
            12.0,
            "a fix, and calibrated sensors; the driver tries to arm and is refused",
            (2, "Arm: Compass not calibrated"),
            prearm="Compass not calibrated",
            position=True,
        ),
        step(13.5, "the driver tries again", (2, "Arm: Compass not calibrated")),
        step(18.0, "the compass is calibrated", prearm=""),
    ),
)
MANUAL = _scenario(
    "armed and driven by hand",
    *_ARM_AND_DRIVE,
    step(8.0, "turning on the spot", velocity=_STOPPED, rates=(0.0, 0.0, 0.5), throttle=0),
    step(11.0, "the driver stops", rates=_STOPPED),
    step(13.0, "the driver disarms", armed=False),
)
AUTO = _scenario(
    "a mission in AUTO",
    *_ARM_AND_DRIVE,
    _AUTO,
    step(12.0, "the mission ends", (6, "Reached waypoint #3"), (5, "Mission Complete"), **STANDS),
    step(15.0, "disarmed", armed=False),
)
RC_FAILSAFE = _scenario(
    "the radio is lost in AUTO and comes back",
    *_ARM_AND_DRIVE,
    _AUTO,
    step(9.0, "the radio is lost: CRITICAL, HOLD", (4, "Radio Failsafe"), **RADIO_LOST),
    step(15.0, "the radio is back", (6, "Radio Failsafe Cleared"), **RADIO_BACK),
    step(18.0, "the driver takes over in MANUAL", custom_mode=0),
)
GCS_FAILSAFE = _scenario(
    "the ground station is lost in AUTO and comes back; the autopilot names the radio",
    *_ARM_AND_DRIVE,
    _AUTO,
    step(9.0, "the ground station is lost: CRITICAL, HOLD; the radio is healthy", (4, "Radio Failsafe"), **HOLDS),
    step(15.0, "the ground station is back", (6, "GCS Failsafe Cleared"), failsafe=False),
    step(18.0, "the driver takes over in MANUAL", custom_mode=0),
)
REPEATED_PACKETS = Scenario(
    "a tunnel repeats packets 5 s late; no steps",
    ARDUROVER,
    ARDUROVER.ready,
    streams={1: 1.0, 2: 1.0, 30: 4.0, 33: 4.0, 36: 2.0, 74: 2.0, 193: 0.5},
    repeats=5.0,
)
SAFETY_SWITCH = _scenario(
    "the hardware safety switch is pressed while armed, and again",
    *_ARM_AND_DRIVE,
    step(6.0, "safety switch on: the outputs are dead", safety_switch=True, throttle=0),
    step(7.0, "the rover has stopped", velocity=_STOPPED),
    step(10.0, "safety switch off", safety_switch=False),
)
RC_ESTOP = _scenario(
    "motor emergency stop by an RC switch in AUTO, then released",
    *_ARM_AND_DRIVE,
    _AUTO,
    step(9.0, "emergency stop: only a text reports it", (6, "RC7: MotorEStop HIGH"), emergency_stop=True),
    step(10.0, "the rover has stopped, and AUTO increases the throttle", velocity=_STOPPED, throttle=58),
    step(12.0, "more throttle has no effect", throttle=81),
    step(14.0, "released: the rover drives on", (6, "RC7: MotorEStop LOW"), **RELEASED),
)
APPLET_ESTOP = with_applet(RC_ESTOP)
CRASH = _scenario(
    "the rover runs into something",
    *_ARM_AND_DRIVE,
    _AUTO,
    step(9.0, "it is stuck", velocity=_STOPPED, throttle=80),
    step(11.0, "the crash check holds it", (0, "Crash: Going to HOLD"), custom_mode=4, throttle=0),
    step(15.0, "the driver disarms", armed=False),
)
SATELLITE = by_satellite(AUTO, hz=0.2)
LINK_SILENCE = _scenario(
    "the link is silent for 6 s while the rover drives",
    *_ARM_AND_DRIVE,
    step(8.0, "the link is cut", action=Action.SILENCE),
    step(14.0, "the link is back", action=Action.RESUME),
)
REBOOT = _scenario(
    "the autopilot reboots while armed",
    *_ARM_AND_DRIVE,
    step(8.0, "the autopilot reboots", action=Action.REBOOT),
)
