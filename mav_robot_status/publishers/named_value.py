"""Statuses as NAMED_VALUE_INT and STATUSTEXT, for ground stations without ROBOT_STATUS.

These messages carry the system id of a vehicle and nothing else that names it. A group has the system id of its vehicle
and is left out: a ground station would take the emergency stop of an arm for that of the vehicle, which may be live.
Autopilots with the same system id have one status: what they do not agree on is unknown.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from ..interface import FIELDS, STATES, Audience, RobotMode, RobotStatus, RobotStatusMsg, TriState
from ..json_object import JsonMapping
from ..language import State, Trouble, state_of, troubles
from ..language.states import EMERGENCY_STOP, LOST, UNKNOWN
from ..mavlink.definitions import NamedValueInt, Statustext
from .json_lines import members
from .rate_limiter import RateLimitedPublisher, Schedule

Key = tuple[str, str, str]

VALUE_INTERVAL: Final = 2.0  # s
TEXT_INTERVAL: Final = 2.0  # s, the minimum, but for a text that is worse than the last one
INFO: Final = 6  # MAV_SEVERITY
LONGEST_TEXT: Final = 50  # bytes, of STATUSTEXT
MODES: Final = {
    RobotMode.AUTO: "Mode AUTO: a program drives",
    RobotMode.MANUAL: "Mode MANUAL: a pilot drives",
    RobotMode.UNKNOWN: "Mode UNKNOWN: a pilot or a program drives",
}
PACKED: Final = tuple((field.name, field.row.bits) for field in FIELDS if field.row.bits is not None)
"""The fields in RS_STATE, each with the lower of its two bits."""


class Text(NamedTuple):
    """A STATUSTEXT that is to be sent, and what the ground station knows after it."""

    severity: int
    text: str
    """At most LONGEST_TEXT bytes are sent."""
    mode: RobotMode | None
    known: Mapping[Key, Trouble]


def packed(status: RobotStatus) -> int:
    """RS_STATE: two bits for each field with `bits` in the table of fields.

    They hold the number of the value plus 1: 0 unknown, 1 false, 2 true; for the mode 0 unknown, 2 manual, 3 auto.
    """
    return sum((getattr(status, name) + 1) << bits for name, bits in PACKED)


def texts(
    line: JsonMapping, mode: RobotMode, before: RobotMode | None, known: Mapping[Key, Trouble], age: float | None
) -> list[Text]:
    """What a ground station has to be told, the worst first: one text for each event since it was told `known`.

    `before` is the mode of which it was told; None: it was told nothing. `age` is that of the last heartbeat, seconds.
    """
    state, now = state_of(line), {one.key: one for one in troubles(line)}
    if state is UNKNOWN:
        now["", "", ""] = Trouble(UNKNOWN, {}, "whether it can move is not known")
    if state is LOST:  # it ends nothing, and its mode is not news
        now, mode = {**known, **now}, mode if before is None else before
    found = [
        Text(one.state.severity, _begins(one, age), before, {**known, key: one})
        for key, one in now.items()
        if key not in known
    ]
    if mode is not before:
        found.append(Text(INFO, MODES[mode], mode, known))
    for key, one in known.items():
        if key not in now:
            rest = {name: other for name, other in known.items() if name != key}
            found.append(Text(INFO, _ends(one, state, line), before, rest))
    return sorted(found, key=lambda one: one.severity)


def _begins(one: Trouble, age: float | None) -> str:
    if one.state is EMERGENCY_STOP:
        return f"{one.state.word} engaged"
    if one.state is LOST and age is not None:
        return f"{one.state.word}: nothing heard for {age:.0f} s"
    return f"{one.state.word}: {one.why}" if one.why else one.state.word


def _ends(one: Trouble, state: State, line: JsonMapping) -> str:
    if one.state is EMERGENCY_STOP:
        released = line.get("e_stopped") is False
        return "Emergency stop released" if released else "Emergency stop: unknown whether it is released"
    if one.state is LOST:
        return f"Heard again: {state.word}"
    return f"{one.state.word.capitalize()} ended: {one.why}" if one.why else f"{one.state.word.capitalize()} ended"


def cut(text: str) -> bytes:
    """At most LONGEST_TEXT bytes of a text: whole characters."""
    return text.encode()[:LONGEST_TEXT].decode(errors="ignore").encode()


def agreed(statuses: Sequence[RobotStatus]) -> RobotStatus:
    """What several vehicles agree on. Each of them may be in error."""
    first = statuses[0]
    values = {f.name: getattr(first, f.name) for f in STATES if len({getattr(s, f.name) for s in statuses}) == 1}
    faulty = next((s for s in statuses if s.in_error is TriState.TRUE), None)
    if faulty is not None:
        values |= {"in_error": TriState.TRUE, "error_code": faulty.error_code}
    return RobotStatus(**values)


class _Sent:
    """The last values about one handle, and what one audience was told of it."""

    __slots__ = ("known", "mode", "msg", "severity", "text_at", "values")

    def __init__(self) -> None:
        self.values = Schedule()
        self.mode: RobotMode | None = None
        """The mode of which it was told."""
        self.known: Mapping[Key, Trouble] = {}
        """The troubles of which it was told."""
        self.msg: RobotStatusMsg | None = None
        """The last message of which everything was told."""
        self.text_at, self.severity = -math.inf, INFO
        """When the last text was sent, and how severe it was."""


class NamedValuePublisher(RateLimitedPublisher[_Sent]):
    """RS_STATE and RS_ERROR at 0.5 Hz and on change; a text for each event."""

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
        settled = sent.msg
        if settled is not None and settled.status == msg.status and settled.detail == msg.detail:
            return math.inf
        line = members(msg.handle, msg.status, msg.detail)
        if state_of(line) is not UNKNOWN:  # what is known again is told by what it is
            sent.known = {key: one for key, one in sent.known.items() if one.state is not UNKNOWN}
        found = texts(line, msg.status.mode, sent.mode, sent.known, msg.heartbeat_age)
        while found:
            first = found[0]
            if now < sent.text_at + TEXT_INTERVAL and first.severity >= sent.severity:
                return sent.text_at + TEXT_INTERVAL
            sent.mode, sent.known, sent.text_at, sent.severity = first.mode, first.known, now, first.severity
            self._port.send(Statustext(first.severity, cut(first.text), 0, 0), system, audience)
            found = texts(line, msg.status.mode, sent.mode, sent.known, msg.heartbeat_age)
        sent.msg = msg
        return math.inf
