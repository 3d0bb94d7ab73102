"""PX4 on a quadrotor. It sends texts only to a link with a ground station."""

from __future__ import annotations

from typing import Any

from ..firmware import IN_AIR, LANDING, ON_GROUND, TAKEOFF, px4_mode
from ..firmwares import PX4_QUAD
from ..scenario import RC_RECEIVER, Action, Scenario, Step, by_satellite, step

_SENSORS = PX4_QUAD.ready.sensors_health
_STILL = (0.0, 0.0, 0.0)
_LANDED: dict[str, Any] = {"landed_state": ON_GROUND, "velocity": _STILL, "throttle": 0}
POSCTL, HOLD, MISSION, RTL = px4_mode(3), px4_mode(4, 3), px4_mode(4, 4), px4_mode(4, 5)

_TAKE_OFF = (
    step(3.0, "the pilot arms", armed=True),
    step(5.0, "take-off", (6, "Takeoff detected\t"), landed_state=TAKEOFF, velocity=(0.0, 0.0, -1.5), throttle=57),
    step(8.0, "hovering in POSCTL", landed_state=IN_AIR, velocity=_STILL, throttle=49),
)


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, PX4_QUAD, PX4_QUAD.ready, steps)


READY = _scenario("disarmed in POSCTL on the ground, ready to be armed; no steps")
BOOT = Scenario("power on until ready to be armed", PX4_QUAD, PX4_QUAD.booting, PX4_QUAD.boot)
PREARM_FAILING = _scenario(
    "cannot be armed for a while: UNINIT reports it",
    step(
        2.0,
        "the remote control is off: not ready",
        prearm="No manual control input",
        sensors_present=_SENSORS & ~RC_RECEIVER,
        sensors_health=_SENSORS & ~RC_RECEIVER,
    ),
    step(4.0, "arming is refused", (2, "Arming denied: Resolve system health failures first\t")),
    step(8.0, "the remote control is on", prearm="", sensors_present=_SENSORS, sensors_health=_SENSORS),
)
MANUAL = _scenario(
    "armed, flown by hand, landed",
    *_TAKE_OFF,
    step(10.0, "the pilot flies forward", velocity=(3.0, 0.0, 0.0)),
    step(14.0, "the pilot lands", velocity=(0.0, 0.0, 0.5), throttle=45),
    step(18.0, "on the ground", (6, "Landing detected\t"), **_LANDED),
    step(20.0, "the pilot disarms", armed=False),
)
AUTO = _scenario(
    "a mission in AUTO.MISSION",
    *_TAKE_OFF,
    step(10.0, "the mission flies", (6, "Executing Mission\t"), custom_mode=MISSION, velocity=(5.0, 0.0, 0.0)),
    step(16.0, "the mission lands", landed_state=LANDING, velocity=(0.0, 0.0, 0.5), throttle=45),
    step(20.0, "landed", (6, "Landing detected\t"), (6, "Mission finished, landed\t"), **_LANDED),
    step(22.0, "disarmed by the landing", armed=False),
)
RC_FAILSAFE = _scenario(
    "the remote control is lost in flight and comes back",
    *_TAKE_OFF,
    step(
        10.0,
        "the remote control is lost: CRITICAL, Hold",
        (2, "Failsafe activated: entering Hold for 5 seconds\t"),
        custom_mode=HOLD,
        failsafe=True,
        sensors_present=_SENSORS & ~RC_RECEIVER,
        sensors_health=_SENSORS & ~RC_RECEIVER,
    ),
    step(
        15.0,
        "still lost: RTL",
        (2, "Failsafe activated\t"),
        (6, "RTL: start return at 499 m (11 m above destination)\t"),
        (6, "RTL: land at destination\t"),
        custom_mode=RTL,
        landed_state=LANDING,
        velocity=(4.0, 0.0, 0.0),
    ),
    step(20.0, "the remote control is back", sensors_present=_SENSORS, sensors_health=_SENSORS),
    step(
        23.0,
        "the pilot takes over in POSCTL",
        custom_mode=POSCTL,
        failsafe=False,
        landed_state=IN_AIR,
        velocity=_STILL,
    ),
)
KILL = _scenario(
    "the kill switch in flight: state FLIGHT_TERMINATION until it is released",
    *_TAKE_OFF,
    step(
        10.0,
        "kill: the quad falls",
        (2, "Kill engaged\t"),
        emergency_stop=True,
        prearm="Kill switch engaged",
        velocity=(0.0, 0.0, 8.0),
        throttle=0,
    ),
    step(12.0, "it has hit the ground", **_LANDED),
    step(15.0, "five seconds after the kill it disarms", armed=False),
    step(19.0, "released", (6, "Kill disengaged\t"), emergency_stop=False, prearm=""),
)
SATELLITE = by_satellite(AUTO, hz=0.015)
LINK_SILENCE = _scenario(
    "the link is silent for 6 s while the quad hovers",
    *_TAKE_OFF,
    step(10.0, "the link is cut", action=Action.SILENCE),
    step(16.0, "the link is back", action=Action.RESUME),
)
REBOOT = _scenario("the autopilot reboots on the ground", step(4.0, "the autopilot reboots", action=Action.REBOOT))
