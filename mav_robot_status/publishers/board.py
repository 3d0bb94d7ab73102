"""The board: the latest status of every handle as plain values, and its recent changes. Views read it.

An entry has the members of a native JSON line, so that a view shows local statuses and statuses from a network alike.
The numbers of handles and transitions and their age are bounded.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Iterator
from heapq import merge
from typing import Final, NamedTuple

from ..clock import Instant, rfc3339
from ..interface import STATES, Publisher, PublisherContext, RobotStatusMsg
from ..interface.options import Options
from ..json_object import JsonMapping, JsonObject
from ..language.states import UNHEARD
from .alarms import Alarms
from .json_lines import members

MOST_HANDLES: Final = 4096
MOST_MEMBERS: Final = 256
"""Members that follow a group."""
MOST_TRANSITIONS: Final = 120
"""Changes kept of one field of one robot, so that a busy field displaces no change of another."""
KEPT: Final = 600.0
"""Seconds for which transitions are kept: the time span of a view."""


class Transition(NamedTuple):
    """A change of one member of one handle's status."""

    at: float
    """Monotonic seconds of the board's clock."""
    stamp: str
    """The time of the status, RFC 3339."""
    name: str
    """A field, `flight_mode`, `link`, `error` or `inhibit`."""
    value: object
    """The new value; of an error or inhibit its name, text and whether it begins."""
    before: object = None
    """The previous value. None for UNKNOWN, before the first value, and for an error or inhibit."""


class Entry:
    """The latest status of one handle."""

    __slots__ = ("_kept", "at", "began", "heartbeat_age", "last", "line", "lines", "stamp", "version")

    def __init__(self, now: float) -> None:
        self.began = now
        """When (monotonic seconds) the first line arrived."""
        self.lines = 0
        """The number of lines so far."""
        self.line: JsonMapping = {}
        """The members of its last native line with a change. `stamp` and `heartbeat_age` are kept separately."""
        self.last: JsonMapping | None = None
        """The last whole line with a connected link, once the link is lost; None before."""
        self.stamp = ""
        self.heartbeat_age: float | None = None
        self.at = 0.0
        """When (monotonic seconds) the latest line arrived."""
        self.version = 0
        """The version of the board at the last change of this entry."""
        self._kept: dict[str, deque[Transition]] = {}
        """The changes by name, the oldest first."""

    @property
    def transitions(self) -> list[Transition]:
        """The kept changes, the oldest first."""
        return list(merge(*self._kept.values(), key=_at))

    def kept_since(self) -> dict[str, float]:
        """From when the value of each field is known, monotonic seconds."""
        return {name: kept[0].at if len(kept) == MOST_TRANSITIONS else self.began for name, kept in self._kept.items()}

    def keep(self, new: Transition) -> None:
        """Keep a change."""
        if new.name not in self._kept:
            self._kept[new.name] = deque(maxlen=MOST_TRANSITIONS)
        self._kept[new.name].append(new)
        for kept in self._kept.values():
            while kept and new.at - kept[0].at > KEPT:
                kept.popleft()

    def whole(self) -> JsonObject:
        """The whole line, as `--format native` writes it. `seq` counts the lines so far."""
        link = {**self.line.get("link", {}), "heartbeat_age": self.heartbeat_age}
        return {"stamp": self.stamp, "seq": self.lines - 1, **self.line, "link": link}


class Board:
    """All entries by handle. Only one thread may use it."""

    def __init__(self) -> None:
        self.entries: dict[str, Entry] = {}
        self.version = 0
        """Counts the changes of all entries."""
        self.refused = 0
        """Lines of handles beyond MOST_HANDLES."""
        self.alarms = Alarms()
        self._seen: dict[str, tuple[object, object]] = {}

    def __iter__(self) -> Iterator[Entry]:
        """The groups, each with its members after it; then the other entries by system, component and handle.

        Entries without ids come last. An entry occurs once: a member of two groups follows the first.
        """
        ordered = sorted(self.entries.values(), key=_order)
        if not any(entry.line.get("members") for entry in ordered):
            return iter(ordered)
        return iter(dict.fromkeys(self._nested(ordered)))

    def update(self, msg: RobotStatusMsg, now: float) -> None:
        """Update the board with a status of this process."""
        entry = self._entry(msg.handle, now)
        if entry is None:
            return
        stamp = rfc3339(msg.unix_us)
        content = (msg.status, msg.detail)
        if self._seen.get(msg.handle) != content:
            self._seen[msg.handle] = content
            self._change(entry, members(msg.handle, *content), stamp, now)
        entry.stamp, entry.at = stamp, now
        entry.heartbeat_age = None if msg.heartbeat_age is None else round(max(0.0, msg.heartbeat_age), 3)

    def update_line(self, handle: str, line: JsonMapping, now: float, last: JsonMapping | None = None) -> None:
        """Update the board with a parsed line of another process. `handle` replaces the handle in the line.

        `last` is the last line with a connected link, if the board may not have seen it.
        """
        entry = self._entry(handle, now)
        if entry is None:
            return
        if entry.last is None:
            entry.last = last
        stamp = str(line.get("stamp", ""))
        link = line.get("link")
        link = link if isinstance(link, dict) else {}
        rest = {key: value for key, value in line.items() if key not in ("stamp", "seq")}
        rest["handle"] = handle
        rest["link"] = {key: value for key, value in link.items() if key != "heartbeat_age"}
        if rest != entry.line:
            self._change(entry, rest, stamp, now)
        entry.stamp, entry.at, entry.heartbeat_age = stamp, now, link.get("heartbeat_age")

    def forget(self, handle: str) -> None:
        """Remove the entry of a handle that is gone."""
        self._seen.pop(handle, None)
        if self.entries.pop(handle, None) is not None:
            self.version += 1
            self.alarms.forget(handle, self.version)

    def acknowledge(self, handle: str | None, now: Instant) -> None:
        """A person has seen the alarms of one robot, or of all."""
        if self.alarms.acknowledge(handle, rfc3339(now.unix_us), self.version + 1):
            self.version += 1

    def members(self, line: JsonMapping) -> dict[str, Entry]:
        """The entries of the members of a group, as far as there are any; of a single robot empty."""
        names = line.get("members")
        if not isinstance(names, list):
            return {}
        return {n: self.entries[n] for n in names[:MOST_MEMBERS] if isinstance(n, str) and n in self.entries}

    def _nested(self, ordered: list[Entry]) -> Iterator[Entry]:
        for entry in ordered:
            if isinstance(entry.line.get("members"), list) and entry.line["members"]:
                yield entry
                yield from self.members(entry.line).values()
        yield from ordered

    def _entry(self, handle: str, now: float) -> Entry | None:
        entry = self.entries.get(handle)
        if entry is None:
            if len(self.entries) >= MOST_HANDLES:
                self.refused += 1
                return None
            entry = self.entries[handle] = Entry(now)
        entry.lines += 1
        return entry

    def _change(self, entry: Entry, line: JsonMapping, stamp: str, now: float) -> None:
        known = entry.line
        if not _is_connected(known):
            known = entry.last or known
        elif not _is_connected(line):
            entry.last = entry.whole()
        for name, value, before in (*_changes(entry.line, line), *_cause_changes(known, line)):
            entry.keep(Transition(now, stamp, name, value, before))
        entry.line = line
        self.version += 1
        entry.version = self.version
        self.alarms.take(str(line["handle"]), line, stamp, self.version)


class BoardPublisher(Publisher):
    """Puts statuses on its board, for a view in the same process."""

    periodic = True
    options_type = Options

    def __init__(self, context: PublisherContext) -> None:
        """Raises UsageError for an option: there are none."""
        Options.read("board", context.options)
        self.board = Board()
        self.lock = threading.Lock()
        """The lock of the board. Another thread must hold it to read the board."""
        self._waiting: list[RobotStatusMsg] = []

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hold the message until `service`, which follows every round of updates."""
        self._waiting.append(msg)

    def service(self, now: Instant) -> None:
        """Put the held messages on the board."""
        if self._waiting:
            with self.lock:
                for msg in self._waiting:
                    self.board.update(msg, now.mono)
            self._waiting.clear()

    def forget(self, handle: str) -> None:
        """Remove a handle that is gone from the board."""
        with self.lock:
            self.board.forget(handle)


def _at(transition: Transition) -> float:
    return transition.at


def _order(entry: Entry) -> tuple[bool, int, int, str]:
    system, component = entry.line.get("system"), entry.line.get("component")
    known = isinstance(system, int)
    number = component if isinstance(component, int) else 0
    return not known, system if isinstance(system, int) else 0, number, str(entry.line.get("handle", ""))


def _changes(before: JsonMapping, after: JsonMapping) -> Iterator[tuple[str, object, object]]:
    for name in (field.name for field in STATES):
        if before.get(name, before) != after.get(name):
            yield name, after.get(name), before.get(name)
    for group, name in (("vehicle", "flight_mode"), ("link", "state")):
        value, old_value = _member(after, group, name), _member(before, group, name)
        if not before or old_value != value:
            yield group if group == "link" else name, value, old_value


def _cause_changes(before: JsonMapping, after: JsonMapping) -> Iterator[tuple[str, object, None]]:
    """Errors and inhibits that begin or end since `before`, the last line with a connected link.

    Nobody knows whether a cause ends while its robot, or its member of a group, is not heard.
    """
    if not _is_connected(after):
        return
    unheard = {member for name, member in _causes(after, "inhibits") if name == UNHEARD}
    for group, one in (("errors", "error"), ("inhibits", "inhibit")):
        old, new = _causes(before, group), _causes(after, group)
        for cause in old:
            if cause not in new and cause[1] not in unheard:
                yield one, {**old[cause], "begins": False}, None
        for cause in new:
            if cause not in old:
                yield one, {**new[cause], "begins": True}, None


def _is_connected(line: JsonMapping) -> bool:
    return bool(_member(line, "link", "state") == "CONNECTED")


def _member(line: JsonMapping, group: str, name: str) -> object:
    members = line.get(group)
    return members.get(name) if isinstance(members, dict) else None


def _causes(line: JsonMapping, group: str) -> dict[tuple[str, str], JsonObject]:
    """The causes by name and, in a group, by the member that reports them."""
    causes = line.get(group)
    if not isinstance(causes, list):
        return {}
    found: dict[tuple[str, str], JsonObject] = {}
    for cause in causes:  # if several have the same name, the text of the first is shown
        if isinstance(cause, dict):
            member = {"handle": cause["handle"]} if "handle" in cause else {}
            shown = {"name": cause.get("name"), "text": cause.get("text"), **member}
            found.setdefault((str(cause.get("name")), str(cause.get("handle"))), shown)
    return found
