"""ArduPilot QuadPlane. Modes: 5 FBWA, 11 RTL, 18 QHOVER, 19 QLOITER, 20 QLAND, 21 QRTL. Its type is 1, FIXED_WING."""

from __future__ import annotations

from ..firmware import IN_AIR, ON_GROUND
from ..other_firmwares import QUADPLANE
from ..scenario import Scenario, Step, step

_STILL = (0.0, 0.0, 0.0)
TO_WINGS, TO_ROTORS, HOVERING, ON_WINGS = 1, 2, 3, 4


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, QUADPLANE, QUADPLANE.ready._replace(custom_mode=5), steps)


READY = _scenario("disarmed in FBWA on the ground, ready to be armed; no steps")
VTOL = _scenario(
    "takes off on its rotors, flies on its wings, lands on its rotors",
    step(2.0, "QHOVER", custom_mode=18, vtol_state=HOVERING),
    step(3.0, "the pilot arms: STANDBY", armed=True),
    step(6.0, "up", landed_state=IN_AIR, velocity=(0.0, 0.0, -2.0), throttle=60),
    step(9.0, "it holds its place in QLOITER", custom_mode=19, velocity=_STILL, throttle=45),
    step(
        12.0,
        "FBWA: transition to its wings",
        (6, "Transition started airspeed 0.6"),
        custom_mode=5,
        vtol_state=TO_WINGS,
        velocity=(10.0, 0.0, 0.0),
        throttle=80,
    ),
    step(16.0, "on its wings", (6, "Transition done"), vtol_state=ON_WINGS, velocity=(20.0, 0.0, 0.0)),
    step(18.0, "RTL: it returns in AUTO", custom_mode=11),
    step(21.0, "QRTL", (6, "VTOL approach d=466.7"), custom_mode=21),
    step(
        24.0,
        "back on its rotors",
        (6, "VTOL position1 v=18.5 d=99.8 h=22.2 dc=20.0"),
        vtol_state=TO_ROTORS,
        velocity=(5.0, 0.0, 0.0),
    ),
    step(26.0, "down", (6, "Land descend started"), vtol_state=HOVERING, velocity=(0.0, 0.0, 0.5)),
    step(30.0, "landed", landed_state=ON_GROUND, velocity=_STILL, throttle=0),
    step(32.0, "disarmed by the landing", (6, "Land complete"), armed=False),
)
QHOVER_DISARMED = _scenario(
    "disarmed in QHOVER, and IN_AIR: Q-modes may report IN_AIR on the ground",
    step(3.0, "QHOVER on the ground", custom_mode=18, vtol_state=HOVERING, landed_state=IN_AIR),
    step(9.0, "back in FBWA", custom_mode=5, vtol_state=None, landed_state=ON_GROUND),
)
QLAND = _scenario(
    "an automatic landing in QLAND",
    step(0.0, "hovering in QHOVER", custom_mode=18, vtol_state=HOVERING, armed=True, landed_state=IN_AIR, throttle=45),
    step(5.0, "QLAND: AUTO without the GUIDED bit", custom_mode=20, velocity=(0.0, 0.0, 0.5)),
    step(10.0, "landed", landed_state=ON_GROUND, velocity=_STILL, throttle=0),
    step(12.0, "disarmed by the landing", (6, "Land complete"), armed=False),
    step(13.0, "in QLAND it cannot be armed", prearm="QLAND mode not armable"),
)
