"""RS_STOP: the applet on an ArduPilot says whether its emergency stop or its safety switch holds the motors.

It is a NAMED_VALUE_FLOAT of the autopilot: 1 for the emergency stop plus 2 for the safety switch, sent at each change
and once a second. The autopilot knows its stop, so RS_STOP counts more than texts, pre-arm checks and
outputs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from ....mavlink.definitions import NamedValueFloat

NAME: Final = b"RS_STOP"
EMERGENCY_STOP, SAFETY_SWITCH = 1, 2
VALUES: Final = frozenset({0, EMERGENCY_STOP, SAFETY_SWITCH, EMERGENCY_STOP | SAFETY_SWITCH})
FRESH: Final = 3.0  # s
CONTRADICTED: Final = 0.5
"""Seconds for which a motor may be driven after the applet has reported a stop: messages cross."""


class Applet(NamedTuple):
    """The latest word of the applet."""

    value: int
    at: float
    """Monotonic seconds."""
    driven_since: float | None = None
    """Since when a motor is driven although this word says that it is stopped."""


def is_word(message: NamedValueFloat) -> bool:
    """Whether a message is from the applet, by its name."""
    return message.name.rstrip(b"\0") == NAME


def value_of(message: NamedValueFloat) -> int | None:
    """The word in a message of the applet; None if it has no meaning."""
    return int(message.value) if message.value in VALUES else None


def heard(before: Applet | None, value: int, now: float) -> Applet:
    """The state after one more word."""
    since = before.driven_since if before is not None and value and before.value else None
    return Applet(value, now, since)


def driven(applet: Applet, is_driven: bool, now: float) -> Applet:
    """The state after one more look at the outputs."""
    if not (is_driven and applet.value):
        return applet if applet.driven_since is None else applet._replace(driven_since=None)
    return applet if applet.driven_since is not None else applet._replace(driven_since=now)


def is_fresh(applet: Applet, now: float) -> bool:
    """Whether the word counts."""
    return now <= applet.at + FRESH


def stops(applet: Applet, honours: bool) -> bool:
    """Whether the word means a stop. `honours`: whether the emergency stop stops the motors of this vehicle."""
    return bool(applet.value & (EMERGENCY_STOP | SAFETY_SWITCH if honours else SAFETY_SWITCH))
