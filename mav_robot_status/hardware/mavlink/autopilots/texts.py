"""The meaning of a STATUSTEXT: the form of a profile's table, and the texts that are irrelevant on every autopilot.

The first row that matches wins. Patterns are regular expressions matched from the start of the text, case-sensitive
unless marked `(?i)`.
"""

from __future__ import annotations

import re
from enum import Enum
from functools import cache
from typing import TYPE_CHECKING, Final, NamedTuple

from ....mavlink.enumerations import MAV_SEVERITY_CRITICAL

if TYPE_CHECKING:
    from collections.abc import Iterable


class Effect(Enum):
    """The effect of a text."""

    CAUSE = "raises the error causes"
    CLEAR = "clears the error causes"
    ESTOP = "says that an emergency stop is engaged"
    RELEASE = "says that an emergency stop is released"
    READINESS = "says why the vehicle cannot be armed"
    DETAIL = "explains a state that the HEARTBEAT reports"
    IGNORE = "says nothing about the status"


class When(Enum):
    """When a CAUSE row counts; otherwise its text is READINESS while disarmed, and DETAIL while armed."""

    ALWAYS = "always"
    ARMED = "armed"
    CRITICAL = "state CRITICAL"
    IN_TROUBLE = "armed, or state CRITICAL or FLIGHT_TERMINATION"


class TextRule(NamedTuple):
    """One row."""

    pattern: str
    effect: Effect
    codes: tuple[int, ...] = ()
    when: When = When.ALWAYS


Row = tuple[str, Effect] | tuple[str, Effect, tuple[int, ...]] | tuple[str, Effect, tuple[int, ...], When]


def table(rows: Iterable[Row]) -> tuple[TextRule, ...]:
    """Rows as written."""
    return tuple(TextRule(*row) for row in rows)


ARMING: Final = re.compile(r"Arming motors|Throttle armed|Armed by ")
"""Texts with which ArduPilot and PX4 announce that they are armed, before their next HEARTBEAT."""
UNCLASSIFIED: Final = MAV_SEVERITY_CRITICAL
"""While armed, a text without a row is an error at this severity or a more urgent one."""


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    """Compiled when the first text arrives: all rows of all autopilots take 10 ms."""
    return re.compile(pattern)


def classify(text: str, rules: tuple[TextRule, ...]) -> TextRule | None:
    """The first row that matches `text`, or None."""
    for rule in rules:
        if _compiled(rule.pattern).match(text):
            return rule
    return None


COMMON: Final = table(
    [
        (r".*(cleared|Cleared|disengaged|regained|denied|not available|Unsupported| OK|complete)", Effect.IGNORE),
        # seen at severity 1 or 2 on good flights
        (r"Initialising APM|GROUND START|Calibrating |Calibration |command received|Place vehicle", Effect.IGNORE),
        (r"ODOMETRY: |Not enough bandwidth|System does not support", Effect.IGNORE),
    ]
)
"""Texts of any autopilot that are never errors, at any severity."""
