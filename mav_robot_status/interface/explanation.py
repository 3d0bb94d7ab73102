"""A handle with the evidence for each field, as plain values, for `explain --as-json` and the web page."""

from __future__ import annotations

from ..clock import Instant, rfc3339
from ..json_object import JsonObject
from .fields import STATES, Field
from .handle import IndustrialRobotStatusHandle


def explanation(handle: IndustrialRobotStatusHandle, now: Instant) -> JsonObject:
    """The status in a handle with its evidence. Ages are in seconds at `now`; UNKNOWN is None.

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
    return {
        "value": field.plain(getattr(handle.status, field.name)),
        "rule": evidence.rule if evidence else None,
        "source": evidence.source if evidence else None,
        "age": None if evidence is None or evidence.at is None else round(now - evidence.at, 3),
    }
