"""What is said about a robot: its status as a native line, and each change as an event. JSON texts and values."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, Final

from ...clock import rfc3339
from ..json_lines import native, native_body

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...interface import RobotStatusMsg

UNKNOWN: Final[dict[str, Any]] = {
    "mode": "UNKNOWN",
    **dict.fromkeys(("e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")),
    "error_code": 0,
    "errors": [],
}
"""The members of a line of which nothing is known."""


def line_of(msg: RobotStatusMsg, seq: int) -> str:
    """The native line, without its end."""
    return native(msg, seq, native_body(msg.handle, msg.status, msg.detail))[:-1]


def unknown(line: Mapping[str, Any], stamp: str, why: str | None) -> dict[str, Any]:
    """What is left of a robot's line once nobody speaks for it: who it is, and nothing else."""
    heard = bool(line.get("stamp"))
    vehicle = line.get("vehicle")
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
        "link": {"state": "LOST" if heard else "NEVER_SEEN", "heartbeat_age": None},
    }


def event_of(
    msg: RobotStatusMsg, old: Mapping[str, Any], new: Mapping[str, Any], robot: str, session: str, seq: int
) -> dict[str, Any]:
    """What one change was: every member that is another now, with what it was; null for all before the first, which
    has no `old`."""
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


def members_of(msg: RobotStatusMsg) -> dict[str, Any]:
    """A line's members that can change, those of `vehicle` and `link` as `vehicle.flight_mode`, `link.state`."""
    line = json.loads("{" + native_body(msg.handle, msg.status, msg.detail) + "}}")
    groups = {name: line.pop(name) for name in ("vehicle", "link")}
    for name in ("handle", "system", "component"):
        del line[name]
    return {
        **line,
        **{f"{group}.{name}": value for group, members in groups.items() for name, value in members.items()},
    }
