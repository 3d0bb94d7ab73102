"""ArduPilot Blimp. Modes: 0 LAND, 1 MANUAL, 2 VELOCITY, 3 LOITER, 4 RTL; an old version has 0 and 1 swapped."""

from __future__ import annotations

from ..firmware import IN_AIR, ON_GROUND
from ..other_firmwares import BLIMP
from ..scenario import RC_RECEIVER, Scenario, Step, step

_HEALTH = BLIMP.ready.sensors_health
_STILL = (0.0, 0.0, 0.0)

_LIFT_OFF = (
    step(3.0, "the pilot arms: STANDBY on the ground", armed=True),
    step(6.0, "it floats", landed_state=IN_AIR, velocity=(0.3, 0.0, -0.3), throttle=40),
)


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, BLIMP, BLIMP.ready, steps)


READY = _scenario("disarmed in MANUAL, ready to be armed; no steps")
FLIGHT = _scenario(
    "a manual flight and an automatic return",
    *_LIFT_OFF,
    step(9.0, "LOITER: the sticks move its hold position", custom_mode=3, velocity=_STILL),
    step(12.0, "RTL: AUTO", custom_mode=4, velocity=(0.5, 0.0, 0.0)),
    step(16.0, "LAND", custom_mode=0, velocity=(0.0, 0.0, 0.2)),
    step(20.0, "landed", landed_state=ON_GROUND, velocity=_STILL, throttle=0),
    step(22.0, "disarmed by the landing", armed=False),
)
RC_FAILSAFE = _scenario(
    "the radio is lost in the air: it lands automatically",
    *_LIFT_OFF,
    step(
        9.0,
        "the radio is lost: CRITICAL, LAND",
        (4, "Radio Failsafe"),
        custom_mode=0,
        failsafe=True,
        sensors_health=_HEALTH & ~RC_RECEIVER,
        velocity=(0.0, 0.0, 0.2),
    ),
    step(15.0, "the radio is back", (4, "Radio Failsafe Cleared"), failsafe=False, sensors_health=_HEALTH),
)
