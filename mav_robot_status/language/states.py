"""The states of a robot: one word, shape, severity and tone each, worst first; and what is wrong with a robot.

Page, `watch`, report, events and ground stations draw from this table.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final, NamedTuple

from ..json_object import JsonMapping
from .remedies import INITIALS, SENSOR_ROWS, WORDS_DECIDE, remedy, spoken
from .values import Tone


class State(NamedTuple):
    """How a state of a robot looks."""

    meaning: str
    """Of a robot that is: `emergency stop engaged`."""
    word: str
    shape: str
    """The name of a drawing in `shapes`. No two states have the same."""
    glyph: str
    """The same in a terminal, one cell wide."""
    ascii: str
    """The same in a terminal without UTF-8."""
    severity: int
    """MAV_SEVERITY."""
    tone: Tone
    member: str
    """What it says of a member of a group: `base is stopped`."""

    @property
    def rank(self) -> int:
        """Its place in the table: the worst has 0."""
        return _RANKS[self.word]


EMERGENCY_STOP: Final = State("emergency stop engaged", "EMERGENCY STOP", "stop", "■", "#", 2, "alarm", "is stopped")
CRASHED: Final = State("crashed, terminated", "CRASHED", "crash", "▲", "X", 2, "alarm", "has crashed")
CONFLICT: Final = State("two autopilots, one id", "CONFLICT", "conflict", "∞", "8", 3, "alarm", "is in CONFLICT")
FAULT: Final = State("any other error", "FAULT", "fault", "◆", "!", 3, "alarm", "is in FAULT")
LOST: Final = State("lost", "LOST", "lost", "✗", "x", 4, "warning", "is LOST")
CANNOT_ARM: Final = State("cannot arm", "CANNOT ARM", "locked", "⊘", "/", 4, "warning", "cannot arm")
UNKNOWN: Final = State("unknown", "UNKNOWN", "unknown", "?", "?", 5, "unknown", "is UNKNOWN")
NOT_HEARD: Final = State("not heard yet", "NOT HEARD", "unheard", "◌", ":", 6, "unknown", "is NOT HEARD")
ARMED: Final = State("energised but standing", "ARMED", "power", "↯", "~", 6, "active", "is READY")
MOVING: Final = State("moving", "MOVING", "move", "▶", ">", 6, "active", "is MOVING")
READY: Final = State("disarmed, checks pass", "READY", "ring", "○", "o", 6, "calm", "is READY to arm")
PARKED: Final = State("disarmed, checks unknown", "PARKED", "parked", "▪", "P", 6, "calm", "is PARKED")

ROBOT_STATES: Final = (
    EMERGENCY_STOP, CRASHED, CONFLICT, FAULT, LOST, CANNOT_ARM, UNKNOWN, NOT_HEARD, ARMED, MOVING, READY, PARKED
)  # fmt: skip
"""The table, worst first."""
_RANKS: Final = {state.word: rank for rank, state in enumerate(ROBOT_STATES)}

UNHEARD: Final = "LINK_STALE"
"""The inhibit of a robot, or of a member of a group, that is not heard."""
CRASHES: Final = frozenset({"CRASH", "FLIGHT_TERMINATION", "TERMINATION_ANNOUNCED", "TERMINATION"})
"""The errors and inhibits of a robot that has crashed or was terminated."""
UNNAMED: Final = "ERROR"
"""The name of an error that the robot reports without a cause."""
CONFLICTS: Final = frozenset({"SYSTEM_ID_CONFLICT"})
UNSURE: Final = frozenset({UNHEARD, "SYS_STATUS_MISSING", "STOP_UNCERTAIN", "SENDER_UNCERTAIN", "HEARTBEAT_LATE"})
"""The inhibits that say why something is unknown, not why motion is not possible."""
NO_REASON_AGAINST_ARMING: Final = UNSURE | CRASHES | {"E_STOPPED", "EMERGENCY", "HIL", "MOTION_NOT_POSSIBLE"}
SHOWN_BY: Final[dict[str, frozenset[str]]] = {
    "SENSOR_BATTERY": frozenset({"BATTERY_LOW", "BATTERY_CRITICAL", "BATTERY_FAULT"}),
    "SENSOR_AHRS": frozenset({"ESTIMATOR"}),
    "SENSOR_RC_RECEIVER": frozenset({"RC_LOST"}),
    "SENSOR_GPS": frozenset({"GPS"}),
    "SENSOR_GEOFENCE": frozenset({"GEOFENCE"}),
    "SENSOR_LEAK": frozenset({"LEAK"}),
    "SENSOR_TERRAIN": frozenset({"TERRAIN"}),
    "FAILSAFE": frozenset({"RC_LOST", "GCS_LOST", "BATTERY_LOW", "BATTERY_CRITICAL", "ESTIMATOR", "OFFBOARD_LOST"}),
}
"""One alarm for one cause: errors that say the same as others, if one of those is active."""
_PREFIX: Final = re.compile(r"^(pre-?arm|arm|crash|crash(ed)?)\b[:!]?\s*", re.I)


class Trouble(NamedTuple):
    """One thing that is wrong with a robot."""

    state: State
    cause: JsonMapping
    """The error or inhibit of the JSON line; empty if none says it."""
    why: str
    """The cause in a few words, the autopilot's own if they say it; untrusted."""

    @property
    def key(self) -> tuple[str, str, str]:
        """What tells it from the other troubles of the robot."""
        return self.state.word, str(self.cause.get("name", "")), str(self.cause.get("handle") or "")


def troubles(line: JsonMapping) -> list[Trouble]:
    """What is wrong with a robot, by the members of its JSON line, the worst first. Of a lost one: that it is lost."""
    link = part(line, "link").get("state")
    if link != "CONNECTED":
        return [] if link == "NEVER_SEEN" else [Trouble(LOST, {}, "nothing heard")]
    found = [Trouble(state_of_error(error), error, few_words(error, line)) for error in errors(line)]
    inhibits = causes(line, "inhibits")
    if line.get("in_error") is True and not found:
        found.append(Trouble(FAULT, {"name": UNNAMED}, f"error {line.get('error_code')}"))
    if line.get("e_stopped") is True:
        own = next((one for one in inhibits if one.get("name") == "E_STOPPED"), {"name": "E_STOPPED"})
        found.append(Trouble(EMERGENCY_STOP, own, "engaged"))
    if not any(one.state is CRASHED for one in found):
        found += [Trouble(CRASHED, one, few_words(one, line)) for one in inhibits if one.get("name") in CRASHES][:1]
    if not found:
        found += [Trouble(FAULT, one, few_words(one, line)) for one in inhibits if one.get("name") == "EMERGENCY"][:1]
    found += cannot_arm(line)[:1]
    return sorted(found, key=lambda one: one.state.rank)


def cannot_arm(line: JsonMapping) -> list[Trouble]:
    """The reasons why a disarmed robot cannot be armed, those with words of the autopilot first."""
    if line.get("motion_possible") is not False or line.get("drives_powered") is True:
        return []
    against = [one for one in causes(line, "inhibits") if one.get("name") not in NO_REASON_AGAINST_ARMING]
    found = [one for one in against if remedy(one).person]
    if not found and part(line, "vehicle").get("can_arm") is False:
        found = [{"name": "PREARM_FAILING"}]
    found.sort(key=lambda one: not one.get("text"))
    return [Trouble(CANNOT_ARM, one, few_words(one, line)) for one in found]


def state_of(line: JsonMapping) -> State:
    """The state of a robot. One that moves is MOVING, whatever else is so."""
    link = part(line, "link").get("state")
    if link != "CONNECTED":
        return NOT_HEARD if link == "NEVER_SEEN" else LOST
    if line.get("in_motion") is True:
        return MOVING
    possible, powered = line.get("motion_possible"), line.get("drives_powered")
    found = troubles(line)
    if line.get("members") and not (possible is False and powered is False):
        found = [one for one in found if one.state is not EMERGENCY_STOP]  # a member may be live
    if found:
        return found[0].state
    if powered is True or possible is True:
        return ARMED
    if possible is False and powered is False:
        return READY if part(line, "vehicle").get("can_arm") is True else PARKED
    return UNKNOWN


def state_of_error(error: JsonMapping) -> State:
    """The state of a robot with this error."""
    name = error.get("name")
    return CRASHED if name in CRASHES else CONFLICT if name in CONFLICTS else FAULT


def errors(line: JsonMapping) -> list[JsonMapping]:
    """The errors, without those that say the same as others."""
    found = causes(line, "errors")
    names = {str(one.get("name")) for one in found}
    return [one for one in found if not names & SHOWN_BY.get(str(one.get("name")), frozenset())]


def sentence(cause: JsonMapping, line: JsonMapping) -> str:
    """What a cause is, as a sentence in lower case without its full stop; in a group with the member in front."""
    system = line.get("system")
    said = remedy(cause).sentence
    if cause.get("name") in CONFLICTS and isinstance(system, int):
        said = f"two autopilots use system id {system}"
    return f"{cause['handle']}: {said}" if cause.get("handle") else said


def few_words(cause: JsonMapping, line: JsonMapping) -> str:
    """The cause in a few words: the autopilot's own of a crash or a failed check, else ours: `battery low`."""
    name, text = str(cause.get("name", "")), cause.get("text")
    if isinstance(text, str) and text and (name in WORDS_DECIDE or name in CRASHES):
        return _PREFIX.sub("", text) or text
    if name in CONFLICTS:
        return sentence({**cause, "handle": None}, line)
    if (name.removeprefix("SENSOR_") in SENSOR_ROWS and name.startswith("SENSOR_")) or name in WORDS_DECIDE:
        return re.sub(r"^(the|an?|its) ", "", remedy(cause).sentence)
    words = [INITIALS.get(word, word) for word in spoken(name).split()]
    return " ".join(words)


def part(line: JsonMapping, name: str) -> JsonMapping:
    """A member of a line that is an object; empty if it is none."""
    found = line.get(name)
    return found if isinstance(found, Mapping) else {}


def causes(line: JsonMapping, name: str) -> list[JsonMapping]:
    """The errors or inhibits of a line."""
    found = line.get(name)
    return [one for one in found if isinstance(one, Mapping)] if isinstance(found, list) else []
