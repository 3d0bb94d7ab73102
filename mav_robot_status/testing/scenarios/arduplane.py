"""ArduPilot Plane. Modes: 0 MANUAL, 1 CIRCLE, 5 FBWA, 10 AUTO, 11 RTL, 12 LOITER, 13 TAKEOFF."""

from __future__ import annotations

from typing import Any

from ..firmware import EMERGENCY, IN_AIR, ON_GROUND
from ..other_firmwares import ARDUPLANE
from ..scenario import RC_RECEIVER, Action, Scenario, Step, step

_HEALTH = ARDUPLANE.ready.sensors_health
_STILL = (0.0, 0.0, 0.0)
_CRUISE = (18.0, 0.0, 0.0)
_TERRAIN = 1 << 22

_TAKE_OFF = (
    step(3.0, "TAKEOFF: the autopilot will take off automatically", custom_mode=13),
    step(4.0, "armed on the runway: STANDBY until it flies", armed=True),
    step(
        6.0,
        "it flies",
        (6, "Takeoff to 50m for 200.0m heading -7.0 deg"),
        landed_state=IN_AIR,
        velocity=(15.0, 0.0, -3.0),
        throttle=100,
    ),
    step(10.0, "LOITER: AUTO on a Plane", custom_mode=12, velocity=_CRUISE, throttle=60),
)
_FBWA = step(12.0, "FBWA: the pilot steers", custom_mode=5)
_LANDED: dict[str, Any] = {"landed_state": ON_GROUND, "velocity": _STILL, "throttle": 0}


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, ARDUPLANE, ARDUPLANE.ready, steps)


READY = _scenario("disarmed in MANUAL on the ground, ready to be armed; no steps")
BOOT = Scenario("power on until ready to be armed", ARDUPLANE, ARDUPLANE.booting, ARDUPLANE.boot)
MANUAL = _scenario(
    "armed in FBWA, flown by hand, landed",
    step(2.0, "FBWA", custom_mode=5),
    step(3.0, "the pilot arms on the runway: STANDBY", armed=True),
    step(6.0, "airborne", landed_state=IN_AIR, velocity=_CRUISE, throttle=70),
    step(12.0, "landed; the propeller stands still", **_LANDED),
    step(15.0, "the pilot disarms", armed=False),
)
AUTO = _scenario(
    "a mission in AUTO",
    *_TAKE_OFF,
    step(12.0, "AUTO: the mission flies", (6, "Mission: 2 WP"), custom_mode=10),
    step(18.0, "the mission has landed", (6, "Land complete"), **_LANDED),
    step(19.0, "disarmed by the landing", armed=False),
)
RC_FAILSAFE = _scenario(
    "the radio is lost in FBWA: first CIRCLE, five seconds later RTL; then the radio is back",
    *_TAKE_OFF,
    _FBWA,
    step(
        15.0,
        "short failsafe: CRITICAL, CIRCLE",
        (4, "Throttle failsafe on"),
        (4, "RC Short Failsafe: switched to CIRCLE"),
        custom_mode=1,
        failsafe=True,
        sensors_health=_HEALTH & ~RC_RECEIVER,
    ),
    step(20.2, "long failsafe: RTL", (4, "RC Long Failsafe On: RTL"), custom_mode=11),
    step(
        27.5,
        "the radio is back; RTL continues",
        (4, "Throttle failsafe off"),
        (4, "RC Long Failsafe Cleared"),
        failsafe=False,
        sensors_health=_HEALTH,
    ),
    step(31.0, "the pilot takes over in FBWA", custom_mode=5),
)
CRASH = _scenario(
    "the plane hits a tree: disarmed, and EMERGENCY until the mode changes",
    *_TAKE_OFF,
    step(14.0, "it lies on the ground", landed_state=ON_GROUND, velocity=_STILL),
    step(
        16.0,
        "the crash check disarms it",
        (0, "Crash detected"),
        armed=False,
        system_status=EMERGENCY,
        throttle=0,
    ),
    step(26.0, "the pilot chooses FBWA: STANDBY", custom_mode=5, system_status=None),
    step(30.0, "armed again", armed=True),
)
ESTOP = _scenario(
    "motor emergency stop in flight, released: nothing but the motor output shows it",
    *_TAKE_OFF,
    step(14.0, "stopped: the autopilot demands full throttle", emergency_stop=True, throttle=100),
    step(16.0, "it glides down", velocity=(14.0, 0.0, 4.0)),
    step(24.0, "released: the motor runs again", emergency_stop=False, velocity=(18.0, 0.0, -2.0)),
)
TERMINATION = _scenario(
    "the advanced failsafe ends the flight at a ground station's command, until a reboot",
    *_TAKE_OFF,
    step(14.0, "the text has only severity INFO", (6, "Terminating due to GCS request")),
    step(
        14.05,
        "disarmed in flight: it falls, still ACTIVE and IN_AIR",
        armed=False,
        prearm="AHRS: DCM Roll/Pitch inconsistent 13 deg. Wait or reboo",
        velocity=(15.0, 0.0, 12.0),
        throttle=0,
    ),
    step(18.0, "it has hit the ground", **_LANDED),
    step(22.0, "the autopilot reboots", action=Action.REBOOT),
)
NO_TERRAIN_DATA = _scenario(
    "a flight without terrain data: TERRAIN is enabled and unhealthy, as in every recorded flight",
    step(0.0, "no ground station sends terrain data", sensors_health=_HEALTH & ~_TERRAIN),
    *_TAKE_OFF,
)
