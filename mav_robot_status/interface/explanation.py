"""A handle with the evidence for each field, as plain values, for `explain --as-json` and the web page."""

from __future__ import annotations

from typing import Final

from ..clock import Instant, rfc3339
from ..json_object import JsonObject
from .fields import STATES, Field
from .handle import IndustrialRobotStatusHandle

NO_ADVICE: Final = "Look at what its controller reports, or at its members: `explain` names the source of each field."
"""What would make a field known of a robot whose interface does not say."""


def explanation(handle: IndustrialRobotStatusHandle, now: Instant) -> JsonObject:
    """The status in a handle with its evidence. Ages are in seconds at `now`; UNKNOWN is None.

    `next` is what would make a field known, None where it is known.

    `members`, `ready` and `not_ready` are those of a JSON line: only a group has them.
    """
    detail = handle.detail
    return {
        "stamp": rfc3339(now.unix_us),
        "handle": handle.name,
        "system": detail.system,
        "component": detail.component,
        "vehicle": detail.vehicle.members(),
        **detail.group_members(),
        "link": {
            "state": detail.link.value,
            "heartbeat_age": None if handle.heard_at is None else round(now.mono - handle.heard_at, 3),
        },
        "fields": {field.name: _field(handle, field, now.mono) for field in STATES},
        "error_code": handle.status.error_code,
        "errors": [error.members() for error in detail.errors],
        "inhibits": [inhibit.members() for inhibit in detail.inhibits],
    }


def _field(handle: IndustrialRobotStatusHandle, field: Field, now: float) -> JsonObject:
    evidence = handle.evidence.get(field.name)
    value = field.plain(getattr(handle.status, field.name))
    return {
        "value": value,
        "rule": evidence.rule if evidence else None,
        "source": evidence.source if evidence else None,
        "age": None if evidence is None or evidence.at is None else round(now - evidence.at, 3),
        "next": ((evidence and evidence.next) or NO_ADVICE) if value in (None, "UNKNOWN") else None,
    }
