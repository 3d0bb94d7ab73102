"""The payloads of a robot's topics: its status as a native line, and each change as an event."""

from __future__ import annotations

from typing import Final

from ...clock import rfc3339
from ...interface import FIELDS, RobotStatus, RobotStatusMsg
from ...json_object import JsonMapping, JsonObject
from ..json_lines import members, native, native_body

UNKNOWN: Final[JsonObject] = {
    **{field.name: field.plain(value) for field, value in zip(FIELDS, RobotStatus(), strict=True)},
    "errors": [],
}
"""The members of a line while the status is unknown."""


def line_of(msg: RobotStatusMsg, seq: int) -> str:
    """The native line without its line end."""
    return native(msg, seq, native_body(msg.handle, msg.status, msg.detail))[:-1]


def unknown(line: JsonMapping, stamp: str, why: str | None) -> JsonObject:
    """The line of a robot without a live status: it has the robot's identity, and UNKNOWN for the rest."""
    seen = bool(line.get("stamp"))
    vehicle, members = line.get("vehicle"), line.get("members")
    return {
        "stamp": stamp,
        "seq": line.get("seq", 0),
        "handle": line.get("handle"),
        "system": line.get("system"),
        "component": line.get("component"),
        **UNKNOWN,
        "inhibits": [{"name": "LINK_STALE", "text": why, "since": stamp}],
        "vehicle": {
            "autopilot": None,
            "type": None,
            **(vehicle if isinstance(vehicle, dict) else {}),
            "flight_mode": None,
            "custom_mode": None,
            "state": None,
        },
        **(_unknown_group(members) if isinstance(members, list) else {}),
        "link": {"state": "LOST" if seen else "NEVER_SEEN", "heartbeat_age": None},
    }


def _unknown_group(members: list[object]) -> JsonObject:
    """What only a group has: none of its members can be known to be ready."""
    return {
        "members": members,
        "ready": False,
        "not_ready": [{"handle": member, "why": "LINK_STALE"} for member in members],
    }


def event_of(msg: RobotStatusMsg, old: JsonMapping, new: JsonMapping, robot: str, session: str, seq: int) -> JsonObject:
    """One change: each changed member with its old and new value. The first event has every member, with null as its
    old value."""
    return {
        "id": f"{session}-{seq}",
        "session": session,
        "seq": seq,
        "stamp": rfc3339(msg.unix_us),
        "robot": robot,
        "handle": msg.handle,
        "system": msg.detail.system,
        "component": msg.detail.component,
        "changed": {
            name: {"old": old.get(name), "new": value}
            for name, value in new.items()
            if not old or old.get(name) != value
        },
    }


def members_of(msg: RobotStatusMsg) -> JsonObject:
    """The members that can change. Those of `vehicle` and `link` have names like `vehicle.flight_mode`."""
    line = members(msg.handle, msg.status, msg.detail)
    groups = {"vehicle": msg.detail.vehicle._asdict(), "link": line.pop("link")}
    for name in ("handle", "system", "component", "vehicle"):
        del line[name]
    return {
        **line,
        **{f"{group}.{name}": value for group, members in groups.items() for name, value in members.items()},
    }
