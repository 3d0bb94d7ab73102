"""PX4 on a VTOL: type 22. It sends texts only to a link with a ground station."""

from __future__ import annotations

from ..firmware import IN_AIR, LANDING, ON_GROUND, TAKEOFF, px4_mode
from ..other_firmwares import PX4_VTOL
from ..scenario import Scenario, Step, step

_STILL = (0.0, 0.0, 0.0)
POSCTL, MISSION, VTOL_TAKEOFF = px4_mode(3), px4_mode(4, 4), px4_mode(4, 10)
TO_WINGS, TO_ROTORS, HOVERING, ON_WINGS = 1, 2, 3, 4

_TO_THE_WINGS = (
    step(3.0, "armed in AUTO.VTOL_TAKEOFF", armed=True, custom_mode=VTOL_TAKEOFF),
    step(5.0, "takes off on its rotors", (6, "Takeoff detected\t"), landed_state=TAKEOFF, velocity=(0.0, 0.0, -1.5)),
    step(
        8.0, "transition to its wings", landed_state=IN_AIR, vtol_state=TO_WINGS, velocity=(8.0, 0.0, 0.0), throttle=70
    ),
    step(11.0, "on its wings, in AUTO.MISSION", custom_mode=MISSION, vtol_state=ON_WINGS, velocity=(18.0, 0.0, 0.0)),
)


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, PX4_VTOL, PX4_VTOL.ready, steps)


READY = _scenario("disarmed in POSCTL on the ground, ready to be armed; no steps")
TRANSITION = _scenario(
    "a mission: takes off on its rotors, flies on its wings, returns to its rotors",
    *_TO_THE_WINGS,
    step(15.0, "back on its rotors", vtol_state=TO_ROTORS, velocity=(5.0, 0.0, 0.0)),
    step(18.0, "POSCTL: the pilot hovers", custom_mode=POSCTL, vtol_state=HOVERING, velocity=_STILL),
    step(21.0, "the pilot lands", landed_state=LANDING, velocity=(0.0, 0.0, 0.5)),
    step(24.0, "landed", (6, "Landing detected\t"), landed_state=ON_GROUND, velocity=_STILL, throttle=0),
    step(26.0, "disarmed", armed=False),
)
KILL = _scenario(
    "the kill switch on its wings: state FLIGHT_TERMINATION until it is released",
    *_TO_THE_WINGS,
    step(
        14.0,
        "kill: it glides and falls",
        (2, "Kill engaged\t"),
        emergency_stop=True,
        prearm="Kill switch engaged",
        velocity=(15.0, 0.0, 6.0),
        throttle=0,
    ),
    step(17.0, "it has hit the ground", landed_state=ON_GROUND, velocity=_STILL),
    step(19.0, "five seconds after the kill it disarms", armed=False),
    step(23.0, "released", (6, "Kill disengaged\t"), emergency_stop=False, prearm=""),
)
