"""The scenario of the `demo` command: half a minute of a rover. Each note gives the reason for a change."""

from __future__ import annotations

from ..firmwares import ARDUROVER
from ..scenario import Action, Scenario, step
from .ardurover import RADIO_BACK, RADIO_LOST, RELEASED, Changes

_STOPPED = (0.0, 0.0, 0.0)
_MISSION: Changes = {"custom_mode": 10, "velocity": (2.0, 0.0, 0.0), "throttle": 40}

DEMO = Scenario(
    "a rover from power-on to power-off",
    ARDUROVER,
    ARDUROVER.booting,
    steps=(
        step(0.0, "power on: the autopilot initialises, the mode is unknown"),
        *ARDUROVER.boot[:-1],
        step(2.1, "the autopilot reports why it cannot be armed", (2, "PreArm: GPS 1: Bad fix")),
        ARDUROVER.boot[-1],
        step(8.5, "the driver arms: the drives are powered", armed=True),
        step(10.0, "the driver drives off in MANUAL", velocity=(1.0, 0.0, 0.0), throttle=31),
        step(12.5, "AUTO: the mission drives", (6, "Mission: 1 WP"), **_MISSION),
        step(
            15.0,
            "the radio is lost: a failsafe, the rover stops in HOLD, in_error becomes true",
            (4, "Radio Failsafe"),
            **RADIO_LOST,
        ),
        step(
            17.5,
            "the radio is back: the error clears, the rover still holds",
            (6, "Radio Failsafe Cleared"),
            **RADIO_BACK,
        ),
        step(18.5, "AUTO again: the mission continues", (6, "Mission: 1 WP"), **_MISSION),
        step(
            20.5,
            "emergency stop by a switch of the remote control: armed, but the drives are off",
            (6, "RC7: MotorEStop HIGH"),
            emergency_stop=True,
        ),
        step(21.0, "the rover has stopped", velocity=_STOPPED, throttle=58),
        step(22.5, "emergency stop released: it drives on", (6, "RC7: MotorEStop LOW"), **RELEASED),
        step(24.0, "it runs into a wall", velocity=_STOPPED, throttle=80),
        step(
            24.5,
            "the crash check selects HOLD: an error until it is armed again",
            (0, "Crash: Going to HOLD"),
            custom_mode=4,
            throttle=0,
        ),
        step(26.5, "the driver disarms", armed=False),
        step(27.5, "the link is cut: the status soon becomes unknown", action=Action.SILENCE),
        step(32.5, "the link is back, and so is the status", action=Action.RESUME),
        step(34.0, "the end", action=Action.END),
    ),
    streams={1: 2.0, 245: 2.0, 33: 4.0, 30: 4.0, 74: 2.0, 2: 1.0, 36: 2.0, 193: 1.0},
)
