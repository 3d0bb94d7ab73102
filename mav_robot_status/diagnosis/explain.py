"""`explain`: each field with its value, the rule that applied, the source message and its age."""

from __future__ import annotations

import dataclasses
import json
import logging
import re
from collections.abc import Callable, Iterable, Iterator
from datetime import datetime, timezone
from typing import Final, TextIO

from ..clock import Instant, later, rfc3339
from ..clock import now as present
from ..config import Config
from ..errors import UsageError
from ..gateway.controller_config import DEFAULT_CONTROLLER
from ..gateway.event_loop import EventLoop
from ..gateway.logs.onboard_recording import OnboardRecording
from ..gateway.logs.recorded_log import Recording
from ..gateway.replay import ReplayPipeline, open_recording, run_through
from ..hardware.mavlink.interface import MavlinkRobotHW
from ..hardware.mavlink.senders import Sender, senders
from ..interface import HardwareInterface, IndustrialRobotStatusHandle, LinkState
from ..interface.explanation import explanation
from ..json_object import JsonObject
from ..language import remedy, same_step
from ..links.log import Stamped
from ..streams import NO_OUTPUT
from .vehicle_reports import PAGE, WORDS, applet_reports, arming_checks

log = logging.getLogger(__name__)

LISTEN: Final = 5.0
"""Seconds from the first heartbeat to the explanation of a live link. Slow streams arrive twice in this time."""
ANSWERS: Final = 25.0
"""Seconds from the first heartbeat to the explanation while answers of the autopilot are outstanding. Its parameters
take 17 s."""
SINCE_BOOT: Final = "boot:"
PATIENCE: Final = 30.0  # s to wait for the first heartbeat


def explain_log(config: Config, path: str, at: str | None) -> list[JsonObject]:
    """The explanations at a time in a log, by default at its end.

    `at` is an RFC 3339 time, `+44` for seconds after the first record, or, of an autopilot's own log, `boot:93` for
    seconds after its start. Raises UsageError if the log lacks it.
    """
    recording = open_recording(path)
    pipeline = ReplayPipeline(silent(config), NO_OUTPUT, recording=recording)
    if at is not None and at.startswith(SINCE_BOOT):
        at = _since_boot(recording, at)
    end = run_through(pipeline, _up_to(recording, at))
    return explanations(pipeline.hw, pipeline.vehicles, end)


def _since_boot(recording: Recording | OnboardRecording, at: str) -> str:
    """`boot:93` as RFC 3339. Raises UsageError."""
    if not isinstance(recording, OnboardRecording):
        raise UsageError(f"--at {at}: only an autopilot's own log (.bin, .ulg) tells when it has started; write +44")
    try:
        seconds = float(at.removeprefix(SINCE_BOOT))
        return rfc3339(recording.preview.boot_unix_us + round(seconds * 1e6))
    except (ValueError, OverflowError):
        raise UsageError(f"--at {at}: write boot:93 for 93 seconds after the start of the autopilot") from None


def _up_to(recording: Iterable[Stamped], at: str | None) -> Iterator[Stamped]:
    """The recording up to a time, which becomes its last instant."""
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


def explain_live(config: Config, stdout: TextIO, clock: Callable[[], Instant] = present) -> list[JsonObject]:
    """The explanations of the vehicles on live links, LISTEN seconds after the first heartbeat."""
    gateway = EventLoop(silent(config), stdout)
    gateway.stop_on_signals()
    start = clock().mono
    heard: list[float] = []
    waits_for = gateway.hardware.mavlink.waits_for

    def enough() -> bool:
        now = clock().mono
        if not heard and any(map(_is_heard, gateway.pipeline.hw.handles)):
            heard.append(now)
        if not heard:
            return now - start >= PATIENCE
        since = now - heard[0]
        if since < LISTEN:
            return False
        waiting = waits_for()
        if waiting and len(heard) == 1:
            heard.append(now)
            log.info("waiting up to %g s for the answers of %s", ANSWERS - LISTEN, "; ".join(waiting))
        return since >= ANSWERS or not waiting

    gateway.run(until=enough)
    for missing in waits_for():
        log.warning("no answer yet from %s: a running gateway may know more", missing)
    return explanations(gateway.pipeline.hw, gateway.hardware.mavlink.vehicles, clock())


def silent(config: Config) -> Config:
    """The configuration without publishers: the explanation is the only output."""
    return dataclasses.replace(config, controllers=(dataclasses.replace(DEFAULT_CONTROLLER, publishers=()),))


def moment(at: str, start_us: int) -> int:
    """A time in a log, in Unix microseconds. Raises UsageError if it is not a time or `+seconds`."""
    try:
        if at.startswith("+"):
            return start_us + round(float(at) * 1e6)
        # Python 3.10 accepts only three or six decimals
        six = re.sub(r"\.(\d{1,6})\d*", lambda match: f".{match[1]:0<6}", at)
        time = datetime.fromisoformat(six.replace("Z", "+00:00"))
    except (ValueError, OverflowError):
        raise UsageError(
            f"--at {at}: write a time like {rfc3339(start_us)}, or +44 for seconds from the start"
        ) from None
    if time.tzinfo is None:
        time = time.replace(tzinfo=timezone.utc)
    return round(time.timestamp() * 1e6)


def explanations(hw: HardwareInterface, vehicles: MavlinkRobotHW, now: Instant) -> list[JsonObject]:
    """One explanation for each robot heard. An ArduPilot's has a member `applet`, a PX4's `arming_checks`.

    `senders` are those that speak as the vehicle, if there are several or if it is late.
    """
    heard = list(filter(_is_heard, hw.handles))
    for handle in heard:
        hw.explain(handle.name, now)
    reports = applet_reports(vehicles, now)
    more: dict[str, JsonObject] = {name: {"applet": report} for name, report in reports.items()}
    more |= {name: {"arming_checks": checks} for name, checks in arming_checks(vehicles).items()}
    speak = {tracked.handle.name: senders(tracked.belief, now.mono) for tracked in vehicles.vehicles}
    return [
        explanation(handle, now)
        | ({"senders": [one._asdict() for one in found]} if (found := speak.get(handle.name)) else {})
        | more.get(handle.name, {})
        for handle in heard
    ]


def _is_heard(handle: IndustrialRobotStatusHandle) -> bool:
    return handle.detail.link is not LinkState.NEVER_SEEN


def as_json(found: Iterable[JsonObject]) -> list[str]:
    """The explanations as lines of JSON, one object each."""
    return [json.dumps(one) for one in found]


def as_table(found: Iterable[JsonObject]) -> list[str]:
    """The explanations as tables for a person: their lines, with an empty one between two tables."""
    return [line for one in found for line in ("", *_table(one))][1:]


def _table(one: JsonObject) -> Iterator[str]:
    yield f"{_name(one)}, {one['link']['state']}, at {one['stamp']}"
    rows = [("field", "value", "age", "why")]
    for name, field in one["fields"].items():
        value = {True: "TRUE", False: "FALSE", None: "UNKNOWN"}.get(field["value"], field["value"])
        age = "" if field["age"] is None else f"{field['age']:.1f} s"
        why = field["rule"] or ""
        rows.append((name, str(value), age, f"{why}  [{field['source']}]" if field["source"] else why))
    widths = [max(len(row[i]) for row in rows) for i in range(3)]
    for row in rows:
        yield "  ".join((row[0].ljust(widths[0]), row[1].ljust(widths[1]), row[2].rjust(widths[2]), row[3]))
    yield from _unknown(one)
    for sender in one.get("senders", ()):
        yield f"sender   {Sender(**sender).words}"
    if "applet" in one:
        yield f"applet   {_report(one['applet'])}"
    yield from _causes(one)
    for check in one.get("arming_checks", ()):
        yield f"check    {_checked(check)}"


def _unknown(one: JsonObject) -> Iterator[str]:
    """What would make the UNKNOWN fields known. Fields that need the same share a line."""
    steps = {name: field["next"] for name, field in one["fields"].items() if field["next"] is not None}
    for step, names in same_step(steps).items():
        yield f"{'unknown':<9}{', '.join(names)}: {step}"


def _causes(one: JsonObject) -> Iterator[str]:
    """The errors and inhibits, each with its next step. A step is named once."""
    named: set[str] = set()
    for kind, cause in (*(("error", e) for e in one["errors"]), *(("inhibit", i) for i in one["inhibits"])):
        code = f"{cause['code']} " if kind == "error" else ""
        yield f"{kind:<9}{_member(cause)}{code}{cause['name']} since {cause['since']}{_said(cause['text'])}"
        step = remedy(cause).step
        if step and step not in named:
            yield f"{'step':<9}{step}"
        named.add(step)


def _checked(check: JsonObject) -> str:
    """A failing arming check: its text, its component, its modes, and what can be done about it."""
    modes = "" if check["modes"] is None else f", modes: {', '.join(check['modes'])}"
    more = "" if check["description"] is None else f". {check['description']}"
    return f"{check['text']} since {check['since']}, component: {check['component']}{modes}{more}"


def _name(one: JsonObject) -> str:
    """`vehicle 1.1 (ARDUPILOTMEGA, GROUND_ROVER, AUTO)`; a robot without MAVLink and a group have their handle."""
    if "members" in one:
        return f"group {one['handle']} ({', '.join(one['members'])})"
    vehicle = one["vehicle"]
    names = (vehicle["autopilot"], vehicle.get("firmware"), vehicle["type"], vehicle["flight_mode"])
    kind = ", ".join(str(name) for name in names if name is not None)
    who = f"robot {one['handle']}" if one["system"] is None else f"vehicle {one['system']}.{one['component']}"
    who += f" '{vehicle['name']}'" if "name" in vehicle else ""
    return f"{who} ({kind})"


def _member(cause: JsonObject) -> str:
    """The member of a group that reports it."""
    return f"{cause['handle']}: " if "handle" in cause else ""


def _report(report: JsonObject | None) -> str:
    if report is None:
        return f"not heard: {PAGE}"
    return f"RS_STOP {report['value']}, {WORDS[report['value']]}, {report['age']:.1f} s ago"


def _said(text: str | None) -> str:
    return f': "{text}"' if text else ""
