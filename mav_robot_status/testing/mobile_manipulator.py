"""A mobile manipulator that does not exist: a fake rover with a fake arm on it play one story.

As a program it plays the story again and again, until a signal ends it:

    python -m mav_robot_status.testing.mobile_manipulator
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from ..streams import say
from .fake_arm import FakeArm
from .fake_autopilot import FakeAutopilot
from .firmwares import ARDUROVER
from .scenario import Action, Scenario, Step, step, with_applet

NAP: Final = 0.2
"""Seconds between two looks for a signal."""


class Act(NamedTuple):
    """What base and arm do at one time."""

    step: Step
    """The step of the base. Its note describes both."""
    arm: Callable[[FakeArm], None] | None = None
    """None: the arm continues."""


def _act(at: float, note: str, arm: Callable[[FakeArm], None] | None = None, **base: Any) -> Act:
    return Act(step(at, note, **base), arm)


def _stand(arm: FakeArm) -> None:
    arm.run_program(moving=False)


def _reach(arm: FakeArm) -> None:
    arm.run_program(moving=True)


_FORWARD, _HALT = (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)
_GO: Final[dict[str, Any]] = {"velocity": _FORWARD, "throttle": 40}
_STOP: Final[dict[str, Any]] = {"velocity": _HALT, "throttle": 0}

ACTS: Final = (
    _act(0.0, "the base is disarmed, the arm is ready: a part of the robot can move", _stand),
    _act(2.5, "the base is armed and drives its mission: the robot moves", armed=True, custom_mode=10, **_GO),
    _act(6.0, "the base has arrived and stands: the robot can move, and does not", **_STOP),
    _act(8.5, "the arm reaches: the robot moves again, although its base stands", _reach),
    _act(11.0, "emergency stop of the arm: the base is not stopped and may still move", FakeArm.press_emergency_stop),
    _act(13.5, "the base drives: one part is stopped, and another one moves", **_GO),
    _act(15.5, "the base stands again", **_STOP),
    _act(17.5, "the arm is released and powered: no part is stopped", _stand),
    _act(19.5, "the radio of the base is cut while the arm reaches", _reach, action=Action.SILENCE),
    _act(25.0, "the base is heard again, and the arm stands: everything is known", _stand, action=Action.RESUME),
    _act(28.0, "the end", action=Action.END),
)
"""The story."""
BASE: Final = with_applet(
    Scenario(
        "a rover with an arm on it",
        ARDUROVER,
        ARDUROVER.ready,
        steps=tuple(act.step for act in ACTS),
        streams={1: 2.0, 245: 2.0, 33: 4.0, 30: 4.0, 74: 2.0, 2: 1.0, 36: 2.0, 193: 1.0},
    )
)
"""The part of the base. It runs the applet, so that its emergency stop is known while it is armed."""


def follow(arm: FakeArm, on_note: Callable[[Step], None]) -> Callable[[Step], None]:
    """For `on_note` of the base: moves the arm with each step of the story, and passes every step on."""
    parts = {act.step.note: act.arm for act in ACTS}

    def on_step(step: Step) -> None:
        part = parts.get(step.note)  # a command to the base is a step too
        if part is not None:
            part(arm)
        on_note(step)

    return on_step


def main(arguments: list[str] | None = None) -> None:
    """Play the story in a loop. Exits with 1 if a port is taken."""
    options = _parser().parse_args(arguments)
    ended: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: ended.append(number))
    try:
        arm = FakeArm(options.arm, options.dashboard)
    except OSError as error:
        why = os.strerror(error.errno or 0)
        sys.exit(f"mobile_manipulator: ports {options.arm}, {options.dashboard}: {why}")
    with arm:
        say(f"the base sends to udp:127.0.0.1:{options.base}")
        say(f"the arm listens on 127.0.0.1:{arm.port}, its dashboard on {arm.dashboard_port}")
        with FakeAutopilot(BASE, to=("127.0.0.1", options.base), loop=True, on_note=follow(arm, _tell)):
            while not ended:
                time.sleep(NAP)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="mobile_manipulator", description="A fake rover with a fake arm on it.")
    for name, port, what in (
        ("--base", 14550, "UDP port to which the base sends"),
        ("--arm", 30004, "RTDE port of the arm"),
        ("--dashboard", 29999, "port of its dashboard server"),
    ):
        parser.add_argument(name, type=int, default=port, metavar="PORT", help=f"{what} ({port})")
    return parser


def _tell(step: Step) -> None:
    say(f"{step.at:5.1f} s  {step.note}")


if __name__ == "__main__":
    main()
