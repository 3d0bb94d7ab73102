"""The verdict on one vehicle of a log: the word of its worst state, and one sentence: what, when, why, how it ended.

A pure function of the timeline. The log of an autopilot names who and why in its evidence; a log of the wire has what
the wire tells. Times count from the first record of the log; the time of day in UTC stands behind them.
"""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING, Final, NamedTuple

from ..clock import rfc3339
from ..language import State
from ..language.states import ROBOT_STATES
from .totals import arm_cycles

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from ..json_object import JsonObject
    from .timeline import Reason, Span, Timeline, VehicleTimeline

LONGEST: Final = 200
"""Characters of the sentence."""
LONGEST_TEXT: Final = 70
"""Characters of a text of the autopilot in it."""
SECOND: Final = 1_000_000
TOGETHER: Final = 3 * SECOND
"""A disarm that follows an error within this time belongs to it."""
STATES: Final = {state.word: state for state in ROBOT_STATES}
"""By their words, the worst first."""
CRASHES: Final = ("CRASH", "FLIGHT_TERMINATION", "TERMINATION_ANNOUNCED")
CONFLICTS: Final = ("SYSTEM_ID_CONFLICT",)
BY_ITSELF: Final = re.compile(r"(crash check|failsafe|fence|termination|parachute|traffic|error of its software)")
"""Who disarms a robot because something is wrong."""
LANDED: Final = re.compile(r"the (automatic )?landing|the disarm delay|landing$")
_BY: Final = re.compile(r" by (?:the )?(.+?)(?=,? forced$|$)")
_MOVING: Final = re.compile(r" (?:while it moved|in the air).*$")


class Verdict(NamedTuple):
    """What a person reads first."""

    state: State
    """The worst of the whole log."""
    sentence: str
    """At most LONGEST characters; in it may be words of the autopilot, which are untrusted."""

    def members(self) -> JsonObject:
        """The members in JSON."""
        return {"state": self.state.word.replace(" ", "_"), "word": self.state.word, "sentence": self.sentence}


class _Log(NamedTuple):
    """A vehicle with its log."""

    timeline: Timeline
    vehicle: VehicleTimeline

    @property
    def end(self) -> int:
        """The end of the log."""
        return self.timeline.end

    def at(self, moment: int) -> str:
        """`+93.4 s (11:07:10)`."""
        return f"+{moment / SECOND:.1f} s ({rfc3339(self.timeline.unix_us(moment, moment))[11:19]})"

    def span(self, track: str, moment: int) -> Span | None:
        """The value of a track at a moment."""
        return next((span for span in self.vehicle.tracks[track] if span.start <= moment < span.end), None)

    def has(self, track: str, value: str, moment: int) -> bool:
        """Whether a track has a value just before a moment."""
        found = self.span(track, moment - 1)
        return found is not None and found.value == value

    def disarm_after(self, moment: int) -> Span | None:
        """The next disarm."""
        spans = self.vehicle.tracks["armed"]
        after = (b for a, b in pairwise(spans) if a.value == "TRUE" and b.value == "FALSE")
        return next((span for span in after if span.start >= moment), None)


def verdict(timeline: Timeline, vehicle: VehicleTimeline) -> Verdict:
    """The worst that the timeline of a vehicle shows."""
    log = _Log(timeline, vehicle)
    for find in FINDERS:
        for word, rest in find(log):
            text = f"{word}{rest}."
            return Verdict(STATES[word], text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…")
    raise AssertionError("the last finder always finds")


Found = tuple[str, str]
"""The word, and what follows it."""


def _stops(log: _Log) -> Iterator[Found]:
    """An emergency stop of an armed robot, first of one that moves; or one that lasts to the end."""
    stops = [span for span in log.vehicle.tracks["e_stopped"] if span.value == "TRUE"]
    armed = [span for span in stops if log.has("armed", "TRUE", span.start)]
    moving = [span for span in armed if log.has("in_motion", "TRUE", span.start)]
    serious = moving or armed or [span for span in stops if span.end >= log.end]
    serious = serious or (stops if not log.vehicle.errors and not arm_cycles(log.vehicle.tracks["armed"]) else [])
    if serious:
        first = serious[0]
        ended = "still engaged at the end of the log" if first.end >= log.end else f"released at {log.at(first.end)}"
        if first.end < log.end and not log.has("e_stopped", "FALSE", first.end + 1):
            ended = f"unknown from {log.at(first.end)}"
        again = f"; {len(stops)} stops in all" if len(stops) > 1 else ""
        yield "EMERGENCY STOP", f" at {log.at(first.start)}{_of_stop(log, first)}; {ended}{again}"


def _of_stop(log: _Log, stop: Span) -> str:
    """Who has engaged it, by which record, and how it moved."""
    rule = stop.rule or ""
    moving = _MOVING.search(rule)
    who = _BY.search(_MOVING.sub("", rule)) if rule.startswith("emergency stop") else None
    by = f"by {who[1] if who[1][0].isupper() else _the(who[1])}" if who else ""
    told = ", ".join(part for part in (by, _short(stop.source or "")) if part)
    plain = " while it moved" if log.has("in_motion", "TRUE", stop.start) else " while it was armed"
    plain = plain if log.has("armed", "TRUE", stop.start) else " while it was disarmed"
    return f"{moving[0] if moving else plain}{f' ({told})' if told else ''}"


def _the(words: str) -> str:
    """With its article: `the kill switch`, but `ground station 255` and `a switch of the radio`."""
    return words if re.match(r"(a|an|its|ground station|system) ?", words) else f"the {words}"


def _crashes(log: _Log) -> Iterator[Found]:
    """A crash, with the disarm that follows it."""
    for one in log.vehicle.errors:
        if one.name not in CRASHES:
            continue
        disarm = log.disarm_after(one.start - SECOND // 2)
        disarmed = ""
        if disarm is not None:
            later = (disarm.start - one.start) / SECOND
            disarmed = f"; disarmed{_why(disarm)}" + (f" {later:.1f} s later" if later >= 0.1 else "")
        yield "CRASHED", f" at {log.at(one.start)}{_into(log, one.start)}{_quoted(one)}{disarmed}"
    for span in _disarms(log):
        if "crash check" in (span.rule or ""):
            yield "CRASHED", f": disarmed{_air(log, span)} at {log.at(span.start)}{_why(span)}"


def _failures(log: _Log) -> Iterator[Found]:
    """Disarmed or taken over by a failsafe; disarmed in the air; else the first error while it was armed."""
    for span in _disarms(log):
        if BY_ITSELF.search(span.rule or ""):
            yield "FAULT", f": disarmed{_air(log, span)} at {log.at(span.start)}{_why(span)}"
    for span in log.vehicle.tracks["flight_mode"]:
        found = re.search(r", by (the [\w ]*(?:failsafe|fence|glitch|check)[\w ]*)", span.rule or "")
        if found and log.has("armed", "TRUE", span.start + 1):
            disarm = log.disarm_after(span.start)
            ended = f"; disarmed at {log.at(disarm.start)}{_why(disarm)}" if disarm is not None else ""
            source = f" ({span.source})" if span.source else ""
            yield "FAULT", f": {found[1]} switched to {span.value} at {log.at(span.start)}{source}{ended}"
    for span in _disarms(log):
        if span.rule and _air(log, span) == " in the air" and not LANDED.search(span.rule or ""):
            yield "FAULT", f": disarmed in the air at {log.at(span.start)}{_why(span)}"
    yield from _errors(log, [one for one in log.vehicle.errors if log.has("armed", "TRUE", one.start)])


def _faults(log: _Log) -> Iterator[Found]:
    """The first error of a robot that is not armed."""
    yield from _errors(log, log.vehicle.errors)


def _errors(log: _Log, errors: Sequence[Reason]) -> Iterator[Found]:
    for one in sorted(errors, key=lambda one: one.start):
        word = "CONFLICT" if one.name in CONFLICTS else "FAULT"
        more = len({other.title for other in log.vehicle.errors}) - 1
        also = f"; {more} other {'errors' if more > 1 else 'error'}" if more else ""
        disarm = log.disarm_after(one.start)
        ended = _ended(log, one.end) if disarm is None else f"; disarmed at {log.at(disarm.start)}{_why(disarm)}"
        yield word, f" at {log.at(one.start)}{_into(log, one.start)}: {one.name}{_quoted(one)}{ended}{also}"


def _lost(log: _Log) -> Iterator[Found]:
    """A link that was lost while it was armed, or for good."""
    for span in log.vehicle.tracks["link"]:
        if span.value == "LOST":
            yield "LOST", f" at {log.at(span.start)}{_ended(log, span.end)}"


def _cut(log: _Log) -> Iterator[Found]:
    """A log that ends while the robot is armed: what happened then is not in it."""
    last = log.vehicle.tracks["armed"][-1:]
    if last and last[0].value == "TRUE" and last[0].end >= log.end:
        moving = " and moving" if log.has("in_motion", "TRUE", log.end) else ""
        told = f"the log ends at {log.at(log.end)} while it is armed{moving}; it does not tell what happened then"
        yield ("MOVING" if moving else "ARMED"), f": {told}"


def _refused(log: _Log) -> Iterator[Found]:
    """Never armed, with the reason that lasted longest."""
    vehicle = log.vehicle
    refused = [one for one in vehicle.inhibits if one.name == "PREARM_FAILING"]
    if arm_cycles(vehicle.tracks["armed"]) or not refused:
        return
    lasted: dict[str, list[Reason]] = {}
    for one in refused:
        lasted.setdefault(one.text or "", []).append(one)
    text, found = max(lasted.items(), key=lambda item: _weight(log, *item))
    end = found[-1].end
    until = "to the end" if end >= log.end - SECOND else f"to +{end / SECOND:.1f} s"
    told = f"“{_short(text)}”" if text else "its arming checks fail"
    more = f"; {len(lasted) - 1} other reasons" if len(lasted) > 2 else ""
    yield (
        "CANNOT ARM",
        f": never armed in {_lasted(_heard(vehicle))}; {told} from {log.at(found[0].start)} {until}{more}",
    )


def _weight(log: _Log, text: str, found: Sequence[Reason]) -> tuple[bool, bool, bool, int]:
    """Which reason against arming counts most: one with words, at the end of the log, of an attempt, the latest."""
    return bool(text), found[-1].end >= log.end - SECOND, text.startswith("Arm: "), found[-1].start


def _quiet(log: _Log) -> Iterator[Found]:
    """Nothing stopped it; or the log does not tell."""
    vehicle = log.vehicle
    cycles = arm_cycles(vehicle.tracks["armed"])
    if cycles:
        last = cycles[-1]
        disarm = log.disarm_after(last.start)
        drives = "one drive" if len(cycles) == 1 else f"{len(cycles)} drives"
        armed = _lasted(sum(cycle.armed for cycle in cycles))
        who = "" if disarm is None else f", disarmed{_why(disarm)}"
        modes = _modes(vehicle.tracks["mode"], cycles[0].start, last.end)
        span = f"armed from {log.at(cycles[0].start)} to {log.at(last.end)}{who}"
        yield "READY", f": nothing stopped it, no fault: {drives} of {armed}{modes}, {span}"
    if any(span.value == "FALSE" for span in vehicle.tracks["armed"]):
        yield "PARKED", f": never armed in {_lasted(_heard(vehicle))}, no fault"
    if not any(span.value != "NEVER_SEEN" for span in vehicle.tracks["link"]):
        yield "NOT HEARD", ": it is not heard in this log"
    yield "UNKNOWN", f": the log of {_lasted(log.end)} does not tell whether it was armed"


FINDERS: Final[tuple[Callable[[_Log], Iterator[Found]], ...]] = (
    _stops, _crashes, _failures, _lost, _cut, _refused, _faults, _quiet
)  # fmt: skip
"""In the order of importance: the first that finds something has the verdict."""


# -- words -------------------------------------------------------------------------------------------------------------


def _disarms(log: _Log) -> Iterator[Span]:
    moment = 0
    while (found := log.disarm_after(moment)) is not None:
        yield found
        moment = found.end


def _why(disarm: Span) -> str:
    """` by the crash check (ARM.Method 12)`; empty if the log does not tell."""
    if not disarm.rule or not disarm.source:
        return ""
    rule = disarm.rule.removeprefix("disarmed")
    source = disarm.source if not disarm.source.startswith("message") else ""
    return f"{rule if rule.startswith((' by', ',')) else ''}{f' ({source})' if source else ''}"


def _air(log: _Log, span: Span) -> str:
    """How it was when it was disarmed."""
    before = log.span("in_motion", span.start - 1)
    if before is None or before.value != "TRUE":
        return ""
    return " in the air" if before.rule == "airborne" else " while it moved"


def _into(log: _Log, at: int) -> str:
    """How long it had been in its mode: `, 15 s into AUTO`. Disarmed it says nothing."""
    armed, mode = log.span("armed", at - 1), log.span("flight_mode", at - 1)
    if armed is None or armed.value != "TRUE" or mode is None or not mode.value:
        return ""
    return f", {_lasted(at - max(mode.start, armed.start))} into {mode.value}"


def _quoted(one: Reason) -> str:
    return f": “{_short(one.text)}”" if one.text else ""


def _short(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 1]}…"


def _ended(log: _Log, end: int) -> str:
    return ", to the end of the log" if end >= log.end else f", until {log.at(end)}"


def _heard(vehicle: VehicleTimeline) -> int:
    return sum(span.end - span.start for span in vehicle.tracks["link"] if span.value == "CONNECTED")


def _modes(spans: Sequence[Span], start: int, end: int) -> str:
    found = dict.fromkeys(s.value for s in spans if s.start < end and s.end > start and s.value != "UNKNOWN")
    return f" in {' and '.join(found)}" if found else ""


def _lasted(us: int) -> str:
    seconds = round(us / SECOND)
    if seconds < 100:
        return f"{seconds} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 100 else f"{minutes // 60} h {minutes % 60} min"
