"""`explain`: every field of a status with its value, the rule that decided, what it read, and how old that is."""

from __future__ import annotations

import dataclasses
import io
import json
import re
from datetime import datetime, timezone
from typing import TYPE_CHECKING, Any, Final

from ..clock import Instant, later, rfc3339
from ..clock import now as present
from ..errors import UsageError
from ..interface import RobotMode, TriState
from .live import Live
from .plant import DEFAULT_CONTROLLER, Plant
from .recorded import Recording
from .replay import Nobody, run_through

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from typing import TextIO

    from ..config import Config
    from ..hardware.robot_hw import MavlinkRobotHW
    from ..hardware.tracked import Tracked
    from ..interface import RobotStatus
    from ..link.log import Stamped

LISTEN: Final = 5.0
"""Seconds after the first heartbeat until a live link is explained: by then slow streams were heard twice."""
PATIENCE: Final = 30.0  # s to wait for the first heartbeat
NO_OUTPUT: Final = io.StringIO()
FIELDS: Final = ("mode", "e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")


def explain_log(config: Config, path: str, at: str | None) -> list[dict[str, Any]]:
    """The explanations at a moment of a log, by default its end.

    `at` is an RFC 3339 time, or `+44` for seconds after the first record. Raises UsageError if the log lacks it.
    """
    plant = Plant(silent(config), Nobody(), NO_OUTPUT, patient=True)
    end = run_through(plant, _up_to(Recording(path), at))
    return explanations(plant.hw, end)


def _up_to(recording: Iterable[Stamped], at: str | None) -> Iterator[Stamped]:
    """The recording up to a moment, which is its last instant."""
    until: int | None = None
    last: Instant | None = None
    for stamped in recording:
        now = stamped[0]
        if last is None and at is not None:
            until = moment(at, now.unix_us)
            if until < now.unix_us:
                raise UsageError(f"--at {at}: the log begins at {rfc3339(now.unix_us)}")
        if last is not None and until is not None and now.unix_us > until:
            yield later(last, (until - last.unix_us) / 1e6), None, False
            return
        yield stamped
        last = now
    if last is not None and until is not None and until > last.unix_us:
        raise UsageError(f"--at {at}: the log ends at {rfc3339(last.unix_us)}")


def explain_live(config: Config, stdout: TextIO, clock: Callable[[], Instant] = present) -> list[dict[str, Any]]:
    """The explanations of what is heard on live links, LISTEN seconds after the first heartbeat."""
    gateway = Live(silent(config), stdout)
    gateway.stop_on_signals()
    start = clock().mono
    heard: list[float] = []

    def enough() -> bool:
        now = clock().mono
        if not heard and any(gateway.plant.hw.vehicles):
            heard.append(now)
        return now - heard[0] >= LISTEN if heard else now - start >= PATIENCE

    gateway.run(until=enough)
    return explanations(gateway.plant.hw, clock())


def silent(config: Config) -> Config:
    """The configuration without any publisher: an explanation is all that is said."""
    return dataclasses.replace(config, controllers=(dataclasses.replace(DEFAULT_CONTROLLER, publishers=()),))


def moment(at: str, start_us: int) -> int:
    """A moment of a log in Unix microseconds. Raises UsageError for anything but a time or `+seconds`."""
    try:
        if at.startswith("+"):
            return start_us + round(float(at) * 1e6)
        # Python 3.10 takes three or six decimals only
        six = re.sub(r"\.(\d{1,6})\d*", lambda match: f".{match[1]:0<6}", at)
        time = datetime.fromisoformat(six.replace("Z", "+00:00"))
    except (ValueError, OverflowError):
        raise UsageError(
            f"--at {at}: write a time like {rfc3339(start_us)}, or +44 for seconds from the start"
        ) from None
    if time.tzinfo is None:
        time = time.replace(tzinfo=timezone.utc)
    return round(time.timestamp() * 1e6)


def explanations(hw: MavlinkRobotHW, now: Instant) -> list[dict[str, Any]]:
    """One explanation for each vehicle heard."""
    hw.explain(now)
    return [explanation(tracked, now) for tracked in hw.vehicles]


def explanation(tracked: Tracked, now: Instant) -> dict[str, Any]:
    """A status with its evidence, as plain values (the JSON form)."""
    handle = tracked.handle
    detail = handle.detail
    fields = {}
    for name in FIELDS:
        evidence = handle.evidence.get(name)
        age = None if evidence is None or evidence.at is None else round(now.mono - evidence.at, 3)
        fields[name] = {
            "value": _value(handle.status, name),
            "rule": evidence.rule if evidence else None,
            "source": evidence.source if evidence else None,
            "age": age,
        }
    return {
        "stamp": rfc3339(now.unix_us),
        "handle": handle.name,
        "system": detail.system,
        "component": detail.component,
        "vehicle": detail.vehicle._asdict(),
        "link": {
            "state": detail.link.value,
            "heartbeat_age": None if handle.heard_at is None else round(now.mono - handle.heard_at, 3),
        },
        "fields": fields,
        "error_code": handle.status.error_code,
        "errors": [
            {"code": e.code, "name": e.name, "text": e.text, "since": rfc3339(e.since_us)} for e in detail.errors
        ],
        "inhibits": [{"name": i.name, "text": i.text, "since": rfc3339(i.since_us)} for i in detail.inhibits],
    }


def _value(status: RobotStatus, name: str) -> str | bool | None:
    value = getattr(status, name)
    if isinstance(value, TriState):
        return None if value is TriState.UNKNOWN else bool(value)
    return RobotMode(value).name


def as_json(found: Iterable[dict[str, Any]]) -> str:
    """The explanations as JSON, one object a line."""
    return "\n".join(json.dumps(one) for one in found)


def as_table(found: Iterable[dict[str, Any]]) -> str:
    """The explanations as tables for a person."""
    return "\n\n".join("\n".join(_table(one)) for one in found)


def _table(one: dict[str, Any]) -> Iterator[str]:
    vehicle, link = one["vehicle"], one["link"]
    kind = ", ".join(str(v) for v in (vehicle["autopilot"], vehicle["type"], vehicle["flight_mode"]) if v is not None)
    yield f"vehicle {one['system']}.{one['component']} ({kind}), {link['state']}, at {one['stamp']}"
    rows = [("field", "value", "age", "why")]
    for name, field in one["fields"].items():
        value = {True: "TRUE", False: "FALSE", None: "UNKNOWN"}.get(field["value"], field["value"])
        age = "" if field["age"] is None else f"{field['age']:.1f} s"
        why = field["rule"] or ""
        rows.append((name, str(value), age, f"{why}  [{field['source']}]" if field["source"] else why))
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    for row in rows:
        yield "  ".join((row[0].ljust(widths[0]), row[1].ljust(widths[1]), row[2].rjust(widths[2]), row[3]))
    for error in one["errors"]:
        yield f"error    {error['code']} {error['name']} since {error['since']}{_said(error['text'])}"
    for inhibit in one["inhibits"]:
        yield f"inhibit  {inhibit['name']} since {inhibit['since']}{_said(inhibit['text'])}"


def _said(text: str | None) -> str:
    return f': "{text}"' if text else ""
