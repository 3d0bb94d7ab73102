"""The events of all robots: what goes wrong with each, when it ends, and who looks at it has seen it."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple

from ..interface import DEFAULT_HANDLE_NAME
from ..language import Trouble, state_of, troubles
from ..language.states import CANNOT_ARM, EMERGENCY_STOP, LOST, NOT_HEARD

if TYPE_CHECKING:
    from ..json_object import JsonMapping

MOST_EVENTS: Final = 400
MOST_PENDING: Final = 400
"""Events that wait for a person. Beyond that the oldest counts as seen."""

BEGINS, ENDS, SEEN = "begins", "ends", "acknowledged"
Key = tuple[str, str, str]


class Event(NamedTuple):
    """The begin, the end or the acknowledgement of one trouble of one robot."""

    version: int
    """That of the board after it."""
    stamp: str
    """RFC 3339."""
    handle: str
    name: str
    """What people call the robot."""
    word: str
    """That of the state of the trouble."""
    shape: str
    tone: str
    what: str
    """`begins`, `ends` or `acknowledged`."""
    why: str
    """The cause in a few words; of an end what the robot is now. Untrusted."""


class Alarms:
    """Follows the lines of all robots. A lost link ends no trouble: nobody knows whether it goes on. Bounded."""

    def __init__(self) -> None:
        self.events: deque[Event] = deque(maxlen=MOST_EVENTS)
        """The latest last."""
        self.pending: dict[tuple[str, Key], Event] = {}
        """The begins that nobody has acknowledged, the oldest first."""
        self.version = 0
        """That of the board at the last change of `pending`."""
        self._active: dict[str, dict[Key, Trouble]] = {}

    def take(self, handle: str, line: JsonMapping, stamp: str, version: int) -> None:
        """The new line of a robot. Of a group its members tell."""
        state = state_of(line)
        if line.get("members") or state is NOT_HEARD:
            return
        before = self._active.get(handle, {})
        now = {one.key: one for one in troubles(line)}
        if state is LOST:
            now = {**before, **now}
        if now == before:
            return
        for key, one in before.items():
            if key not in now:
                self._tell(handle, line, one, ENDS, _ended(one, line), stamp, version)
        for key, one in now.items():
            if key not in before:
                event = self._tell(handle, line, one, BEGINS, one.why, stamp, version)
                if one.state is not CANNOT_ARM:  # it stands, and may for long
                    self.pending.pop((handle, key), None)
                    self.pending[handle, key] = event
                    self.version = version
        while len(self.pending) > MOST_PENDING:
            del self.pending[next(iter(self.pending))]
        self._active[handle] = now

    def acknowledge(self, handle: str | None, stamp: str, version: int) -> bool:
        """A person has seen what is pending of one robot, or of all. Returns whether there was something."""
        seen = [key for key in self.pending if handle is None or key[0] == handle]
        for key in seen:
            event = self.pending.pop(key)
            self.events.append(event._replace(version=version, stamp=stamp, what=SEEN))
        if seen:
            self.version = version
        return bool(seen)

    def forget(self, handle: str, version: int) -> None:
        """A robot is gone. Its events stay."""
        self._active.pop(handle, None)
        gone = [key for key in self.pending if key[0] == handle]
        for key in gone:
            del self.pending[key]
            self.version = version

    def _tell(
        self, handle: str, line: JsonMapping, one: Trouble, what: str, why: str, stamp: str, version: int
    ) -> Event:
        state = one.state
        event = Event(version, stamp, handle, name_of(handle, line), state.word, state.shape, state.tone, what, why)
        self.events.append(event)
        return event


def _ended(one: Trouble, line: JsonMapping) -> str:
    """How a trouble ended, and what the robot is now."""
    now = f"now {state_of(line).word}"
    if one.state is EMERGENCY_STOP:
        return f"{'released' if line.get('e_stopped') is False else 'unknown whether it is released'}, {now}"
    return f"heard again, {now}" if one.state is LOST else f"{one.why} ended, {now}"


def name_of(handle: str, line: JsonMapping) -> str:
    """What people call a robot: its name, its handle, or its system id for a default handle."""
    vehicle, system = line.get("vehicle"), line.get("system")
    name = vehicle.get("name") if isinstance(vehicle, dict) else None
    if isinstance(name, str) and name:
        return name
    default = handle == DEFAULT_HANDLE_NAME or handle.startswith(f"{DEFAULT_HANDLE_NAME}/")
    return f"System {system}" if default and isinstance(system, int) else handle
