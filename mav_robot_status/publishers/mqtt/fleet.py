"""The topics of all robots, as lines for a board. A status counts only while its robot is online and publishes.

A status is live while its robot's connection is ONLINE and statuses arrive: at least two that differ, the later one
within the keep-alive. A retained status, or an old one from a bridge or a restarted broker, is therefore never shown
as current. This does not depend on any clock of a peer. No I/O.
"""

from __future__ import annotations

import json
import math
from typing import Final

from ...clock import Instant, rfc3339
from ...json_object import JsonObject
from .lines import unknown
from .robot import BROKEN, OFFLINE, ONLINE

MOST_ROBOTS: Final = 4096
LONGEST: Final = 65_536  # bytes of a status or an event
WHY: Final = {
    ONLINE: "the gateway publishes nothing new",
    OFFLINE: "the gateway was stopped",
    BROKEN: "the gateway is gone",
}
NOT_ONLINE: Final = "no gateway is online"


class _Robot:
    """The state of one robot."""

    __slots__ = ("at", "last", "line", "live", "mark", "session", "seq", "state")  # noqa: RUF023

    def __init__(self) -> None:
        self.state = ""
        """The state of its connection."""
        self.line: JsonObject = {}
        self.last: JsonObject | None = None
        """The latest status with a connected link."""
        self.mark: tuple[object, object] = (None, None)
        """Stamp and seq of the latest status."""
        self.at = -math.inf
        """When (monotonic seconds) that status arrived."""
        self.live = False
        """Whether its status is shown as current."""
        self.session, self.seq = "", 0
        """Session and number of its last event."""


class Fleet:
    """All robots under a topic prefix."""

    def __init__(self, prefix: str, keepalive: float) -> None:
        self._start = f"{prefix}/"
        self._keepalive = keepalive
        self._robots: dict[str, _Robot] = {}
        self._news: dict[str, JsonObject] = {}
        self.events = self.duplicates = self.missing = self.refused = 0
        """Events received, received twice, and skipped by a later one; messages that are not valid."""

    def topics(self) -> list[tuple[str, int]]:
        """The topics to subscribe to, each with its quality of service."""
        return [(f"{self._start}+/connection", 1), (f"{self._start}+/status", 0), (f"{self._start}+/events", 1)]

    def begin(self) -> None:
        """The connection is open again. Events published meanwhile do not count as missing."""
        for robot in self._robots.values():
            robot.session = ""

    def doubt(self, now: Instant) -> None:
        """Nothing that was received is known to be current: every robot is unknown until two statuses arrive."""
        for name, robot in self._robots.items():
            robot.at, robot.state = -math.inf, ""
            self._mark_unknown(name, robot, now)

    def take(self, topic: str, payload: bytes, retained: bool, now: Instant) -> None:
        """Read one message. Its content may be anything."""
        name, _, what = topic[len(self._start) :].partition("/")
        if not topic.startswith(self._start) or len(payload) > LONGEST or not self._known(name):
            self.refused += 1
        elif what == "connection":
            self._connection(name, payload.decode("ascii", "replace"), now)
        elif what == "status":
            self._status(name, payload, retained, now)
        elif what == "events" and not retained:
            self._event(name, payload)

    def news(self) -> dict[str, JsonObject]:
        """The lines that changed since the last call, by robot."""
        news, self._news = self._news, {}
        return news

    def last(self, name: str) -> JsonObject | None:
        """The latest status of a robot with a connected link, retained or not: its last known state."""
        robot = self._robots.get(name)
        return None if robot is None else robot.last

    def expire(self, now: Instant) -> None:
        """Mark robots without a new status within the keep-alive as unknown. Call this about once a second."""
        for name, robot in self._robots.items():
            if robot.live and now.mono - robot.at > self._keepalive:
                self._mark_unknown(name, robot, now)

    def _known(self, name: str) -> bool:
        if name not in self._robots and len(self._robots) < MOST_ROBOTS:
            self._robots[name] = _Robot()
        return name in self._robots

    def _connection(self, name: str, state: str, now: Instant) -> None:
        robot = self._robots[name]
        robot.state = state if state in WHY else ""
        if robot.state != ONLINE:
            robot.at = -math.inf
            self._mark_unknown(name, robot, now)
        elif not robot.live:
            self._mark_unknown(name, robot, now)

    def _status(self, name: str, payload: bytes, retained: bool, now: Instant) -> None:
        robot = self._robots[name]
        line = _parsed(payload) if payload else {}
        if line is None:
            self.refused += 1
            return
        mark = (line.get("stamp"), line.get("seq"))
        if mark == robot.mark:
            return
        renewed = bool(line) and not retained and now.mono - robot.at <= self._keepalive
        robot.mark, robot.line, robot.at = mark, line or robot.line, now.mono
        if line and line["link"].get("state") == "CONNECTED":
            robot.last = line
        if renewed and robot.state == ONLINE:
            robot.live = True
            self._news[name] = {**line, "handle": name}
        else:
            self._mark_unknown(name, robot, now)

    def _event(self, name: str, payload: bytes) -> None:
        robot = self._robots[name]
        event = _object(payload)
        session, seq = (event or {}).get("session"), (event or {}).get("seq")
        if not isinstance(session, str) or type(seq) is not int:
            self.refused += 1
            return
        if session == robot.session and seq <= robot.seq:
            self.duplicates += 1
            return
        self.events += 1
        if session == robot.session:
            self.missing += seq - robot.seq - 1
        robot.session, robot.seq = session, seq

    def _mark_unknown(self, name: str, robot: _Robot, now: Instant) -> None:
        robot.live = False
        line = unknown(robot.line, rfc3339(now.unix_us), WHY.get(robot.state, NOT_ONLINE))
        self._news[name] = {**line, "handle": name}


def _parsed(payload: bytes) -> JsonObject | None:
    """A native line in which the members that readers rely on have the right types; None for anything else."""
    line = _object(payload)
    if line is None:
        return None
    link, vehicle = line.get("link"), line.get("vehicle")
    fine = (
        isinstance(line.get("stamp"), str)
        and isinstance(link, dict)
        and isinstance(vehicle, dict)
        and type(link.get("heartbeat_age")) in (int, float, type(None))
        and all(type(line.get(name)) in (int, type(None)) for name in ("system", "component", "seq"))
        and all(
            isinstance(line.get(group), list) and all(isinstance(cause, dict) for cause in line[group])
            for group in ("errors", "inhibits")
        )
    )
    return line if fine else None


def _finite(text: str) -> float:
    """JSON in a browser has finite numbers only."""
    if not math.isfinite(number := float(text)):
        raise ValueError(text)
    return number


def _object(payload: bytes) -> JsonObject | None:
    try:
        found = json.loads(payload, parse_float=_finite, parse_constant=_finite)
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None
