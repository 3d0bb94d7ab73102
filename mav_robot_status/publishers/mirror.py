"""Statuses for ground stations that do not know ROBOT_STATUS: as NAMED_VALUE_INT and STATUSTEXT, which all show."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ..interface import RobotMode, TriState
from ..mavlink.definitions import NamedValueInt, Statustext
from .thinning import Schedule, ThinnedPublisher

if TYPE_CHECKING:
    from ..interface import Audience, RobotStatus, RobotStatusMsg

VALUE_INTERVAL: Final = 2.0  # s
TEXT_INTERVAL: Final = 2.0  # s, at the least
WARNING, INFO = 4, 6  # MAV_SEVERITY
LONGEST_TEXT: Final = 50  # bytes, of STATUSTEXT
WORDS: Final = {TriState.UNKNOWN: "?", TriState.FALSE: "0", TriState.TRUE: "1"}


def packed(status: RobotStatus) -> int:
    """RS_STATE: from bit 0, two bits each for mode, e_stopped, drives_powered, motion_possible, in_motion, in_error.

    Each is its number plus 1: 0 is unknown, 1 false, 2 true; the mode is 0 unknown, 2 manual, 3 auto.
    """
    word = 0
    fields = status.mode, status.e_stopped, status.drives_powered, status.motion_possible, status.in_motion
    for place, value in enumerate((*fields, status.in_error)):
        word |= (value + 1) << 2 * place
    return word


def text_of(status: RobotStatus) -> str:
    """`RS: AUTO drv=1 mot=1 poss=1 es=? err=0`; err is the error code, `?` if it is unknown whether there is one."""
    error = "?" if status.in_error is TriState.UNKNOWN else status.error_code
    text = (
        f"RS: {RobotMode(status.mode).name} drv={WORDS[status.drives_powered]} mot={WORDS[status.in_motion]}"
        f" poss={WORDS[status.motion_possible]} es={WORDS[status.e_stopped]} err={error}"
    )
    return text[:LONGEST_TEXT]


class _Told:
    """What one audience was told about one handle."""

    __slots__ = ("status", "text_at", "values")

    def __init__(self) -> None:
        self.values = Schedule()
        self.status: RobotStatus | None = None
        """As of the last text."""
        self.text_at = -math.inf


class MirrorPublisher(ThinnedPublisher[_Told]):
    """RS_STATE and RS_ERROR at 0.5 Hz and on change, a text on a change of what people have to know."""

    name = "mirror"
    memory = _Told

    def wants(self, audience: Audience) -> bool:
        """True where ground stations are."""
        return audience.mirror

    def tell(self, msg: RobotStatusMsg, system: int, audience: Audience, told: _Told, now: float) -> float:
        """Send values and text if it is their turn."""
        return min(self._values(msg, system, audience, told, now), self._text(msg, system, audience, told, now))

    def _values(self, msg: RobotStatusMsg, system: int, audience: Audience, told: _Told, now: float) -> float:
        values = packed(msg.status), msg.status.error_code
        due = told.values.turn(msg, values, VALUE_INTERVAL, now)
        if due > now:
            return due
        boot_ms = int(now * 1000) & 0xFFFFFFFF  # wraps after 49 days, as every autopilot's
        for name, value in zip((b"RS_STATE", b"RS_ERROR"), values, strict=True):
            self._port.send(NamedValueInt(boot_ms, value, name), system, audience)
        return math.inf

    def _text(self, msg: RobotStatusMsg, system: int, audience: Audience, told: _Told, now: float) -> float:
        status, before = msg.status, told.status
        if before is not None and _telling(status) == _telling(before):
            return math.inf
        if now < told.text_at + TEXT_INTERVAL:
            return told.text_at + TEXT_INTERVAL
        fails = status.in_error is TriState.TRUE and (before is None or before.in_error is not TriState.TRUE)
        told.status, told.text_at = status, now
        text = Statustext(WARNING if fails else INFO, text_of(status).encode(), 0, 0)
        self._port.send(text, system, audience)
        return math.inf


def _telling(status: RobotStatus) -> tuple[int, ...]:
    """What people have to know: a change of these is worth a text."""
    return status.mode, status.e_stopped, status.motion_possible, status.in_error
