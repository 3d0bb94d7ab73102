"""The thread that brings statuses and events to the broker. The gateway hands over, and never waits for it."""

from __future__ import annotations

import contextlib
import json
import logging
import threading
from collections import Counter, deque
from typing import TYPE_CHECKING, Final, NamedTuple

from .complaints import Complaints
from .lines import event_of, line_of
from .loop import Loop
from .robot import Robot
from .spool import Spool

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...clock import Instant
    from ...interface import Detail, RobotStatus, RobotStatusMsg
    from .options import MqttOptions

log = logging.getLogger(__name__)

MOST_HANDED: Final = 10_000
"""Events that wait for the thread, which takes them at once unless the disk hangs."""
PARTING: Final = 1.0
"""Seconds that the rest of the events, and then the good-bye, may take at the end."""
CLOSING: Final = 5.0  # s to wait for the thread


class Change(NamedTuple):
    """One change of one robot's status, not yet an event."""

    robot: str
    seq: int
    msg: RobotStatusMsg
    before: tuple[RobotStatus, Detail] | None


class Courier:
    """`tell` and `change` are for the gateway's thread, and take microseconds."""

    def __init__(self, options: MqttOptions, session: str, clock: Callable[[], Instant]) -> None:
        """Open the spool. Raises LinkError if that cannot be."""
        self._options, self._session, self._clock = options, session, clock
        self._spool = Spool(options.spool, options.spool_size, options.spool_age)
        self._loop = Loop(clock)
        self._complaints = Complaints(options.broker)
        self._robots: dict[str, Robot] = {}
        self._lock = threading.Lock()
        self._latest: dict[str, RobotStatusMsg] = {}
        self._changes: deque[Change] = deque()
        self._lost: Counter[str] = Counter()
        """Changes for which the thread had no time, by robot."""
        self._lines: Counter[str] = Counter()
        self.waiting = self.dropped = 0
        """Events of now, and ever since the spool was made. Read from other threads."""
        self._stop = False
        self._thread = threading.Thread(target=self._run, name="mqtt", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def hand_over(self, statuses: dict[str, RobotStatusMsg], changes: list[Change]) -> None:
        """The newest status of each robot, and what has changed since the last call."""
        with self._lock:
            self._latest.update(statuses)
            self._changes.extend(changes)
            while len(self._changes) > MOST_HANDED:
                self._lost[self._changes.popleft().robot] += 1
        self._loop.wake()

    def close(self) -> None:
        """Say good-bye, write what waits, end."""
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
        except Exception:  # a fault of ours: the gateway goes on without
            log.exception("mqtt: the output has failed and is stopped; everything else goes on")
        finally:
            now = self._clock()
            for robot in self._robots.values():
                robot.connection.close()
            with contextlib.suppress(Exception):
                self._spool.close(now.mono, now.unix_us / 1e6)
            self._loop.close()

    def _take(self) -> None:
        """To disk first, then to the broker."""
        with self._lock:
            latest, self._latest = self._latest, {}
            changes, self._changes = self._changes, deque()
            lost, self._lost = self._lost, Counter()
        for name, count in lost.items():
            self._spool.count_dropped(name, count)
        for change in changes:
            event = event_of(change.msg, change.before, change.robot, self._session, change.seq)
            self._spool.add(change.robot, json.dumps(event), change.msg.unix_us / 1e6)
        now = self._clock()
        self._spool.flush(now.mono, now.unix_us / 1e6)
        self.waiting, self.dropped = self._spool.waiting, sum(self._spool.dropped.values())
        for name, msg in latest.items():
            self._robot(name).tell(line_of(msg, self._lines[name]))
            self._lines[name] += 1
        fresh = {change.robot for change in changes}
        for name in fresh:
            self._robot(name).pump(news=True)
        for name in fresh | latest.keys():
            self._loop.watch(self._robots[name].connection)

    def _robot(self, name: str) -> Robot:
        robot = self._robots.get(name)
        if robot is None:
            robot = self._robots[name] = Robot(name, self._options.broker, self._spool, self._complaints)
            self._loop.add(robot.connection)
        return robot

    def _part(self) -> None:
        """Deliver what is left, if that goes quickly; then tell that nothing more will come."""
        self._take()
        deadline = self._clock().mono + PARTING
        self._until_settled(deadline)
        for robot in self._robots.values():
            robot.leave(self._clock())
            self._loop.watch(robot.connection)
        self._until_settled(deadline + PARTING)
        for robot in self._robots.values():
            robot.connection.leave()

    def _until_settled(self, deadline: float) -> None:
        while (left := deadline - self._clock().mono) > 0 and not all(r.settled for r in self._robots.values()):
            self._loop.turn(min(left, 0.1))
        now = self._clock()
        self._spool.flush(now.mono, now.unix_us / 1e6)
