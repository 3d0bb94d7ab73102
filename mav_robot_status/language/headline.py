"""The headline of a status: one large word, then why, then what to do next."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from typing import Final, NamedTuple

from ..json_object import JsonMapping
from .remedies import Remedy, remedy
from .values import UNKNOWN, Look, Tone, look

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

    def plain(self, clock: Callable[[str], str]) -> str:
        """The sentence in one string."""
        parts = [self.text, "" if self.at is None else clock(self.at), "" if self.quote is None else f"“{self.quote}”"]
        return " ".join(part for part in parts if part) + ("" if self.text.endswith((".", ":")) else ".")


class Headline(NamedTuple):
    """What a person reads first."""

    word: str
    shape: str
    glyph: str
    ascii: str
    tone: Tone
    sentences: tuple[Sentence, ...]
    """Why, in the order of importance."""
    step: str = ""
    """The next step; empty if nobody must do anything."""
    topic: str = ""
    """The heading of docs/how-to/cannot-move.md; empty: none."""
    rank: int = 0
    """The order of problems in a fleet: the lowest first."""


class _Row(NamedTuple):
    """The headline of a state."""

    word: str
    look: Look
    tone: Tone
    rank: int


LOST_LOOK: Final = look("link", "LOST")
STOPPED, ERROR = look("e_stopped", True), look("in_error", True)
CAN_MOVE, CANNOT_MOVE = look("motion_possible", True), look("motion_possible", False)
MOVING: Final = look("in_motion", True)

ROWS: Final = {
    "lost": _Row("LOST", LOST_LOOK, "warning", 2),
    "not heard": _Row("NOT HEARD", look("link", "NEVER_SEEN"), "unknown", 4),
    "moving": _Row("MOVING", MOVING, "active", 6),
    "stopped": _Row("EMERGENCY STOP", STOPPED, "alarm", 0),
    "partly stopped": _Row("STOPPED IN PART", STOPPED, "alarm", 0),
    "can move": _Row("CAN MOVE", CAN_MOVE, "active", 7),
    "cannot move": _Row("CANNOT MOVE", CANNOT_MOVE, "calm", 8),
    "not ready": _Row("NOT READY", CANNOT_MOVE, "warning", 3),
    "unknown": _Row("UNKNOWN", UNKNOWN, "unknown", 5),
}
IN_ERROR: Final = 1
"""The rank of a robot in error."""
NEEDS_A_LOOK: Final = 3
"""The rank of one that cannot move for a reason that needs a person."""

UNHEARD: Final = "LINK_STALE"
"""The inhibit that says that a robot is not heard."""
SINCE: Final = "Unknown since"
LAST: Final = "Last known"
MAY_MOVE: Final = Sentence("It may be moving")
MOTION_UNKNOWN: Final = Sentence("Whether it moves is unknown")
PART: Final = Sentence("Another member may move: look at each")
"""For a group whose line does not say which members are ready."""
OF_A_MEMBER: Final = {
    "E_STOPPED": "is stopped",
    UNHEARD: "is not heard and may move",
    "MOTION_UNKNOWN": "may be able to move",
}
"""What a member does that is not ready, by the reason."""


def headline(line: Line, last: Line | None = None) -> Headline:
    """The headline of a JSON line. `last` is the last line of the same handle whose link was CONNECTED, if known."""
    state = _state(line)
    row = ROWS[state]
    if state in ("lost", "not heard"):
        return _built(row, _unheard(line, last, state), remedy({"name": UNHEARD}))
    causes = [*_list(line, "errors"), *_inhibits(line), *_unheard_members(line)]
    sentences = (
        *_why(line, state),
        *map(_sentence, _list(line, "errors")),
        *(() if _members(line) else map(_quoted, _unheard_members(line))),
        *(() if state == "unknown" or isinstance(line.get("in_motion"), bool) else (MOTION_UNKNOWN,)),
        *_charge(line, state),
    )
    needy = next((found for cause in causes if (found := remedy(cause)).person), None)
    tone, rank = row.tone, row.rank
    if line.get("in_error") is True:
        tone, rank = "alarm", min(rank, IN_ERROR)
    if line.get("e_stopped") is True or _stopped_members(line):  # it, or another member, may still move
        tone, rank = "alarm", ROWS["stopped"].rank
    elif tone == "calm" and needy is not None:
        tone, rank = "warning", NEEDS_A_LOOK
    first = needy or (remedy(causes[0]) if causes else None)
    return _built(row._replace(tone=tone, rank=rank), sentences, first)


def _built(row: _Row, sentences: tuple[Sentence, ...], found: Remedy | None) -> Headline:
    step, topic = (found.step, found.topic) if found else ("", "")
    return Headline(
        row.word, row.look.shape, row.look.glyph, row.look.ascii, row.tone, sentences, step, topic, row.rank
    )


def _state(line: Line) -> str:
    """The key of ROWS. For a group it never says that no part of it moves."""
    link = _part(line, "link")
    if link.get("state") != "CONNECTED":
        return "not heard" if link.get("state") == "NEVER_SEEN" else "lost"
    is_group = bool(line.get("members"))
    if line.get("in_motion") is True:
        return "moving"
    if line.get("e_stopped") is True and (not is_group or _whole_is_stopped(line)):
        return "stopped"
    if is_group and line.get("motion_possible") is not True and (line.get("e_stopped") or _stopped_members(line)):
        return "partly stopped"
    if line.get("motion_possible") is True:
        return "can move"
    if line.get("motion_possible") is False:
        return "not ready" if is_group else "cannot move"
    return "unknown"


def _unheard(line: Line, last: Line | None, state: str) -> tuple[Sentence, ...]:
    if state == "not heard":
        return (Sentence("No heartbeat has arrived"), MOTION_UNKNOWN)
    since = heard_at(line) or (None if last is None else heard_at(last))
    first = Sentence(SINCE, since) if since else Sentence("Nothing is known")
    return (first, MAY_MOVE, *(() if last is None else (Sentence(f"{LAST}: {last_known(last)}"),)))


def last_known(last: Line) -> str:
    """The last state before a loss in a few words: `AUTO, moving`."""
    names = ("mode", "in_motion", "motion_possible", "e_stopped", "in_error")
    words = {name: look(name, last.get(name)).word for name in names}
    shown = [words["mode"] if last.get("mode") != "UNKNOWN" else "mode unknown"]
    shown.append(words["in_motion"].lower() if last.get("in_motion") is not None else "motion unknown")
    if last.get("in_motion") is not True and last.get("motion_possible") is not None:
        shown.append(words["motion_possible"].lower())
    shown += [
        word for name, word in (("e_stopped", "emergency stop"), ("in_error", "in error")) if last.get(name) is True
    ]
    return ", ".join(shown)


def heard_at(line: Line) -> str | None:
    """When the robot was last heard, as RFC 3339; None if the line does not tell."""
    age = _part(line, "link").get("heartbeat_age")
    if not isinstance(age, (int, float)):
        return None
    try:
        stamp = datetime.fromisoformat(str(line["stamp"]).replace("Z", "+00:00"))
        at = stamp - timedelta(seconds=age)
    except (KeyError, TypeError, ValueError, OverflowError):
        return None
    return str(at.isoformat(timespec="milliseconds")).replace("+00:00", "Z")


def _why(line: Line, state: str) -> tuple[Sentence, ...]:
    """Why it cannot move, or what is not known."""
    if state == "unknown":
        return (
            Sentence("Whether it can move is unknown"),
            *(_members(line) or (MAY_MOVE,)),
            *map(_quoted, _inhibits(line)),
        )
    if line.get("motion_possible") is not False:
        return _members(line) or ((PART,) if state == "partly stopped" else ())
    found = _inhibits(line)
    if not found:
        return () if state == "moving" else (Sentence("Cannot move"),)
    names = dict.fromkeys(_member(one) + remedy(one).sentence for one in found)
    says = "It executes no motion command" if state == "moving" else "Cannot move"
    return (
        Sentence(f"{says}: {', '.join(names)}"),
        *map(_quoted, (one for one in found if one.get("text"))),
        *_others(line),
    )


def _others(line: Line) -> tuple[Sentence, ...]:
    """The members of a group that cannot move as a whole: another rule than ours may say so while one of them can."""
    names, told = line.get("members"), _list(line, "not_ready")
    if not names or (told and isinstance(names, list) and len(told) >= len(names)):
        return ()
    return _members(line) or (PART,)


def _members(line: Line) -> tuple[Sentence, ...]:
    """Each member of a group in which one is not ready: `base is stopped; arm is ready and may move`."""
    not_ready = {str(one.get("handle")): one.get("why") for one in _list(line, "not_ready")}
    names = line.get("members")
    if not not_ready or not isinstance(names, list):
        return ()
    words = (f"{name} {_of_a_member(name, not_ready)}" for name in map(str, names))
    return (Sentence("; ".join(words)),)


def _of_a_member(name: str, not_ready: Mapping[str, object]) -> str:
    if name not in not_ready:
        return "is ready and may move"
    why = not_ready[name]
    return OF_A_MEMBER.get(str(why)) or f"is not ready: {remedy({'name': why}).sentence}"


def _stopped_members(line: Line) -> list[str]:
    """The members of a group whose emergency stop is engaged."""
    return [str(one.get("handle")) for one in _list(line, "not_ready") if one.get("why") == "E_STOPPED"]


def _whole_is_stopped(line: Line) -> bool:
    names = line.get("members")
    return isinstance(names, list) and set(map(str, names)) == set(_stopped_members(line))


def _quoted(cause: JsonMapping) -> Sentence:
    text, member = cause.get("text"), _member(cause)
    said = remedy(cause).sentence
    return (
        Sentence(f"{member}The autopilot says", None, str(text))
        if text
        else Sentence(f"{member}{said}" if member else said[:1].upper() + said[1:])
    )


def _sentence(error: JsonMapping) -> Sentence:
    """An error, with the words of the autopilot."""
    text = error.get("text")
    return Sentence(f"Error: {_member(error)}{remedy(error).sentence}", None, str(text) if text else None)


def _member(cause: JsonMapping) -> str:
    """The member of a group that reports a cause, for the front of a sentence."""
    return f"{cause['handle']}: " if cause.get("handle") else ""


def _charge(line: Line, state: str) -> tuple[Sentence, ...]:
    """Who commands it."""
    if state in ("cannot move", "not ready", "stopped", "partly stopped"):
        return ()
    flown = _part(line, "vehicle").get("flight_mode")
    mode = f" ({flown})" if flown else ""
    who = {"AUTO": "A program commands it", "MANUAL": "A person commands it"}
    return (Sentence(who.get(str(line.get("mode")), "Who commands it is unknown") + mode),)


def _part(line: Line, name: str) -> JsonMapping:
    found = line.get(name)
    return found if isinstance(found, Mapping) else {}


def _list(line: Line, name: str) -> list[JsonMapping]:
    found = line.get(name)
    return [one for one in found if isinstance(one, Mapping)] if isinstance(found, list) else []


def _inhibits(line: Line) -> list[JsonMapping]:
    """The inhibits, those with words of the autopilot last. A lost link is left out: it gives no reason."""
    found = (one for one in _list(line, "inhibits") if one.get("name") != UNHEARD)
    return sorted(found, key=lambda one: bool(one.get("text")))


def _unheard_members(line: Line) -> list[JsonMapping]:
    """The inhibits that say which members of a group are not heard."""
    return [one for one in _list(line, "inhibits") if one.get("name") == UNHEARD]
