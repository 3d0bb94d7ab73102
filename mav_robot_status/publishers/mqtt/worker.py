"""The thread that publishes statuses and events. The gateway's thread waits for the journal only."""

from __future__ import annotations

import contextlib
import logging
import threading
from collections import Counter, deque
from collections.abc import Callable
from typing import Final

from ...clock import Instant
from ...errors import LinkError
from ...interface import RobotStatusMsg
from ..error_reporter import ErrorReporter
from .journal import Journal
from .lines import line_of
from .loop import Loop
from .robot import Robot
from .settings import MqttSettings
from .spool import Event, Spool

log = logging.getLogger(__name__)

MOST_HANDED: Final = 10_000
"""Events that may wait for the thread. They wait only while the disk hangs."""
PARTING: Final = 1.0
"""Seconds for the remaining events, and then for the state OFFLINE, at the end."""
CLOSING: Final = 5.0  # s to wait for the thread


class Worker:
    """The gateway's thread calls `add` and `hand_over`."""

    def __init__(self, settings: MqttSettings, clock: Callable[[], Instant]) -> None:
        """Open the spool and the journal. Raises LinkError if that fails."""
        self._settings, self._clock = settings, clock
        self._spool = Spool(settings.spool, settings.spool_size, settings.spool_age)
        try:
            self._journal = Journal(f"{settings.spool}-new", self._spool.last)
        except LinkError:
            self._spool.close(0.0, 0.0)
            raise
        for event in self._journal.left:
            self._spool.add(event)
        self._place = self._journal.place
        self._loop = Loop(clock)
        self._errors = ErrorReporter("mqtt", settings.broker.name)
        self._robots: dict[str, Robot] = {}
        self._lock = threading.Lock()
        self._latest: dict[str, RobotStatusMsg] = {}
        self._events: deque[Event] = deque()
        self._lost: Counter[str] = Counter()
        """Events of each robot that exceeded MOST_HANDED."""
        self._lines: Counter[str] = Counter()
        self._gone: list[str] = []
        """Robots that have gone since the thread last looked."""
        self._leaving: dict[str, Robot] = {}
        """Robots whose last publications wait for the broker."""
        self.waiting = self.dropped = 0
        """Events that wait now, and events dropped since the spool was created. Other threads read both."""
        self._stop = False
        self._thread = threading.Thread(target=self._run, name="mqtt", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def add(self, robot: str, text: str, at: float) -> None:
        """Add an event; `at`: its Unix time. It is on disk when this returns, unless the journal waited LONGEST."""
        self._place += 1
        event = Event(self._place, robot, at, text)
        self._journal.append(event)
        with self._lock:
            self._events.append(event)
            if len(self._events) > MOST_HANDED:
                self._lost[self._events.popleft().robot] += 1

    def hand_over(self, statuses: dict[str, RobotStatusMsg]) -> None:
        """Hand over the newest status of each robot, and wake the thread, which also takes the added events."""
        with self._lock:
            self._latest.update(statuses)
        self._loop.wake()

    def forget(self, robot: str) -> None:
        """Publish OFFLINE for a robot that is gone, and close its connection. Its waiting events stay on disk."""
        with self._lock:
            self._latest.pop(robot, None)
            self._gone.append(robot)
        self._loop.wake()

    def close(self) -> None:
        """Publish OFFLINE, write waiting events, end the thread."""
        self._stop = True
        self._loop.wake()
        self._thread.join(CLOSING)

    def _run(self) -> None:
        try:
            for name in self._spool.robots():
                self._robot(name)
            while not self._stop:
                self._loop.turn()
                self._take()
            self._part()
        except Exception:  # a bug here must not stop the gateway
            log.exception("mqtt: the output has failed and is stopped; everything else continues")
        finally:
            now = self._clock()
            for robot in (*self._robots.values(), *self._leaving.values()):
                robot.connection.close()
            with contextlib.suppress(Exception):
                self._spool.close(now.mono, now.unix_us / 1e6)
            self._journal.close()
            self._loop.close()

    def _take(self) -> None:
        """Write to disk first, then publish."""
        with self._lock:
            latest, self._latest = self._latest, {}
            events, self._events = self._events, deque()
            lost, self._lost = self._lost, Counter()
            gone, self._gone = self._gone, []
        for name, count in lost.items():
            self._spool.count_dropped(name, count)
        for event in events:
            self._spool.add(event)
        self._flush()
        self.waiting, self.dropped = self._spool.waiting, sum(self._spool.dropped.values())
        self._let_go(gone)
        for name, msg in latest.items():
            self._robot(name).publish(line_of(msg, self._lines[name]))
            self._lines[name] += 1
        fresh = {event.robot for event in events}
        for name in fresh:
            self._robot(name).pump(news=True)
        for name in fresh | latest.keys():
            self._loop.watch(self._robots[name].connection)

    def _let_go(self, gone: list[str]) -> None:
        """Publish OFFLINE for these robots; close the connections of those that have nothing left to say."""
        for name in gone:
            robot = self._robots.pop(name, None)
            self._lines.pop(name, None)
            if robot is not None:
                robot.pump(news=True)
                robot.leave(self._clock())
                self._loop.watch(robot.connection)
                self._leaving[name] = robot
        for name, robot in list(self._leaving.items()):
            if robot.settled:
                robot.connection.leave()
                robot.connection.close()
                self._loop.remove(robot.connection)
                del self._leaving[name]

    def _robot(self, name: str) -> Robot:
        robot = self._robots.get(name)
        if robot is None:
            robot = self._robots[name] = Robot(name, self._settings.broker, self._spool, self._errors)
            self._loop.add(robot.connection)
        return robot

    def _part(self) -> None:
        """Deliver the remaining events within PARTING, then publish OFFLINE."""
        self._take()
        deadline = self._clock().mono + PARTING
        self._until_settled(deadline)
        for robot in self._robots.values():
            robot.leave(self._clock())
            self._loop.watch(robot.connection)
        self._until_settled(deadline + PARTING)
        for robot in self._robots.values():
            if robot.settled:  # otherwise OFFLINE has not arrived, and the will of the connection has to say it
                robot.connection.leave()

    def _until_settled(self, deadline: float) -> None:
        while (left := deadline - self._clock().mono) > 0 and not all(r.settled for r in self._robots.values()):
            self._loop.turn(min(left, 0.1))
        self._flush()

    def _flush(self) -> None:
        now = self._clock()
        self._spool.flush(now.mono, now.unix_us / 1e6)
        self._journal.forget(self._spool.settled)
