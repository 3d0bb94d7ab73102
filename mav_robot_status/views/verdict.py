"""The verdict on a vehicle of a log: the word of its worst state, and a sentence with when, what and how it ended."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

from ..clock import rfc3339
from ..language import State
from ..language.states import (
    ARMED,
    CANNOT_ARM,
    EMERGENCY_STOP,
    LOST,
    NOT_HEARD,
    PARKED,
    READY,
    SHOWN_BY,
    UNKNOWN,
    few_words,
    sentence,
    state_of_error,
)
from .totals import arm_cycles

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..json_object import JsonMapping, JsonObject
    from .timeline import Reason, Span, Timeline, VehicleTimeline

LONGEST: Final = 200
"""Characters of the sentence."""
SECOND: Final = 1_000_000


class Verdict(NamedTuple):
    """What a person reads first."""

    state: State
    """The worst of the whole log."""
    sentence: str
    """At most LONGEST characters; in it may be words of the autopilot, which are untrusted."""

    def members(self) -> JsonObject:
        """The members in JSON."""
        return {"state": self.state.word.replace(" ", "_"), "word": self.state.word, "sentence": self.sentence}


def verdict(timeline: Timeline, vehicle: VehicleTimeline) -> Verdict:
    """The worst that the timeline of a vehicle shows."""
    tracks = vehicle.tracks
    stops = [span for span in tracks["e_stopped"] if span.value == "TRUE"]
    wrong = sorted(vehicle.errors, key=lambda one: (state_of_error(_cause(one)).rank, one.start))
    cycles = arm_cycles(tracks["armed"])
    refused = [one for one in vehicle.inhibits if one.name == "PREARM_FAILING"]
    losses = [span for span in tracks["link"] if span.value == "LOST"]
    serious = [span for span in stops if span.end >= timeline.end or _was_armed(vehicle, span.start)]
    if serious or (stops and not wrong and not cycles):  # a parked robot may begin with a stop that is released later
        stops = serious or stops
        return _said(EMERGENCY_STOP, f" {_span(timeline, stops[0])}{_again(len(stops))}.")
    if wrong:
        return _said(state_of_error(_cause(wrong[0])), _of_error(timeline, vehicle, wrong[0]))
    if losses:
        return _said(LOST, f" {_span(timeline, losses[0])}{_again(len(losses))}.")
    if refused and not cycles:
        return _said(CANNOT_ARM, _never_armed(vehicle, refused))
    if cycles:
        drives = "one drive" if len(cycles) == 1 else f"{len(cycles)} drives"
        modes = _modes(tracks["mode"], cycles[0].start, cycles[-1].end)
        armed = sum(cycle.armed for cycle in cycles)
        ends = cycles[-1].end < timeline.end
        state = READY if ends else ARMED
        return _said(state, f": {drives} of {_lasted(armed)}{modes}, no fault{'' if ends else ', armed to the end'}.")
    if any(span.value == "FALSE" for span in tracks["armed"]):
        return _said(PARKED, f": it was never armed in {_lasted(_heard(vehicle))}, no fault.")
    if not tracks["link"] or all(span.value == "NEVER_SEEN" for span in tracks["link"]):
        return _said(NOT_HEARD, ": no heartbeat is in the log.")
    return _said(UNKNOWN, f": the log of {_lasted(timeline.end)} does not tell whether it was armed.")


def _said(state: State, rest: str) -> Verdict:
    text = f"{state.word}{rest}"
    return Verdict(state, text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…")


def _cause(one: Reason) -> JsonMapping:
    return {"name": one.name, "text": one.text, "handle": one.handle}


def _of_error(timeline: Timeline, vehicle: VehicleTimeline, one: Reason) -> str:
    """` at 11:07:10, 15 s into AUTO: “Crash: Going to HOLD”; disarmed 2 s later.`"""
    what = f"“{one.text}”" if one.text else sentence(_cause(one), {"system": vehicle.system})
    names = {other.name for other in vehicle.errors}
    others = {other.title for other in vehicle.errors if not names & SHOWN_BY.get(other.name, frozenset())} - {
        one.title
    }
    also = f"; {len(others)} other {'error' if len(others) == 1 else 'errors'}" if others else ""
    ended = _disarmed_after(vehicle, one.start) or _ended(timeline, one.end)
    return f" at {_clock(timeline, one.start)}{_into(vehicle, one.start)}: {what[:120]}{ended}{also}."


def _into(vehicle: VehicleTimeline, at: int) -> str:
    """How long it had been in its mode: `, 15 s into AUTO`. Disarmed it says nothing."""
    armed = _value_at(vehicle.tracks["armed"], at - 1)
    before = _value_at(vehicle.tracks["mode"], at - 1)
    if armed is None or armed.value != "TRUE" or before is None or before.value == "UNKNOWN":
        return ""
    since = max(before.start, armed.start)
    return f", {_lasted(at - since)} into {before.value}"


def _was_armed(vehicle: VehicleTimeline, at: int) -> bool:
    armed = _value_at(vehicle.tracks["armed"], at - 1)
    return armed is not None and armed.value == "TRUE"


def _value_at(spans: Sequence[Span], at: int) -> Span | None:
    return next((span for span in spans if span.start <= at < span.end), None)


def _disarmed_after(vehicle: VehicleTimeline, at: int) -> str:
    for before, after in pairwise(vehicle.tracks["armed"]):
        if before.value == "TRUE" and after.value == "FALSE" and after.start >= at:
            return f"; disarmed {_lasted(after.start - at)} later"
    return ""


def _ended(timeline: Timeline, end: int) -> str:
    return "; it lasts to the end of the log" if end >= timeline.end else f"; ended at {_clock(timeline, end)}"


def _span(timeline: Timeline, span: Span) -> str:
    end = "the end of the log" if span.end >= timeline.end else _clock(timeline, span.end)
    return f"from {_clock(timeline, span.start)} to {end}"


def _again(times: int) -> str:
    return f", {times} times in all" if times > 1 else ""


def _never_armed(vehicle: VehicleTimeline, refused: Sequence[Reason]) -> str:
    """`: it was never armed in 60 s; “PreArm: GPS 1: Bad fix” 4 times.`"""
    counts: dict[str, int] = {}
    for one in refused:
        text = f"“{one.text}”" if one.text else few_words(_cause(one), {})
        counts[text] = counts.get(text, 0) + 1
    text, times = max(counts.items(), key=lambda item: item[1])
    often = f" {times} times" if times > 1 else ""
    return f": it was never armed in {_lasted(_heard(vehicle))}; {text[:120]}{often}."


def _heard(vehicle: VehicleTimeline) -> int:
    return sum(span.end - span.start for span in vehicle.tracks["link"] if span.value == "CONNECTED")


def _modes(spans: Sequence[Span], start: int, end: int) -> str:
    found = dict.fromkeys(s.value for s in spans if s.start < end and s.end > start and s.value != "UNKNOWN")
    return f" in {' and '.join(found)}" if found else ""


def _clock(timeline: Timeline, at: int) -> str:
    """The time of day, UTC."""
    return rfc3339(timeline.unix_us(at, at))[11:19]


def _lasted(us: int) -> str:
    seconds = round(us / SECOND)
    if seconds < 100:
        return f"{seconds} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
