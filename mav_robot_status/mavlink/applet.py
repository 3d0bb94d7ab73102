"""The report of the applet on an ArduPilot, `contrib/ardupilot/robot_status.lua`: NAMED_VALUE_FLOAT RS_STOP."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from .decode import text

if TYPE_CHECKING:
    from .definitions import NamedValueFloat

NAME: Final = "RS_STOP"
EMERGENCY_STOP: Final = 1
SAFETY_SWITCH: Final = 2
WORDS: Final = {
    0: "no stop",
    EMERGENCY_STOP: "the emergency stop is engaged",
    SAFETY_SWITCH: "the safety switch is on",
    EMERGENCY_STOP + SAFETY_SWITCH: "the emergency stop is engaged, the safety switch is on",
}
"""Every value that the applet sends, in words."""
FRESH: Final = 3.0
"""Seconds for which a report counts. The applet repeats it once a second."""


def stop_report(message: NamedValueFloat) -> int | None:
    """The bits of an RS_STOP; None if the message has another name or a value that the applet never sends."""
    return int(message.value) if text(message.name) == NAME and message.value in WORDS else None
