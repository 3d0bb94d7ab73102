"""Timelines as one self-contained HTML file, or as JSON.

Texts from the wire and file names are hostile. They enter the page as JSON that cannot close its element, and become
text nodes only. The page's policy allows its own script and style by their hashes, and no network.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import os
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from importlib.resources import files
from itertools import pairwise
from typing import Final

from ..clock import rfc3339
from ..errors import LinkError, UsageError
from ..interface import STATES, Kind, LinkState, RobotMode
from ..json_object import JsonObject
from ..language import LOOKS, remedy, style_sheet
from ..language.shapes import drawing
from ..language.states import UNSURE
from ..language.values import NO, UNKNOWN, YES
from ..streams import visible
from .timeline import TRACKS, Reason, Span, Timeline, VehicleTimeline
from .totals import ReasonTotal, Totals, totals
from .verdict import verdict

WORDS: Final = {"TRUE": True, "FALSE": False, "UNKNOWN": None}
"""The JSON of a TriState."""
VALUES: Final[dict[str, tuple[str, ...]]] = {
    **dict.fromkeys(TRACKS, tuple(WORDS)),
    "link": tuple(state.value for state in LinkState),
    "flight_mode": (),
    **{field.name: tuple(mode.name for mode in RobotMode) for field in STATES if field.kind is Kind.MODE},
}
"""The values of each track. The totals list all of them, even those that never occurred."""
LOOKS_OF: Final = {**LOOKS, "armed": {True: YES, False: NO, None: UNKNOWN}}
"""The looks of each track. A flight mode has its own name."""
NOT_READY: Final = "not ready: "
"""Before the member and its reason, on the page."""
ESCAPES: Final = str.maketrans({character: f"\\u{ord(character):04x}" for character in "<>&"})
"""Characters that could open or close an element; in JSON they occur in strings only."""


# -- JSON --------------------------------------------------------------------------------------------------------------


def as_json(timelines: Iterable[Timeline]) -> str:
    """One JSON object in a line for each vehicle of each log. The form is documented and stable."""
    return "\n".join(json.dumps(_vehicle(timeline, v)) for timeline in timelines for v in timeline.vehicles)


def _vehicle(timeline: Timeline, vehicle: VehicleTimeline) -> JsonObject:
    whole = totals(vehicle)
    return {
        "log": timeline.name,
        "segments": [_interval(timeline, s.start, s.end) for s in timeline.segments],
        "handle": vehicle.handle,
        "system": vehicle.system,
        "component": vehicle.component,
        "vehicle": {
            "autopilot": vehicle.autopilot,
            "type": vehicle.type,
            **({} if vehicle.name is None else {"name": vehicle.name}),
        },
        **({"members": list(vehicle.members)} if vehicle.members else {}),
        "verdict": verdict(timeline, vehicle).members(),
        "totals": {
            "seconds": _seconds(whole.watched),
            "arm_cycles": len(whole.arm_cycles),
            **{name: _lasted(name, whole.values[name]) for name in TRACKS},
            "errors": [_reason_total(total) for total in whole.errors],
            "inhibits": [_reason_total(total, code=False) for total in whole.inhibits],
            **_of_a_group(vehicle, [_reason_total(total, code=False) for total in whole.not_ready]),
        },
        "arm_cycles": [
            {**_interval(timeline, c.start, c.end), "armed_seconds": _seconds(c.armed)} for c in whole.arm_cycles
        ],
        "intervals": {
            **{name: [_span(timeline, name, span) for span in vehicle.tracks[name]] for name in TRACKS},
            "errors": [{"code": r.code, **_reason(timeline, r)} for r in vehicle.errors],
            "inhibits": [_reason(timeline, r) for r in vehicle.inhibits],
            **_of_a_group(vehicle, [_reason(timeline, r) for r in vehicle.not_ready]),
        },
    }


def _of_a_group(vehicle: VehicleTimeline, not_ready: list[JsonObject]) -> JsonObject:
    """What only a group has."""
    return {"not_ready": not_ready} if vehicle.members else {}


def _lasted(track: str, values: dict[str, int]) -> dict[str, float]:
    every = dict.fromkeys(VALUES[track], 0) | values
    return {value: _seconds(lasted) for value, lasted in every.items() if value}


def _interval(timeline: Timeline, start: int, end: int) -> JsonObject:
    return {
        "start": rfc3339(timeline.unix_us(start, start)),
        "end": rfc3339(timeline.unix_us(start, end)),
        "seconds": _seconds(end - start),
    }


def _span(timeline: Timeline, track: str, span: Span) -> JsonObject:
    value: str | bool | None = WORDS[span.value] if VALUES[track] == tuple(WORDS) else span.value or None
    return {"value": value, **_interval(timeline, span.start, span.end), "rule": span.rule, "source": span.source}


def _reason(timeline: Timeline, reason: Reason) -> JsonObject:
    interval = _interval(timeline, reason.start, reason.end)
    return {"name": reason.name, "text": reason.text, **_member(reason), **interval}


def _member(reason: Reason | ReasonTotal) -> dict[str, str]:
    """The member of a group that reports it; a single robot has none."""
    return {} if reason.handle is None else {"handle": reason.handle}


def _reason_total(total: ReasonTotal, code: bool = True) -> JsonObject:
    named = {"code": total.code} if code else {}
    return {
        **named,
        "name": total.name,
        **_member(total),
        "count": total.occurrences,
        "seconds": _seconds(total.active),
        "texts": list(total.texts),
    }


def _seconds(us: int) -> float:
    return round(us / 1e6, 6)


# -- the page ----------------------------------------------------------------------------------------------------------


def as_html(timelines: Sequence[Timeline], made_by: str) -> str:
    """The page."""
    script, style = _asset("report.js"), style_sheet() + _asset("report.css")
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    parts = {
        "policy": policy,
        "verdicts": "\n".join(_verdicts(timelines)),
        "title": html.escape(", ".join(timeline.name for timeline in timelines)),
        "style": style,
        "script": script,
        "data": embedded(
            {"by": made_by, "looks": _looks(), "logs": [_page_log(timeline) for timeline in timelines]},
        ),
    }
    page, *rest = _asset("report.html").split("{{")  # each part is inserted once and not scanned again
    for piece in rest:
        name, _, following = piece.partition("}}")
        page += parts[name] + following
    return page


def _verdicts(timelines: Sequence[Timeline]) -> Iterator[str]:
    """The verdict on each vehicle. With several, each begins with its name."""
    found = [(timeline, vehicle) for timeline in timelines for vehicle in timeline.vehicles]
    for timeline, vehicle in found:
        said = verdict(timeline, vehicle)
        names = [timeline.name] * (len(timelines) > 1) + [_title(vehicle)] * (len(found) > 1)
        name = f"<b>{html.escape(visible(' '.join(names)))}</b> " if names else ""
        yield (
            f'<div class="{said.state.tone}">{drawing(said.state.shape)}'
            f"<p>{name}<strong>{html.escape(said.state.word)}</strong></p>"
            f"<p>{html.escape(visible(said.sentence))}</p></div>"
        )


def _looks() -> dict[str, dict[str, dict[str, str]]]:
    """How each value of each track looks, by the word of the timeline for it."""
    names = {value: name for name, value in WORDS.items()}
    return {
        track: {
            names.get(value, value): {"word": one.word, "glyph": one.glyph, "tone": one.tone, "bar": one.bar}
            for value, one in looks.items()
        }
        for track, looks in LOOKS_OF.items()
    }


def save(page: str, path: str) -> None:
    """Write the page. Raises UsageError if the path exists and is not an HTML file, LinkError if the write fails."""
    if os.path.exists(path) and not path.lower().endswith((".html", ".htm")):
        raise UsageError(f"{path} exists and is not an .html file, so it is not overwritten; write -o FILE.html")
    try:
        with open(path, "w", encoding="utf-8", errors="replace", newline="") as file:
            file.write(page)
    except (OSError, ValueError) as problem:
        reason = (problem.strerror if isinstance(problem, OSError) else None) or "not a file name"
        raise LinkError(f"cannot write the report {path!r}: {reason}") from None


def embedded(data: object) -> str:
    """JSON for a script element."""
    return json.dumps(data, separators=(",", ":")).translate(ESCAPES)


def _page_log(timeline: Timeline) -> JsonObject:
    strings = _Numbered()
    vehicles = [_page_vehicle(vehicle, strings) for vehicle in timeline.vehicles]
    return {"name": timeline.name, "segments": timeline.segments, "vehicles": vehicles, "strings": list(strings)}


def _page_vehicle(vehicle: VehicleTimeline, strings: _Numbered) -> JsonObject:
    by_name: dict[str, dict[str, Sequence[Reason]]] = {"errors": {}, "inhibits": {}}
    for kind, found in by_name.items():
        for title, reasons in _by_title(getattr(vehicle, kind)).items():
            found[title] = _in_a_row(reasons)
    for title, reasons in _by_title(vehicle.not_ready).items():
        by_name["inhibits"][NOT_READY + title] = _in_a_row(reasons)
    whole = totals(vehicle)
    return {
        "name": _title(vehicle),
        "handle": ", ".join(vehicle.members) or vehicle.handle,
        "autopilot": vehicle.autopilot,
        "type": vehicle.type,
        "tracks": {name: _packed(spans, strings) for name, spans in vehicle.tracks.items()},
        **{kind: {name: _packed(r, strings) for name, r in found.items()} for kind, found in by_name.items()},
        "totals": whole._asdict() | _lists(whole),
    }


def _title(vehicle: VehicleTimeline) -> str:
    """`1.1`, or `1.1 Rover-A` if it has a name; the handle of a group."""
    if vehicle.members:
        return vehicle.handle
    ids = f"{vehicle.system}.{vehicle.component}"
    return ids if vehicle.name is None else f"{ids} {vehicle.name}"


def _by_title(reasons: Iterable[Reason]) -> dict[str, list[Reason]]:
    found: dict[str, list[Reason]] = {}
    for reason in reasons:
        found.setdefault(reason.title, []).append(reason)
    return found


def _in_a_row(reasons: list[Reason]) -> list[Reason]:
    """Reasons of one title without overlaps, for one row of the page: texts at the same time are joined."""
    begin: dict[int, list[Reason]] = defaultdict(list)
    for reason in reasons:
        begin[reason.start].append(reason)
    row: list[Reason] = []
    active: list[Reason] = []
    for start, end in pairwise(sorted({edge for reason in reasons for edge in (reason.start, reason.end)})):
        active = [reason for reason in active if reason.end > start] + begin.get(start, [])
        if active:
            text = "; ".join(reason.text for reason in active if reason.text is not None) or None
            row.append(active[0]._replace(start=start, end=end, text=text))
    return row


def _packed(spans: Sequence[Span | Reason], strings: _Numbered) -> list[int]:
    """Four numbers for each span: the gap before it, its length, its value or text, and its evidence."""
    packed: list[int] = []
    before = 0
    for span in spans:
        value, why = (span.value, (span.rule, span.source)) if isinstance(span, Span) else (span.text, None)
        packed += span.start - before, span.end - span.start, strings[value], strings[why]
        before = span.end
    return packed


class _Numbered(dict[object, int]):
    """Numbers texts, so that a repeated text is stored once."""

    def __missing__(self, text: object) -> int:
        self[text] = len(self)
        return self[text]


def _lists(whole: Totals) -> dict[str, list[JsonObject]]:
    """The lists among the totals."""
    return {
        "arm_cycles": [cycle._asdict() for cycle in whole.arm_cycles],
        "errors": [{**_total(t), "kind": "error", "tone": "alarm"} for t in whole.errors],
        "inhibits": [*(_inhibit(t) for t in whole.inhibits), *(_not_ready(t) for t in whole.not_ready)],
        "not_ready": [],
    }


def _total(total: ReasonTotal) -> JsonObject:
    """A reason with its words, and the steps for its texts."""
    rows = [remedy({"name": total.name, "text": text}) for text in total.texts or (None,)]
    steps = list(dict.fromkeys(row.step for row in rows if row.step))
    return {**total._asdict(), "name": total.title, "sentence": rows[0].sentence, "steps": steps}


def _inhibit(total: ReasonTotal) -> JsonObject:
    if total.name in UNSURE:
        return {**_total(total), "kind": "unknown", "tone": "unknown"}
    tone = "warning" if remedy({"name": total.name}).person else "calm"
    return {**_total(total), "kind": "inhibit", "tone": tone}


def _not_ready(total: ReasonTotal) -> JsonObject:
    """A member of a group that could not work, whether or not another one could move."""
    return {**_total(total), "name": NOT_READY + total.title, "kind": "not_ready", "tone": "warning"}


def _asset(name: str) -> str:
    return (files(__package__) / "assets" / name).read_text("utf-8")


def _hash(code: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(code.encode()).digest()).decode()}"
