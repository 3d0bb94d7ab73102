"""Statuses as NAMED_VALUE_INT and STATUSTEXT, for ground stations without ROBOT_STATUS.

These messages carry the system id of a vehicle and nothing else that names it. A group has the system id of its vehicle
and is left out: a ground station would take the emergency stop of an arm for that of the vehicle, which may be live.
Autopilots with the same system id have one status: what they do not agree on is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from operator import attrgetter
from typing import Final

from ..interface import FIELDS, STATES, TRI_STATES, Audience, RobotMode, RobotStatus, RobotStatusMsg, TriState
from ..mavlink.definitions import NamedValueInt, Statustext
from .rate_limiter import RateLimitedPublisher, Schedule

VALUE_INTERVAL: Final = 2.0  # s
TEXT_INTERVAL: Final = 2.0  # s, the minimum
WARNING, INFO = 4, 6  # MAV_SEVERITY
LONGEST_TEXT: Final = 50  # bytes, of STATUSTEXT
WORDS: Final = {TriState.UNKNOWN: "?", TriState.FALSE: "0", TriState.TRUE: "1"}
PACKED: Final = tuple((field.name, field.row.bits) for field in FIELDS if field.row.bits is not None)
"""The fields in RS_STATE, each with the lower of its two bits."""
TEXT: Final = "RS: {mode} drv={drives_powered} mot={in_motion} poss={motion_possible} es={e_stopped} err={error_code}"
"""The STATUSTEXT. It has 50 characters, which leaves no room for more fields."""
ANNOUNCED: Final = attrgetter(*(field.name for field in FIELDS if field.row.announced))
"""The values whose change sends a STATUSTEXT."""


def packed(status: RobotStatus) -> int:
    """RS_STATE: two bits for each field with `bits` in the table of fields.

    They hold the number of the value plus 1: 0 unknown, 1 false, 2 true; for the mode 0 unknown, 2 manual, 3 auto.
    """
    return sum((getattr(status, name) + 1) << bits for name, bits in PACKED)


def text_of(status: RobotStatus) -> str:
    """`RS: AUTO drv=1 mot=1 poss=1 es=? err=0`; err is the error code, `?` if it is unknown whether there is one."""
    words = {field.name: WORDS[getattr(status, field.name)] for field in TRI_STATES}
    error = "?" if status.in_error is TriState.UNKNOWN else status.error_code
    text = TEXT.format(**words, mode=RobotMode(status.mode).name, error_code=error)
    return text[:LONGEST_TEXT]


def agreed(statuses: Sequence[RobotStatus]) -> RobotStatus:
    """What several vehicles agree on. Each of them may be in error."""
    first = statuses[0]
    values = {f.name: getattr(first, f.name) for f in STATES if len({getattr(s, f.name) for s in statuses}) == 1}
    faulty = next((s for s in statuses if s.in_error is TriState.TRUE), None)
    if faulty is not None:
        values |= {"in_error": TriState.TRUE, "error_code": faulty.error_code}
    return RobotStatus(**values)


class _Sent:
    """The last values and text about one handle, sent to one audience."""

    __slots__ = ("status", "text_at", "values")

    def __init__(self) -> None:
        self.values = Schedule()
        self.status: RobotStatus | None = None
        """The status in the last text."""
        self.text_at = -math.inf


class NamedValuePublisher(RateLimitedPublisher[_Sent]):
    """RS_STATE and RS_ERROR at 0.5 Hz and on change; a text when an announced field changes."""

    name = "mirror"
    state_type = _Sent

    def wants(self, audience: Audience) -> bool:
        """True for an audience of ground stations."""
        return audience.mirror

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hold the message of a vehicle until `service`."""
        if not msg.detail.members:
            super().publish(msg)

    def send_due(self, msg: RobotStatusMsg, system: int, audience: Audience, sent: _Sent, now: float) -> float:
        """Send the values and the text if they are due; return when the next one will be due, or inf."""
        statuses = [other.status for other in self._latest.values() if other.detail.system == system]
        if len(statuses) > 1:
            msg = msg._replace(status=agreed(statuses))
        return min(self._values(msg, system, audience, sent, now), self._text(msg, system, audience, sent, now))

    def next_periodic(self, audience: Audience, sent: _Sent) -> float:
        """An interval after the last values."""
        return sent.values.last + VALUE_INTERVAL

    def _values(self, msg: RobotStatusMsg, system: int, audience: Audience, sent: _Sent, now: float) -> float:
        values = packed(msg.status), msg.status.error_code
        due = sent.values.due(msg, values, VALUE_INTERVAL, now)
        if due > now:
            return due
        boot_ms = int(now * 1000) & 0xFFFFFFFF  # wraps after 49 days, like an autopilot's
        for name, value in zip((b"RS_STATE", b"RS_ERROR"), values, strict=True):
            self._port.send(NamedValueInt(boot_ms, value, name), system, audience)
        return math.inf

    def _text(self, msg: RobotStatusMsg, system: int, audience: Audience, sent: _Sent, now: float) -> float:
        status, before = msg.status, sent.status
        if before is not None and ANNOUNCED(status) == ANNOUNCED(before):
            return math.inf
        if now < sent.text_at + TEXT_INTERVAL:
            return sent.text_at + TEXT_INTERVAL
        fails = status.in_error is TriState.TRUE and (before is None or before.in_error is not TriState.TRUE)
        sent.status, sent.text_at = status, now
        text = Statustext(WARNING if fails else INFO, text_of(status).encode(), 0, 0)
        self._port.send(text, system, audience)
        return math.inf
