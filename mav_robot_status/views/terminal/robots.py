"""The robots of a view as values: their names, headlines, counts and order."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Final, NamedTuple, Protocol

from ...clock import Instant, rfc3339
from ...interface import DEFAULT_HANDLE_NAME
from ...json_object import JsonMapping
from ...language import Headline, Look, headline, look
from ...language.states import ARMED


class Row(Protocol):
    """One robot of a source."""

    @property
    def line(self) -> JsonMapping:
        """Its status: the members of a native JSON line."""

    @property
    def stamp(self) -> str:
        """The time of the status, RFC 3339."""

    @property
    def version(self) -> int:
        """A number that differs after every change."""

    @property
    def age(self) -> float | None:
        """Seconds since it was last heard; None if it never was."""

    @property
    def rates(self) -> Mapping[str, float]:
        """The rate (Hz) of each message that its status depends on, by name."""


class Change(Protocol):
    """A change of one member of a status."""

    @property
    def stamp(self) -> str:
        """RFC 3339."""

    @property
    def name(self) -> str:
        """A field, `flight_mode`, `link`, `error` or `inhibit`."""

    @property
    def value(self) -> object:
        """The new value; of an error or inhibit its `name`, `text` and whether it `begins`."""

    @property
    def before(self) -> object:
        """The previous value; None also for UNKNOWN."""


class Source(Protocol):
    """The source of the statuses."""

    connection: str
    """The connection, as on the command line."""
    advice: str
    """A remedy, shown until the first robot is heard."""
    explained: str
    """The handle to explain; empty: none."""

    @property
    def version(self) -> int:
        """A number that differs after every change of any robot."""

    def now(self) -> Instant:
        """The current time."""

    def wait(self, seconds: float) -> bool:
        """Wait; return whether the source ends within these seconds."""

    def rows(self) -> Sequence[Row]:
        """The robots."""

    def changes(self, handles: Sequence[str], most: int) -> Sequence[tuple[str, Change]]:
        """The changes of these robots, each with its handle, the latest first."""

    def explanation(self) -> JsonMapping | None:
        """The latest explanation of the handle `explained`."""


class Robot(NamedTuple):
    """One robot, as a view shows it."""

    row: Row
    name: str
    headline: Headline
    group: str = ""
    """The handle of the group of which it is a member; empty: none."""

    @property
    def line(self) -> JsonMapping:
        """Its status."""
        return self.row.line

    @property
    def handle(self) -> str:
        """The name of its handle."""
        return str(self.line["handle"])

    @property
    def link(self) -> str:
        """The state of its link."""
        return str(self.line["link"]["state"])

    @property
    def has_problem(self) -> bool:
        """Whether it is stopped, in error or not heard, or needs a person."""
        return self.headline.rank < ARMED.rank


class Memory:
    """Makes robots of rows. It remembers what each was before its link was lost. Bounded by the rows of the source."""

    def __init__(self) -> None:
        self._heard: dict[str, JsonMapping] = {}
        self._headlines: dict[str, tuple[tuple[int, ...], Headline]] = {}

    def robots(self, rows: Iterable[Row], now: Instant) -> list[Robot]:
        """The robots of these rows, in their order."""
        by_handle = {str(row.line["handle"]): row for row in rows}
        heard = self._heard | {h: r.line for h, r in by_handle.items() if r.line["link"]["state"] == "CONNECTED"}
        self._heard = {handle: line for handle, line in heard.items() if handle in by_handle}
        groups = {m: handle for handle, row in by_handle.items() for m in row.line.get("members", ())}
        self._headlines = {
            h: self._headline(h, row, now, {m: by_handle[m] for m in row.line.get("members", ()) if m in by_handle})
            for h, row in by_handle.items()
        }
        return [
            Robot(row, _name(row.line, handle in groups), self._headlines[handle][1], groups.get(handle, ""))
            for handle, row in by_handle.items()
        ]

    def _headline(
        self, handle: str, row: Row, now: Instant, members: Mapping[str, Row]
    ) -> tuple[tuple[int, ...], Headline]:
        known = self._headlines.get(handle)
        versions = row.version, *(member.version for member in members.values())
        if known is not None and known[0] == versions:
            return known
        whole = {**row.line, "stamp": rfc3339(now.unix_us), "link": {**row.line["link"], "heartbeat_age": row.age}}
        lines = {name: member.line for name, member in members.items()}
        return versions, headline(whole, self._heard.get(handle), lines)


def _name(line: JsonMapping, is_member: bool) -> str:
    """What people call it, else `1.1`, else its handle. A member of a group has the handle by which the group names it.

    A default handle says nothing: its robot keeps its ids.
    """
    system, component, handle = line["system"], line["component"], str(line["handle"])
    if given := line["vehicle"].get("name"):
        return str(given)
    if system is None or line.get("members") or (is_member and not handle.startswith(DEFAULT_HANDLE_NAME)):
        return handle
    return f"{system}" if component is None else f"{system}.{component}"


class Filter(NamedTuple):
    """A count of robots, and the robots that it counts."""

    word: str
    key: str
    """Its key on the keyboard."""
    look: Look
    takes: Callable[[Robot], bool]


FILTERS: Final = (
    Filter("in error", "1", look("in_error", True), lambda robot: robot.line["in_error"] is True),
    Filter("e-stopped", "2", look("e_stopped", True), lambda robot: robot.line["e_stopped"] is True),
    Filter("not heard", "3", look("link", "LOST"), lambda robot: robot.link != "CONNECTED"),
    Filter("can move", "4", look("motion_possible", True), lambda robot: robot.line["motion_possible"] is True),
)


def counts(robots: Iterable[Robot]) -> tuple[int, dict[str, int]]:
    """The number of robots, and of those that each filter takes. A group is not counted in addition to its members."""
    single = [robot for robot in robots if not robot.line.get("members")]
    return len(single), {one.word: sum(map(one.takes, single)) for one in FILTERS}


def matches(robot: Robot, search: str) -> bool:
    """Whether a robot has the searched text anywhere in its name, kind, mode, headline or reasons."""
    causes = [cause[key] for what in ("errors", "inhibits") for cause in robot.line[what] for key in ("name", "text")]
    texts = (robot.name, robot.handle, *robot.line["vehicle"].values(), robot.headline.word, *causes)
    return search.casefold() in " ".join(str(text) for text in texts if text is not None).casefold()


Order = Callable[[Robot], Any]
"""The key of a robot in an order."""


def by_name(robot: Robot) -> Any:
    """Numbers in a name count as numbers."""
    return [(part.isdigit(), int(part) if part.isdigit() else 0, part) for part in re.split(r"([0-9]+)", robot.name)]


def by_urgency(robot: Robot) -> Any:
    """The worst first, then by name."""
    return robot.headline.rank, by_name(robot)


def in_order(robots: Iterable[Robot], order: Order = by_urgency, reverse: bool = False) -> list[Robot]:
    """The robots in an order; each group with its members below it, at the place of the worst of them."""
    robots = list(robots)
    there = {robot.handle for robot in robots}
    families: dict[str, list[Robot]] = {}
    for robot in robots:
        families.setdefault(robot.group if robot.group in there else robot.handle, []).append(robot)
    for handle, family in families.items():
        family.sort(key=lambda robot: robot.handle != handle)
    first = min if not reverse else max
    heads = sorted(families.values(), key=lambda family: by_name(family[0]))
    heads.sort(key=lambda family: first(map(order, family)), reverse=reverse)
    return [robot for family in heads for robot in family]
