"""What a STATUSTEXT means, by autopilot: tables of patterns, and `classify` which looks a text up in them.

The first row that matches wins. Patterns are regular expressions matched from the start of the text, case-sensitive
unless they say otherwise. A new autopilot is one more table and one line in `TABLES`.
"""

from __future__ import annotations

import re
from enum import Enum
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable


class Effect(Enum):
    """What a text does."""

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

    pattern: re.Pattern[str]
    effect: Effect
    codes: tuple[int, ...] = ()
    when: When = When.ALWAYS


Row = tuple[str, Effect] | tuple[str, Effect, tuple[int, ...]] | tuple[str, Effect, tuple[int, ...], When]


def table(rows: Iterable[Row]) -> tuple[TextRule, ...]:
    """Rows as written, with their patterns compiled."""
    return tuple(TextRule(re.compile(pattern), *rest) for pattern, *rest in rows)


UNCLASSIFIED: Final = 2  # a text that no row knows counts from this severity (CRITICAL) up, while armed


def classify(text: str, rules: tuple[TextRule, ...]) -> TextRule | None:
    """The first row that matches `text`, or None."""
    for rule in rules:
        if rule.pattern.match(text):
            return rule
    return None
