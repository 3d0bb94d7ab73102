"""A motor that turns while the HEARTBEAT says disarmed: a motor test, or a test of an actuator.

ArduPilot's QuadPlane and Copter run a motor test without saying "armed" (ArduPlane/motor_test.cpp, `do_motor_test`;
ArduCopter/motor_test.cpp, where a disarm does not end a test that was begun armed), and an emergency stop does not end
it. PX4 turns a motor for ACTUATOR_TEST while disarmed (src/lib/mixer_module/actuator_test.cpp). So "disarmed" alone
does not mean that no motor turns. A motor output off its stop value shows that one does. A text, an accepted command or
rpm make it doubtful.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from ....mavlink.enumerations import MAV_CMD_ACTUATOR_TEST, MAV_CMD_DO_MOTOR_TEST
from ..identity import Family
from .outputs import AT_STOP, LEAST_PULSE, LIFT, LOW_END, OFF_STOP, STOPS_NEAR, Outputs

SAMPLES: Final = 2
"""Outputs in a row with a driven motor that prove a turning motor."""
LASTS: Final = 3.0
"""Seconds for which a motor may turn after the last output that drove it."""
AFTER_DISARM: Final = 1.0
"""Seconds after a disarm in which outputs may be older than it."""
COASTS: Final = 10.0
"""Seconds after a disarm in which a motor may turn without power: recorded, the rotor of a helicopter, wheels."""
LEAST: Final = 10.0
"""Seconds for which a test may last at least after its command was accepted."""
LONGEST: Final = 600.0
"""Seconds: the longest test of one motor (MOTOR_TEST_TIMEOUT_SEC in ArduCopter/motor_test.cpp)."""
STARTS, ENDS = "starting motor test", "finished motor test"
"""The texts of ArduCopter/motor_test.cpp."""
COMMANDS: Final = frozenset({MAV_CMD_DO_MOTOR_TEST, MAV_CMD_ACTUATOR_TEST})


@dataclass(slots=True)
class MotorTest:
    """The evidence that a motor turns while disarmed: a record that messages change in place. Monotonic seconds."""

    stop: Mapping[int, int] = field(default_factory=dict)
    """The pulse of each motor output while disarmed, us."""
    samples: int = 0
    """Outputs in a row that drive a motor."""
    driven_at: float = -math.inf
    """When such outputs last arrived."""
    turned_at: float = -math.inf
    """When they last proved a turning motor."""
    stopped_at: float = -math.inf
    """When all outputs were last at their stop values."""
    said_at: float = -math.inf
    """When a text or an accepted command last said that a test begins."""
    until: float = -math.inf
    """Until when that test may last."""
    source: str | None = None
    """The message that said it."""


def learnt(known: Mapping[int, int], values: Outputs, channels: tuple[int, ...], family: Family) -> Mapping[int, int]:
    """The stop values after one more look at the outputs of a disarmed vehicle.

    A value that a test may have caused does not replace a known one: a motor that does not reverse stands at the least
    value. One that reverses stands near the middle.
    """
    low, high = STOPS_NEAR.get(family, LOW_END)
    found = {}
    for c in channels:
        value, before = values[c - 1] if c <= len(values) else 0, known.get(c)
        if value < LEAST_PULSE:
            continue
        usual = low <= value <= high
        if before is None or (usual and (not low <= before <= high or (value < before and (low, high) == LOW_END))):
            found[c] = value
        else:
            found[c] = before
    return found


def heard_outputs(
    test: MotorTest, values: Outputs, motors: tuple[int, ...], assumed: bool, family: Family, now: float
) -> None:
    """Process the outputs of a disarmed vehicle; `motors`: its motor channels (from 1), `assumed` without parameters.

    Assumed channels count only if their stop values are alike and usual: others may move a control surface.
    """
    stop = test.stop = learnt(test.stop, values, motors, family)
    known = [c for c in motors if c in stop and values[c - 1] >= LEAST_PULSE]
    if assumed:
        low, high = STOPS_NEAR.get(family, LOW_END)
        for group in ([c for c in known if c in LIFT], [c for c in known if c not in LIFT]):
            stops = {stop[c] for c in group}
            if len(stops) > 1 or not all(low <= value <= high for value in stops):
                known = [c for c in known if c not in group]
    distances = [abs(values[c - 1] - stop[c]) for c in known]
    if any(distance > OFF_STOP for distance in distances):
        test.samples += 1
        test.driven_at = now
        if test.samples >= SAMPLES:
            test.turned_at = now
    else:
        test.samples = 0
        if distances and max(distances) <= AT_STOP:
            test.stopped_at = now


def heard_text(test: MotorTest, words: str, now: float) -> None:
    """Process a text of the autopilot."""
    if words == STARTS:
        test.said_at, test.until, test.source = now, now + LONGEST, f"STATUSTEXT: {words}"
    elif words == ENDS:
        test.until = min(test.until, now)


def accepted(test: MotorTest, command: int, seconds: float, now: float) -> None:
    """Process the acknowledgement of a command that turns a motor; `seconds`: for how long, 0 if that is not known."""
    lasts = min(max(seconds, LEAST), LONGEST) if math.isfinite(seconds) else LEAST
    if now + lasts > test.until:
        test.until = now + lasts
    test.said_at, test.source = now, f"COMMAND_ACK: accepted command {command}"


def is_possible(test: MotorTest, now: float) -> bool:
    """Whether outputs, a text or a command show that a test runs, or ran a moment ago."""
    return now <= test.driven_at + LASTS or (now <= test.until and test.stopped_at <= test.said_at + LASTS)
