"""The headline of a status: one large word, then why with the cause first, then what to do next."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from datetime import datetime, timedelta
from typing import Final, NamedTuple

from ..json_object import JsonMapping
from .remedies import remedy
from .states import (
    ARMED,
    CANNOT_ARM,
    CRASHED,
    EMERGENCY_STOP,
    LOST,
    MOVING,
    NOT_HEARD,
    PARKED,
    READY,
    UNHEARD,
    UNKNOWN,
    UNSURE,
    State,
    cannot_arm,
    causes,
    errors,
    part,
    sentence,
    state_of,
    troubles,
)
from .values import Tone, look

Line = JsonMapping
"""The members of a JSON line."""


class Sentence(NamedTuple):
    """One sentence. What an autopilot said is kept apart: a view quotes and isolates it."""

    text: str
    """Without its full stop."""
    at: str | None = None
    """A time after the text, as RFC 3339. A view shows it in the time zone of its reader."""
    quote: str | None = None
    """The words of the autopilot after it. Untrusted."""
    rest: str = ""
    """What follows the time."""

    def plain(self, clock: Callable[[str], str]) -> str:
        """The sentence in one string."""
        parts = [self.text, "" if self.at is None else clock(self.at), "" if self.quote is None else f"“{self.quote}”"]
        return " ".join(part for part in parts if part) + self.rest + ("" if self.text.endswith(".") else ".")


class Headline(NamedTuple):
    """What a person reads first."""

    state: State
    tone: Tone
    """That of the state; of a robot that moves although it is stopped or in error, that of the trouble."""
    rank: int
    """The order of problems in a fleet: the lowest first."""
    sentences: tuple[Sentence, ...]
    """Why, in the order of importance."""
    step: str = ""
    """The next step; empty if nobody must do anything."""
    topic: str = ""
    """The heading of docs/how-to/cannot-move.md; empty: none."""

    @property
    def word(self) -> str:
        """The word of the state."""
        return self.state.word


LAST: Final = "Last heard"
MAY_MOVE: Final = Sentence("It may be moving")
MAY_START: Final = Sentence("It may start at any time")
MOTION_UNKNOWN: Final = Sentence("Whether it moves is unknown")
FIRST_WORDS: Final = {
    "CRASH": "Crashed",
    "FLIGHT_TERMINATION": "Terminated",
    "TERMINATION": "Terminated",
    "TERMINATION_ANNOUNCED": "Terminated",
    "E_STOPPED": "Emergency stop engaged",
}
"""What the first sentence calls a cause."""
OF_A_MEMBER: Final = {
    "E_STOPPED": "is stopped",
    UNHEARD: "is LOST and may move",
    "MOTION_UNKNOWN": "is UNKNOWN and may move",
}
"""What a member of a group is that is not ready, by the reason."""
UNTOLD: Final = UNSURE | {"E_STOPPED"}
"""The inhibits that another sentence tells."""


def headline(line: Line, last: Line | None = None, members: Mapping[str, Line] | None = None) -> Headline:
    """The headline of a JSON line. `last` is the last line of the same handle whose link was CONNECTED, if known.

    `members` are the lines of the members of a group by handle, as far as they are known.
    """
    state, found = state_of(line), troubles(line)
    tone, rank = state.tone, state.rank
    own = {} if members is None else {name: members[name] for name in _members(line) if name in members}
    if state is EMERGENCY_STOP and any(one.get("e_stopped") is not True for one in own.values()):
        state = min((state_of(one) for one in own.values() if one.get("e_stopped") is not True), key=_rank)
    wrong = [one for each in own.values() for one in troubles(each)] if own else found
    worst = min((one.state for one in wrong), key=_rank, default=None)
    if worst is not None and worst.rank < rank:
        tone, rank = worst.tone, worst.rank
    if not own and any(one.get("why") == "E_STOPPED" for one in causes(line, "not_ready")):
        tone, rank = EMERGENCY_STOP.tone, EMERGENCY_STOP.rank  # another member may still move
    sentences = (*(_of_members(own) if own else _not_ready(line)), *_why(line, last, state))
    reported = [one.cause for one in wrong if one.cause] + _inhibits(line)
    steps = [remedy({"name": UNHEARD})] if state in (LOST, NOT_HEARD) else [remedy(cause) for cause in reported]
    step = next((one for one in steps if one.person), steps[0] if steps else None)
    return Headline(state, tone, rank, tuple(dict.fromkeys(sentences)), *((step.step, step.topic) if step else ()))


def _rank(state: State) -> int:
    return state.rank


def _members(line: Line) -> list[str]:
    found = line.get("members")
    return [one for one in found if isinstance(one, str)] if isinstance(found, list) else []


def _of_members(lines: Mapping[str, Line]) -> Iterator[Sentence]:
    """What each member of a group is: `base is stopped; arm is READY and may move`."""
    states = {name: state_of(line) for name, line in lines.items()}
    told = sorted(states.items(), key=lambda one: one[1].rank)
    yield Sentence("; ".join(f"{name} {state.member}{_may(lines[name], state)}" for name, state in told))


def _not_ready(line: Line) -> Iterator[Sentence]:
    """The same of a group whose members have no lines here, as far as its own line tells."""
    why = {str(one.get("handle")): str(one.get("why")) for one in causes(line, "not_ready")}
    if why:
        yield Sentence("; ".join(f"{name} {_of_a_member(why.get(name))}" for name in _members(line)))


def _of_a_member(why: str | None) -> str:
    if why is None:
        return "is READY and may move"
    return OF_A_MEMBER.get(why) or f"is not ready: {remedy({'name': why}).sentence}"


def _may(line: Line, state: State) -> str:
    """Whether the member may move, too. Of one that is stopped or moves, its state says it."""
    if state in (EMERGENCY_STOP, MOVING) or line.get("motion_possible") is False:
        return ""
    return " and may move"


def _why(line: Line, last: Line | None, state: State) -> Iterator[Sentence]:
    """The sentences: the cause first."""
    if state in (LOST, NOT_HEARD):
        yield from _unheard(line, last, state)
        return
    yield from _wrong(line, state)
    unsure = [one for one in _inhibits(line) if one.get("name") in UNSURE]
    if state is UNKNOWN:
        yield from (_quoted(one, line) for one in unsure)
        yield from (() if unsure else (Sentence("Whether it can move is unknown"),))
        yield MAY_MOVE
        return
    yield from _standing(line, state)
    yield from (_quoted(one, line) for one in unsure if state is PARKED or one.get("name") == UNHEARD)
    yield from () if isinstance(line.get("in_motion"), bool) else (MOTION_UNKNOWN,)
    if line.get("motion_possible") is not False:
        yield _charge(line)


def _wrong(line: Line, state: State) -> Iterator[Sentence]:
    """The emergency stop, then the errors, then why it cannot arm."""
    found = troubles(line)
    terminated = [one.cause for one in found if one.state is CRASHED and one.cause not in errors(line)]
    if line.get("e_stopped") is True:
        own = [one for one in causes(line, "inhibits") if one.get("name") == "E_STOPPED"]
        yield from (_first(one, line) for one in own or [{"name": "E_STOPPED"}])
    yield from (_first(one, line) for one in (*terminated, *errors(line)))
    if line.get("in_error") is True and not errors(line):
        yield Sentence(f"Error {line.get('error_code')}: no reason was reported")
    if state is not CANNOT_ARM:
        return
    for n, one in enumerate(cannot_arm(line)):
        text, said = one.cause.get("text"), sentence(one.cause, line)
        if text:
            yield Sentence(_member(one.cause) + ("Also:" if n else "Cannot arm:"), None, str(text))
        elif not n:
            yield Sentence(f"Cannot arm: {'no reason was reported' if said == 'it cannot be armed' else said}")
        elif said != "it cannot be armed":
            yield Sentence(_begun(said))


def _standing(line: Line, state: State) -> Iterator[Sentence]:
    """Why a robot that is not energised stands, or why one that is does not move."""
    if line.get("motion_possible") is not False:
        yield from (MAY_START,) if state is not MOVING and not line.get("members") else ()
        return
    told = {id(one.cause) for one in (*troubles(line), *cannot_arm(line))}
    said = [one for one in _inhibits(line) if id(one) not in told and one.get("name") not in UNTOLD]
    words = ", ".join(dict.fromkeys(sentence(one, line) for one in said))
    if state in (MOVING, ARMED):
        yield Sentence(f"It ignores motion commands: {words}" if words else "It ignores motion commands")
    elif troubles(line):
        yield from (Sentence(_begun(words.removeprefix("it is "))),) if words else ()
    elif words:
        yield Sentence(f"{'Ready' if state is READY else 'Parked'}: {words}")


def _first(cause: JsonMapping, line: Line) -> Sentence:
    """A cause with the words of the autopilot: `Crashed: “Crash: Going to HOLD”`."""
    text = cause.get("text")
    said = FIRST_WORDS.get(str(cause.get("name")))
    words = _begun(sentence(cause, line)) if said is None else _member(cause) + said
    return Sentence(f"{words}:", None, str(text)) if text else Sentence(words)


def _quoted(cause: JsonMapping, line: Line) -> Sentence:
    text = cause.get("text")
    words = _begun(sentence(cause, line))
    return Sentence(f"{words}:", None, str(text)) if text else Sentence(words)


def _unheard(line: Line, last: Line | None, state: State) -> Iterator[Sentence]:
    if state is NOT_HEARD:
        yield from (Sentence("No heartbeat has arrived"), MOTION_UNKNOWN)
        return
    since = heard_at(line) or (None if last is None else heard_at(last))
    known = "" if last is None else last_known(last)
    if since or known:
        yield Sentence(LAST, since, None, f": {known}" if known else "")
    yield MAY_MOVE


def last_known(last: Line) -> str:
    """The last state before a loss in a few words: `armed, moving, AUTO`."""
    powered = last.get("drives_powered")
    shown = [
        "emergency stop engaged" if last.get("e_stopped") is True else "",
        "in error" if last.get("in_error") is True else "",
        "armed" if powered is True else "disarmed" if powered is False else "",
        look("in_motion", last.get("in_motion")).word.lower() if isinstance(last.get("in_motion"), bool) else "",
        "" if last.get("mode") == "UNKNOWN" else str(last.get("mode") or ""),
    ]
    return ", ".join(word for word in shown if word)


def heard_at(line: Line) -> str | None:
    """When the robot was last heard, as RFC 3339; None if the line does not tell."""
    age = part(line, "link").get("heartbeat_age")
    if not isinstance(age, (int, float)):
        return None
    try:
        stamp = datetime.fromisoformat(str(line["stamp"]).replace("Z", "+00:00"))
        at = stamp - timedelta(seconds=age)
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    return str(at.isoformat(timespec="milliseconds")).replace("+00:00", "Z")


def _charge(line: Line) -> Sentence:
    """Who drives it."""
    flown = part(line, "vehicle").get("flight_mode")
    mode = f" ({flown})" if flown else ""
    who = {"AUTO": "A program drives it", "MANUAL": "A pilot drives it"}.get(str(line.get("mode")))
    if who is None and flown:
        number = str(flown).removeprefix("CMODE(").removesuffix(")")
        return Sentence(f"Mode {number} is not in our tables: pilot or program, unknown")
    return Sentence(f"{who}{mode}" if who else "Pilot or program: unknown")


def _inhibits(line: Line) -> list[JsonMapping]:
    """The inhibits, those with words of the autopilot last."""
    return sorted(causes(line, "inhibits"), key=lambda one: bool(one.get("text")))


def _member(cause: JsonMapping) -> str:
    """The member of a group that reports a cause, for the front of a sentence."""
    return f"{cause['handle']}: " if cause.get("handle") else ""


def _begun(text: str) -> str:
    return text[:1].upper() + text[1:]
