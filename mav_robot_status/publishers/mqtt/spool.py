"""Undelivered events on disk: in order, with limits on size and age. Dropped events are counted.

SQLite with a write-ahead log: a committed event survives a kill of the process. A power failure may lose the last
moments (synchronous=NORMAL; FULL would sync the disk for each event). While the disk is full or fails, events wait in
memory and are written later. A damaged file is set aside, and what waited in it is lost: new events matter more.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import sqlite3
from collections import Counter, deque
from collections.abc import Iterable, Iterator
from typing import Any, Final, NamedTuple

from ...errors import LinkError
from .naming import level
from .spool_file import DEFECT, FULL, MEMORY, connect, is_damaged, says, set_aside

log = logging.getLogger(__name__)

MOST_UNWRITTEN: Final = 10_000
"""Events that wait in memory while the disk is full."""
RETRY: Final = 1.0  # s until the next attempt after a write failed
SWEEP: Final = 10.0  # s between two checks for old events
CLOCK_SET: Final = 1_500_000_000.0
"""Unix seconds (2017). An earlier stamp comes from a clock that was not set, and gives no age."""
OVERHEAD: Final = 64  # bytes of an event besides its text
LOG_INTERVAL: Final = 60.0  # s between two log messages about dropped events
MOST_REPLACED: Final = 5
"""Damaged files that one process replaces. After that its events wait in memory."""
MOST_PLACE: Final = 1 << 62
Row = tuple[Any, ...]


class Event(NamedTuple):
    """One undelivered event."""

    place: int
    """The event's number in the spool. It rises with every event and is never used again."""
    robot: str
    at: float
    """Unix seconds."""
    text: str


class Spool:
    """All undelivered events of one gateway. Only one thread may use it."""

    def __init__(self, path: str, most_bytes: int, oldest: float) -> None:
        """Open or create the file. Raises LinkError if that is not permitted, or if another gateway has it open."""
        self._path, self._most, self._oldest = path, most_bytes, oldest
        self._unwritten: deque[Event] = deque()
        self._finished: dict[int, Event] = {}
        self.last = self._place = 0
        """The places of the last event written, and of the last event added."""
        self._held: Counter[str] = Counter()
        """The number of events on disk, by robot."""
        self._bytes = 0
        """The bytes of the events on disk."""
        self.dropped: Counter[str] = Counter()
        """Dropped events of each robot since the file was created."""
        self._newly: set[str] = set()
        """Robots whose count of dropped events is not written yet."""
        self._replaced = 0
        self._in_memory = False
        """Whether there is no file."""
        self._retry_at = self._swept_at = self._logged_at = -math.inf
        self._offset: float | None = None
        """Unix time minus monotonic time at the first `flush`."""
        self.failed = False
        """Whether the last write failed."""
        self._db: sqlite3.Connection
        self._open()
        self._first = self._place
        """The events beyond this place are of this process."""
        self._logged = sum(self.dropped.values())

    def robots(self) -> list[str]:
        """The robots with waiting events."""
        written = (robot for robot, count in self._held.items() if count > 0)
        return list(dict.fromkeys([*written, *(event.robot for event in self._unwritten)]))

    @property
    def settled(self) -> int:
        """The place up to which every event is on the disk, delivered or dropped."""
        if self._in_memory:
            return self.last
        return self._unwritten[0].place - 1 if self._unwritten else self._place

    @property
    def waiting(self) -> int:
        """The number of events that wait."""
        return max(0, sum(self._held.values()) + len(self._unwritten) - len(self._finished))

    def add(self, event: Event) -> None:
        """Add an event with a place beyond all others. `flush` writes it."""
        self._place = event.place
        self._unwritten.append(event)
        if len(self._unwritten) > MOST_UNWRITTEN:
            self._drop(self._unwritten.popleft().robot)

    def count_dropped(self, robot: str, count: int) -> None:
        """Count events of a robot that were dropped before they reached the spool."""
        self._drop(robot, count)

    def after(self, robot: str, place: int, limit: int) -> list[Event]:
        """The oldest events of a robot beyond a place, at most `limit`."""
        query = "SELECT place, robot, at, text FROM events WHERE robot = ? AND place > ? ORDER BY place LIMIT ?"
        rows = self._select(query, robot, place, limit + len(self._finished))
        in_memory = (event for event in self._unwritten if event.robot == robot and event.place > place)
        return [event for event in (*rows, *in_memory) if event.place not in self._finished][:limit]

    def done(self, event: Event) -> None:
        """An event is delivered. `flush` deletes it."""
        self._finished[event.place] = event

    def flush(self, now: float, unix: float) -> None:
        """Write new events, delete delivered ones, enforce the limits. `now` is monotonic seconds."""
        if now < self._retry_at:
            return
        if now - self._swept_at >= SWEEP:
            self._swept_at = now
            self._sweep(now, unix)
        if not (self._unwritten or self._finished or self._newly):
            return
        delivered = [event for event in self._unwritten if event.place in self._finished]
        for event in delivered:  # from memory, while the disk was full
            self._unwritten.remove(event)
            del self._finished[event.place]
        with self._report_failure(now):
            with self._db:
                self._db.execute("BEGIN")
                self._write()
            self.last = self.last if self._in_memory else self._place
            self._unwritten.clear()
            self._finished.clear()
            self._newly.clear()
        self._log_dropped(now)

    def close(self, now: float, unix: float) -> None:
        """Write the rest, log how many events wait, close the file."""
        self._retry_at = -math.inf
        for _ in range(2):  # the second time after a damaged file was replaced
            self.flush(now, unix)
        with contextlib.suppress(sqlite3.Error):
            if self.waiting:
                log.warning("mqtt: %d events are undelivered; they wait in %s", self.waiting, self._path)
        self._db.close()

    def _write(self) -> None:
        for event in self._finished.values():
            self._delete(event)  # unless it was dropped before
        self._db.executemany("INSERT INTO events VALUES (?, ?, ?, ?)", self._unwritten)
        self._db.execute("INSERT OR REPLACE INTO last VALUES (0, ?)", (self._place,))
        self._held.update(event.robot for event in self._unwritten)
        self._bytes += sum(_cost(event) for event in self._unwritten)
        while self._bytes > self._most:
            oldest = _events(self._db.execute("SELECT place, robot, at, text FROM events ORDER BY place LIMIT 1"))
            if not oldest or not self._delete(oldest[0]):
                raise sqlite3.DatabaseError("events are missing")
            self._drop(oldest[0].robot)
        counts = [(robot, self.dropped[robot]) for robot in self._newly]
        self._db.executemany("INSERT OR REPLACE INTO dropped VALUES (?, ?)", counts)

    def _delete(self, event: Event) -> bool:
        if not self._db.execute("DELETE FROM events WHERE place = ?", (event.place,)).rowcount:
            return False
        self._held[event.robot] -= 1
        self._bytes -= _cost(event)
        return True

    def _select(self, query: str, *values: object) -> list[Event]:
        """The events of a query. A damaged file has none, and is replaced."""
        try:
            return _events(self._db.execute(query, values))
        except sqlite3.Error as error:
            self._replace(error)
            return []

    def _sweep(self, now: float, unix: float) -> None:
        """Drop events that are too old. A clock that was set since does not age those of this process."""
        if self._offset is None:
            self._offset = unix - now
        is_set = max(0.0, unix - now - self._offset)
        query = "SELECT place, robot, at, text FROM events WHERE at BETWEEN ? AND ?"
        for event in self._select(query, CLOCK_SET, unix - self._oldest):
            is_old = event.place <= self._first or unix - is_set - event.at > self._oldest
            if is_old and event.place not in self._finished:
                self._finished[event.place] = event
                self._drop(event.robot)

    def _drop(self, robot: str, count: int = 1) -> None:
        self.dropped[robot] += count
        self._newly.add(robot)

    def _log_dropped(self, now: float) -> None:
        total = sum(self.dropped.values())
        if total > self._logged and now - self._logged_at >= LOG_INTERVAL:
            log.warning("mqtt: %d events were dropped so far: the spool was full, or they were too old", total)
            self._logged, self._logged_at = total, now

    @contextlib.contextmanager
    def _report_failure(self, now: float) -> Iterator[None]:
        before = self.dropped.copy(), self._newly.copy(), self._held.copy(), self._bytes
        try:
            yield
        except sqlite3.Error as error:
            self.dropped, self._newly, self._held, self._bytes = before
            if is_damaged(self._path, error):
                self._replace(error)  # the next call writes what waits in memory
                return
            self._retry_at = now + RETRY
            if not self.failed:
                log.warning(
                    "mqtt: cannot write events to %s (%s); they wait in memory, trying again", self._path, error
                )
            self.failed = True
        else:
            if self.failed:
                log.warning("mqtt: writing events to %s again", self._path)
            self.failed = False

    def _open(self) -> None:
        """Open the file and read what it holds. Raises LinkError."""
        try:
            os.makedirs(os.path.dirname(self._path) or ".", mode=0o700, exist_ok=True)
            self._db = connect(self._path)
            try:
                self._load()
            except sqlite3.Error:
                self._db.close()
                raise
        except OSError as error:
            raise LinkError(f"mqtt: cannot store events in {self._path}: {error.strerror}") from None
        except sqlite3.Error as error:
            if says(error, FULL):
                self._use_memory()
                log.warning("mqtt: %s: %s; events wait in memory until the next start", self._path, error)
            elif is_damaged(self._path, error) or says(error, DEFECT):
                self._replace(error)
            else:
                why = "another gateway uses it: give each its own --mqtt-spool FILE" if says(error, "locked") else error
                raise LinkError(f"mqtt: cannot store events in {self._path}: {why}") from None

    def _load(self) -> None:
        """Read every event once. Raises sqlite3.Error, also if a value is none that was written."""
        query = "SELECT max(place) FROM (SELECT place FROM events UNION SELECT place FROM last UNION SELECT 0)"
        try:
            ((place,),) = self._db.execute(query)
            held = f"SELECT robot, count(*), sum(length(text) + {OVERHEAD}) FROM events GROUP BY robot"
            rows = [(robot, int(count), int(size)) for robot, count, size in self._db.execute(held)]
            dropped = {robot: int(count) for robot, count in self._db.execute("SELECT robot, count FROM dropped")}
            names = {*dropped, *(robot for robot, *_ in rows)}
            if not 0 <= place < MOST_PLACE or any(level(name) != name for name in names):
                raise ValueError
        except (TypeError, ValueError):
            raise sqlite3.DatabaseError("a value is malformed") from None
        self.last = self._place = place
        self._held = Counter({robot: count for robot, count, _ in rows})
        self._bytes = sum(size for *_, size in rows)
        self.dropped = Counter(dropped)

    def _replace(self, error: sqlite3.Error) -> None:
        """Set a damaged file aside, and count what waited in it as dropped. Events in memory stay.

        Some of those that are counted may be on their way to the broker.
        """
        in_memory = {event.place for event in self._unwritten}
        self._held.subtract(event.robot for place, event in self._finished.items() if place not in in_memory)
        self._finished = {place: event for place, event in self._finished.items() if place in in_memory}
        for robot, count in self._held.items():
            self._drop(robot, max(0, count))
        self._newly |= self.dropped.keys()
        lost, self._held, self._bytes = sum(self._held.values()), Counter(), 0
        self._logged = sum(self.dropped.values())
        self._replaced += 1
        with contextlib.suppress(AttributeError, sqlite3.Error):  # it is not open yet at the start
            self._db.close()
        try:
            if self._replaced > MOST_REPLACED:
                raise sqlite3.Error("it was damaged too often")
            set_aside(self._path)
            self._db = connect(self._path)
            done = f"it is now {self._path}.broken, and a new one is used"
        except (OSError, sqlite3.Error) as fault:
            self._use_memory()
            why = getattr(fault, "strerror", fault)
            done = f"it cannot be replaced ({why}), and events wait in memory until the next start"
        log.warning(
            "mqtt: %s is damaged (%s): %s; %s events that waited in it are not delivered",
            self._path, error, done, lost or "the",
        )  # fmt: skip

    def _use_memory(self) -> None:
        self._db, self._in_memory = connect(MEMORY), True


def _cost(event: Event) -> int:
    return len(event.text) + OVERHEAD


def _events(rows: Iterable[Row]) -> list[Event]:
    """Events of the file. Raises sqlite3.DatabaseError if a value has another type than was written."""
    events = [Event(*row) for row in rows]
    if any((type(event.robot), type(event.at), type(event.text)) != (str, float, str) for event in events):
        raise sqlite3.DatabaseError("a value is malformed")
    return events
