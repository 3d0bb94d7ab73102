"""One handle of several: the status of a robot that has several controllers, such as an arm on a vehicle.

Each field of the group is three-valued logic over the field of its members, hazard first. A member
whose link is lost is UNKNOWN in every field, and so counts as UNKNOWN.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from ..interface import (
    GROUP,
    STATES,
    Detail,
    ErrorCause,
    Evidence,
    IndustrialRobotStatusHandle,
    Inhibit,
    LinkState,
    NotReady,
    RobotMode,
    RobotStatus,
    TriState,
    Vehicle,
)
from .join import Logic, join

MOTION_UNKNOWN: Final = "MOTION_UNKNOWN"
"""Why a member is not ready that does not say whether it can move."""
NOT_POSSIBLE: Final = "MOTION_NOT_POSSIBLE"
"""The inhibit for a member that gives no reason of its own."""


class Rule(NamedTuple):
    """The rule for one field."""

    logic: Logic
    of: str | None = None
    """The one member that decides; None: all of them do."""


RULES: Final[dict[str, Rule]] = {
    "mode": Rule(Logic.ANY),  # a person commands a part of it
    "e_stopped": Rule(Logic.AGREE),  # a part that is not stopped is a hazard
    "drives_powered": Rule(Logic.ANY),  # a hazard while any part is powered
    "motion_possible": Rule(Logic.ANY),  # a hazard while any part can move
    "in_motion": Rule(Logic.ANY),
    "in_error": Rule(Logic.ANY),
}
"""The rule for each field, unless the configuration names another one."""
assert tuple(RULES) == tuple(field.name for field in STATES)

MANUAL_IS: Final = {
    RobotMode.MANUAL: TriState.TRUE,
    RobotMode.AUTO: TriState.FALSE,
    RobotMode.UNKNOWN: TriState.UNKNOWN,
}
IS_MANUAL: Final = {value: mode for mode, value in MANUAL_IS.items()}


class Member(NamedTuple):
    """What the handle of a member holds."""

    name: str
    status: RobotStatus
    detail: Detail
    heard_at: float | None
    evidence: Mapping[str, Evidence]


def member_of(handle: IndustrialRobotStatusHandle) -> Member:
    """What a handle holds now."""
    return Member(handle.name, handle.status, handle.detail, handle.heard_at, handle.evidence)


class Group(NamedTuple):
    """A group as configured."""

    name: str
    """The name of its handle."""
    handles: tuple[str, ...] = ()
    """The names of its members. Empty: every handle that is not a group."""
    rules: Mapping[str, Rule] = {}
    """The rules that differ from RULES, by field."""
    component: int = 0
    """The MAVLink component id under which it is published, beside the system id of its first vehicle."""

    def rule(self, field: str) -> Rule:
        """The rule for one field."""
        return self.rules.get(field, RULES[field])


class Combined(NamedTuple):
    """The values for the handle of a group."""

    status: RobotStatus
    detail: Detail
    evidence: dict[str, Evidence]


def combine(group: Group, members: Sequence[Member], before: Detail, unix_us: int) -> Combined:
    """The status of a group of these members at `unix_us`; `before` is the previous detail."""
    values, evidence = {}, {}
    for field in RULES:
        values[field], evidence[field] = _field(group, field, members)
    in_error, possible = values["in_error"], values["motion_possible"]
    errors = _merged([_of_member(m.name, m.detail.errors) for m in members]) if in_error is TriState.TRUE else ()
    status = RobotStatus(
        mode=IS_MANUAL[values["mode"]],
        e_stopped=values["e_stopped"],
        drives_powered=values["drives_powered"],
        motion_possible=possible,
        in_motion=values["in_motion"],
        in_error=in_error,
        error_code=errors[0].code if errors else _code(members, in_error),
    )
    detail = Detail(
        system=next((m.detail.system for m in members if m.detail.system is not None), None),
        errors=errors,
        inhibits=() if possible is TriState.TRUE else _inhibits(members, before, unix_us),
        vehicle=Vehicle(type=GROUP),
        link=_link(members),
        members=tuple(member.name for member in members),
        not_ready=tuple(NotReady(m.name, why) for m in members if (why := _not_ready(m)) is not None),
    )
    if detail.system is not None:
        detail = detail._replace(component=group.component)
    return Combined(status, detail, evidence)


def _not_ready(member: Member) -> str | None:
    """Why a member cannot work now; None if it can."""
    status, detail = member.status, member.detail
    if detail.link is not LinkState.CONNECTED:
        return "LINK_STALE"
    if status.e_stopped is TriState.TRUE:
        return "E_STOPPED"
    if status.in_error is TriState.TRUE:
        return detail.errors[0].name if detail.errors else f"ERROR_{status.error_code}"
    if status.motion_possible is TriState.TRUE:
        return None
    if detail.inhibits:
        return detail.inhibits[0].name
    return NOT_POSSIBLE if status.motion_possible is TriState.FALSE else MOTION_UNKNOWN


def _value(member: Member, field: str) -> TriState:
    if field == "mode":
        return MANUAL_IS[member.status.mode]
    value: TriState = getattr(member.status, field)
    return value


def _field(group: Group, field: str, members: Sequence[Member]) -> tuple[TriState, Evidence]:
    """One field, with the member that decided."""
    logic, of = group.rule(field)
    asked = [member for member in members if of is None or member.name == of]
    value = join(logic, [_value(member, field) for member in asked])
    deciding = [member for member in asked if _value(member, field) is value]
    if not deciding:
        return value, Evidence("no member of the group knows")
    first = deciding[0]
    why = first.evidence.get(field)
    others = f", and {len(deciding) - 1} more" if len(deciding) > 1 else ""
    if why is None:
        return value, Evidence(f"{first.name}{others}", None, first.heard_at)
    return value, Evidence(f"{first.name}{others}: {why.rule}", why.source, why.at, why.next)


def _code(members: Sequence[Member], in_error: TriState) -> int:
    """The error code if no member lists its errors."""
    codes = [member.status.error_code for member in members if member.status.error_code]
    return codes[0] if codes and in_error is TriState.TRUE else 0


def _of_member(name: str, causes: Sequence[ErrorCause]) -> list[ErrorCause]:
    return [cause if cause.handle is not None else cause._replace(handle=name) for cause in causes]


def last_heard(heard: Sequence[float | None]) -> float | None:
    """When the member that has been silent for longest was last heard; None if one never was, or there is none."""
    known = [at for at in heard if at is not None]
    return min(known) if known and len(known) == len(heard) else None


def _merged(lists: Sequence[Sequence[ErrorCause]]) -> tuple[ErrorCause, ...]:
    """The causes of all members: first the most important one of each, then the second of each, and so on."""
    longest = max(map(len, lists), default=0)
    return tuple(causes[place] for place in range(longest) for causes in lists if place < len(causes))


def _inhibits(members: Sequence[Member], before: Detail, unix_us: int) -> tuple[Inhibit, ...]:
    """The reasons of all members that cannot move, or may not be able to."""
    found: list[Inhibit] = []
    for member in members:
        if member.status.motion_possible is TriState.TRUE:
            continue
        given = member.detail.inhibits
        if not given and member.status.motion_possible is TriState.FALSE:
            given = (_unexplained(member.name, before, unix_us),)
        found += [one if one.handle is not None else one._replace(handle=member.name) for one in given]
    return tuple(found)


def _unexplained(name: str, before: Detail, unix_us: int) -> Inhibit:
    """The inhibit for a member that cannot move and does not say why, with its time."""
    since = (one.since_us for one in before.inhibits if (one.name, one.handle) == (NOT_POSSIBLE, name))
    return Inhibit(NOT_POSSIBLE, None, next(since, unix_us), name)


def _link(members: Sequence[Member]) -> LinkState:
    """CONNECTED while one member is: the others are unknown, and say so themselves."""
    states = {member.detail.link for member in members}
    for state in (LinkState.CONNECTED, LinkState.LOST):
        if state in states:
            return state
    return LinkState.NEVER_SEEN
