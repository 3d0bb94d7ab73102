"""The output of `doctor`: text and JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping

from ...clock import rfc3339
from ...hardware.mavlink.identity import named
from ...json_object import JsonObject
from ...language import same_step
from ...mavlink import definitions as mav
from ...mavlink.counters import OTHER_IDS
from ...mavlink.enumerations import MAV_AUTOPILOT_PX4
from .advice import applet_heard, listed, named_all
from .diagnosis import Diagnosis
from .findings import GROUND_STATION, Findings, Speaker
from .heard import Heard, duration

FEW_SOURCES = 4
"""Limit of addresses in the text. The JSON has all."""


def as_text(f: Findings, diagnosis: Diagnosis) -> list[str]:
    """The diagnosis, the remarks and the next action, as lines."""
    return diagnosis.text(f.words, remarks(f))


def as_json(f: Findings, diagnosis: Diagnosis) -> str:
    """The same as a JSON object."""
    c = f.counters
    return json.dumps(
        {
            "connection": f.url.text,
            **diagnosis.members(remarks(f)),
            "seconds": f.seconds,
            "bytes": f.size,
            "frames": c.frames,
            "frames_v1": c.frames_v1,
            "signed": c.signed,
            "lost": c.lost,
            "loss_percent": round(f.loss, 1),
            "bad_crc": _by_id(c.bad_crc),
            "unknown": _by_id(c.unknown),
            "incompatible": c.incompatible,
            "garbage_bytes": c.garbage_bytes,
            "dropped": f.dropped,
            "sources": f.sources,
            "speakers": [_speaker(s) for s in f.speakers],
        }
    )


def remarks(f: Findings) -> Iterator[str]:
    """Further findings that may help."""
    if f.size:
        yield from _traffic(f)
    for vehicle in f.vehicles:
        yield from _vehicle(vehicle)
    others = tuple(s for s in f.speakers if s.status is None)
    if others:
        yield f"also heard: {named_all(others)}"
    if any(s.autopilot == MAV_AUTOPILOT_PX4 and not s.seldom for s in f.vehicles) and not any(
        s.type == GROUND_STATION for s in f.speakers
    ):
        yield "no ground station is heard here: PX4 sends texts only to one, so causes have no text"


def _traffic(f: Findings) -> Iterator[str]:
    """Bytes and frames, their sources, and the faults that occurred."""
    c = f.counters
    shown = [*f.sources[:FEW_SOURCES], *(["..."] if len(f.sources) > FEW_SOURCES else [])]
    sources = f" from {', '.join(shown)}" if shown else ""
    lost = f"{f.loss:.1f} % of the sequence numbers are missing"
    yield f"{f.size} bytes, {c.frames} MAVLink frames in {f.seconds:.1f} s{sources}; {lost}"
    if c.bad_crc:
        yield f"bad CRC: {listed(c.bad_crc)}"
    if c.unknown:
        yield f"unknown ids, not needed for a status: {listed(c.unknown)}"
    if c.frames and c.garbage_bytes:
        yield f"{c.garbage_bytes} bytes between the frames are not MAVLink"
    if c.incompatible:
        yield f"{c.incompatible} frames have unknown flags"


def _vehicle(s: Speaker) -> Iterator[str]:
    if s.status is None:
        return
    kind = named(mav.AUTOPILOT_NAMES, s.autopilot or 0), s.status.firmware, named(mav.TYPE_NAMES, s.type or 0)
    called = "" if s.status.name is None else f" '{s.status.name}'"
    shown = s.silent.last if s.silent else s.status
    yield f"vehicle {s.ids}{called}: {', '.join(filter(None, kind))}, flight mode {shown.flight_mode or 'unknown'}"
    yield "rates: " + ", ".join(
        f"{name} {'once' if hz is None else f'{hz:g} Hz'}" for name, hz in s.wanted.items() if hz != 0
    )
    if s.missing:
        yield f"missing: {', '.join(s.missing)}"
    if s.silent:
        until, silence = rfc3339(s.silent.until_us), duration(s.silent.silence)
        yield f"heard: for {s.silent.words}, until {until}; then silent for {silence}, so its status is unknown"
    yield from (f"sender {sender.words}" for sender in s.status.senders)
    when = "status when it was last heard: " if s.silent else "status: "
    yield when + ", ".join(f"{name} {_word(value)}" for name, value in shown.fields.items())
    if not s.silent:
        yield from (f"unknown {', '.join(names)}: {step}" for step, names in same_step(s.status.next).items())
    yield from applet_heard(s)
    for what, names in (("errors", shown.errors), ("inhibits", shown.inhibits)):
        if names:
            yield f"{what}: {', '.join(names)}"


def _word(value: str | bool | None) -> str:
    return "UNKNOWN" if value is None else str(value).upper()


def _by_id(counts: Mapping[int, int]) -> dict[str, int]:
    """Counts by message id; `other` for ids beyond the first 256."""
    return {"other" if i == OTHER_IDS else str(i): n for i, n in sorted(counts.items())}


def _speaker(s: Speaker) -> JsonObject:
    return {
        "system": s.system,
        "component": s.component,
        "autopilot": None if s.autopilot is None else named(mav.AUTOPILOT_NAMES, s.autopilot),
        "type": None if s.type is None else named(mav.TYPE_NAMES, s.type),
        "frames": s.frames,
        "status": s.status
        and {
            "flight_mode": s.status.flight_mode,
            **({} if s.status.firmware is None else {"firmware": s.status.firmware}),
            **({} if s.status.name is None else {"name": s.status.name}),
            **({"senders": [one._asdict() for one in s.status.senders]} if s.status.senders else {}),
            **s.status.fields,
            "errors": s.status.errors,
            "inhibits": s.status.inhibits,
            "next": dict(s.status.next),
        },
        "rates": s.wanted if s.status else {},
        "heard": s.heard and _heard(s.heard),
        "applet": s.applet and {"value": s.applet.value, "age": round(s.applet.age, 3)},
    }


def _heard(heard: Heard) -> JsonObject:
    last = heard.last
    return {
        "seconds": round(heard.seconds, 3),
        "times": heard.times,
        "until": rfc3339(heard.until_us),
        "silence": round(heard.silence, 3),
        "status": {
            "flight_mode": last.flight_mode,
            **last.fields,
            "errors": last.errors,
            "inhibits": last.inhibits,
        },
    }
