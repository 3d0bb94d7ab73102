"""ArduPilot Copter. Modes: 0 STABILIZE, 3 AUTO, 5 LOITER, 6 RTL."""

from __future__ import annotations

from typing import Any

from ..firmware import IN_AIR, LANDING, ON_GROUND, TAKEOFF
from ..firmwares import ARDUCOPTER, ARDUCOPTER_QUICK
from ..scenario import RC_RECEIVER, Action, Scenario, Step, step

_HEALTH = ARDUCOPTER.ready.sensors_health
_STILL = (0.0, 0.0, 0.0)

_TAKE_OFF = (
    step(3.0, "the pilot arms: the rotors idle", custom_mode=5, armed=True),
    step(5.0, "take-off", landed_state=TAKEOFF, velocity=(0.0, 0.0, -1.5), throttle=40),
    step(8.0, "hovering in LOITER", landed_state=IN_AIR, velocity=_STILL, throttle=34),
)
_LANDED: dict[str, Any] = {"landed_state": ON_GROUND, "velocity": _STILL, "throttle": 0}


def _scenario(title: str, *steps: Step) -> Scenario:
    return Scenario(title, ARDUCOPTER, ARDUCOPTER.ready, steps)


READY = _scenario("disarmed in STABILIZE on the ground, ready to be armed; no steps")
BOOT = Scenario("power on until ready to be armed", ARDUCOPTER, ARDUCOPTER.booting, ARDUCOPTER.boot)
PREARM_FAILING = _scenario(
    "cannot be armed for a while",
    step(2.0, "the compass fails: so do the pre-arm checks", prearm="Compass not healthy", sensors_health=_HEALTH & ~4),
    step(4.0, "the pilot tries to arm and is refused", (2, "Arm: Compass not healthy")),
    step(8.0, "the compass is back", prearm="", sensors_health=_HEALTH),
)
MANUAL = _scenario(
    "armed, flown by hand, landed",
    *_TAKE_OFF,
    step(10.0, "the pilot flies forward", velocity=(3.0, 0.0, 0.0), throttle=37),
    step(14.0, "the pilot lands", velocity=(0.0, 0.0, 0.5), throttle=30),
    step(18.0, "on the ground", **_LANDED),
    step(20.0, "the pilot disarms", armed=False, custom_mode=0),
)
AUTO = _scenario(
    "a mission in AUTO",
    *_TAKE_OFF,
    step(10.0, "AUTO: the mission flies", (6, "Mission: 2 WP"), custom_mode=3, velocity=(3.0, 1.0, 0.0)),
    step(16.0, "the mission lands", (6, "Mission: 5 RTL"), landed_state=LANDING, velocity=(0.0, 0.0, 0.5)),
    step(20.0, "landed", **_LANDED),
    step(20.1, "disarmed by the landing", armed=False),
)
RC_FAILSAFE = _scenario(
    "the radio is lost in flight and comes back",
    *_TAKE_OFF,
    step(
        10.0,
        "the radio is lost: CRITICAL, RTL",
        (4, "Radio Failsafe"),
        custom_mode=6,
        failsafe=True,
        sensors_health=_HEALTH & ~RC_RECEIVER,
        velocity=(4.0, 0.0, 0.0),
    ),
    step(16.0, "the radio is back", (4, "Radio Failsafe Cleared"), failsafe=False, sensors_health=_HEALTH),
    step(18.0, "the pilot takes over in LOITER", custom_mode=5, velocity=_STILL),
)
SAFETY_SWITCH = _scenario(
    "the hardware safety switch is pressed on the ground, and again",
    step(3.0, "safety switch on: the outputs are dead", safety_switch=True),
    step(8.0, "safety switch off", safety_switch=False),
)
RC_ESTOP = _scenario(
    "motor emergency stop by an RC switch in flight",
    *_TAKE_OFF,
    step(
        10.0,
        "emergency stop: the copter falls",
        (6, "RC7: MotorEStop HIGH"),
        emergency_stop=True,
        velocity=(0.0, 0.0, 8.0),
        throttle=100,
    ),
    step(11.2, "it does not climb at full throttle", (0, "Potential Thrust Loss (3)")),
    step(12.0, "it has hit the ground; the land detector has not noticed", velocity=_STILL),
    step(15.0, "lying still, it disarms", armed=False, **_LANDED),
    step(19.0, "released", (6, "RC7: MotorEStop LOW"), emergency_stop=False),
)
RC_ESTOP_BARE = RC_ESTOP._replace(
    title="motor emergency stop by an RC switch in flight, in the words of 4.2, which do not name the channel",
    steps=tuple(
        s._replace(texts=tuple(t._replace(text=t.text.removeprefix("RC7: ")) for t in s.texts)) for s in RC_ESTOP.steps
    ),
)
CRASH = _scenario(
    "the copter tips over",
    *_TAKE_OFF,
    step(10.0, "it tumbles", rates=(2.5, 1.0, 0.3), velocity=(1.0, 0.0, 3.0), throttle=60),
    step(
        12.0,
        "the crash check disarms it",
        (0, "Crash: Disarming: AngErr=57>30, Accel=0.5<3.0"),
        armed=False,
        rates=_STILL,
        **_LANDED,
    ),
)
LINK_SILENCE = _scenario(
    "the link is silent for 6 s while the copter hovers",
    *_TAKE_OFF,
    step(10.0, "the link is cut", action=Action.SILENCE),
    step(16.0, "the link is back", action=Action.RESUME),
)
QUICK_REBOOT = Scenario(
    "ready, and again at the first heartbeat after a reboot: only what is requested shows that it was one",
    ARDUCOPTER_QUICK,
    ARDUCOPTER_QUICK.ready,
)
LATE_STREAMS = Scenario(
    "the streams of a ground station begin long after the first heartbeat",
    ARDUCOPTER,
    ARDUCOPTER.ready,
    streams={1: 2.0, 30: 10.0, 33: 4.0, 74: 10.0, 193: 4.0, 36: 4.0},
    streams_after=8.0,
)
REBOOT = _scenario("the autopilot reboots on the ground", step(4.0, "the autopilot reboots", action=Action.REBOOT))
