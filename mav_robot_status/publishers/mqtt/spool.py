"""Undelivered events on disk: in order, with limits on size and age. Dropped events are counted.

SQLite with a write-ahead log: a committed event survives a kill of the process. A power failure may lose the last
moments (synchronous=NORMAL; FULL would sync the disk for each event). While the disk is full or fails, events wait in
memory and are written later.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import sqlite3
from collections import Counter, deque
from typing import TYPE_CHECKING, Final

from ...errors import LinkError
from ...values import NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

log = logging.getLogger(__name__)

MOST_UNWRITTEN: Final = 10_000
"""Events that wait in memory while the disk is full."""
RETRY: Final = 1.0  # s until the next attempt after a write failed
SWEEP: Final = 10.0  # s between two checks for old events
CLOCK_SET: Final = 1_500_000_000.0
"""Unix seconds (2017). An earlier stamp comes from a clock that was not set, and gives no age."""
OVERHEAD: Final = 64  # bytes of an event besides its text
LOG_INTERVAL: Final = 60.0  # s between two log messages about dropped events
SCHEMA: Final = """
CREATE TABLE IF NOT EXISTS events
    (place INTEGER PRIMARY KEY, robot TEXT NOT NULL, at REAL NOT NULL, text TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS by_robot ON events (robot, place);
CREATE TABLE IF NOT EXISTS dropped (robot TEXT PRIMARY KEY, count INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS last (one INTEGER PRIMARY KEY, place INTEGER NOT NULL);
"""


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
        """Open or create the file. Raises LinkError if that fails, or if another gateway has it open."""
        self._path, self._most, self._oldest = path, most_bytes, oldest
        self._db = self._open()
        self._unwritten: deque[Event] = deque()
        self._finished: dict[int, Event] = {}
        query = "SELECT max(place) FROM (SELECT place FROM events UNION SELECT place FROM last UNION SELECT 0)"
        self.last = self._place = int(self._db.execute(query).fetchone()[0])
        """The places of the last event written, and of the last event added."""
        query = f"SELECT count(*), coalesce(sum(length(text) + {OVERHEAD}), 0) FROM events"
        self._written, self._bytes = (int(number) for number in self._db.execute(query).fetchone())
        """The number of events on disk, and their bytes."""
        self.dropped: Counter[str] = Counter(dict(self._db.execute("SELECT robot, count FROM dropped")))
        """Dropped events of each robot since the file was created."""
        self._newly: set[str] = set()
        """Robots whose count of dropped events is not written yet."""
        self._retry_at = self._swept_at = self._logged_at = -math.inf
        self._first = self._place
        """The events beyond this place are of this process."""
        self._offset: float | None = None
        """Unix time minus monotonic time at the first `flush`."""
        self._logged = sum(self.dropped.values())
        self.failed = False
        """Whether the last write failed."""

    def robots(self) -> list[str]:
        """The robots with waiting events."""
        written = (robot for (robot,) in self._db.execute("SELECT DISTINCT robot FROM events"))
        return list(dict.fromkeys([*written, *(event.robot for event in self._unwritten)]))

    @property
    def settled(self) -> int:
        """The place up to which every event is on the disk, delivered or dropped."""
        return self._unwritten[0].place - 1 if self._unwritten else self._place

    @property
    def waiting(self) -> int:
        """The number of events that wait."""
        return max(0, self._written + len(self._unwritten) - len(self._finished))

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
        rows = (Event(*row) for row in self._db.execute(query, (robot, place, limit + len(self._finished))))
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
            self.last = self._place
            self._unwritten.clear()
            self._finished.clear()
            self._newly.clear()
        self._log_dropped(now)

    def close(self, now: float, unix: float) -> None:
        """Write the rest, log how many events wait, close the file."""
        self._retry_at = -math.inf
        self.flush(now, unix)
        with contextlib.suppress(sqlite3.Error):
            if self.waiting:
                log.warning("mqtt: %d events are undelivered; they wait in %s", self.waiting, self._path)
        self._db.close()

    def _write(self) -> None:
        count, held = self._written, self._bytes
        for event in self._finished.values():
            if self._db.execute("DELETE FROM events WHERE place = ?", (event.place,)).rowcount:  # 0: dropped before
                count, held = count - 1, held - _cost(event)
        self._db.executemany("INSERT INTO events VALUES (?, ?, ?, ?)", self._unwritten)
        self._db.execute("INSERT OR REPLACE INTO last VALUES (0, ?)", (self._place,))
        count, held = count + len(self._unwritten), held + sum(_cost(event) for event in self._unwritten)
        while held > self._most:
            oldest = Event(*self._db.execute("SELECT place, robot, at, text FROM events ORDER BY place").fetchone())
            self._db.execute("DELETE FROM events WHERE place = ?", (oldest.place,))
            count, held = count - 1, held - _cost(oldest)
            self._drop(oldest.robot)
        counts = [(robot, self.dropped[robot]) for robot in self._newly]
        self._db.executemany("INSERT OR REPLACE INTO dropped VALUES (?, ?)", counts)
        self._written, self._bytes = count, held

    def _sweep(self, now: float, unix: float) -> None:
        """Drop events that are too old. A clock that was set since does not age those of this process."""
        if self._offset is None:
            self._offset = unix - now
        is_set = max(0.0, unix - now - self._offset)
        query = "SELECT place, robot, at, text FROM events WHERE at BETWEEN ? AND ?"
        for row in self._db.execute(query, (CLOCK_SET, unix - self._oldest)).fetchall():
            event = Event(*row)
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
        before = self.dropped.copy(), self._newly.copy(), self._written, self._bytes
        try:
            yield
        except sqlite3.Error as error:
            self.dropped, self._newly, self._written, self._bytes = before
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

    def _open(self) -> sqlite3.Connection:
        try:
            os.makedirs(os.path.dirname(self._path) or ".", mode=0o700, exist_ok=True)
            try:
                return _connect(self._path)
            except sqlite3.DatabaseError as error:
                if isinstance(error, sqlite3.OperationalError):
                    raise
                os.replace(self._path, f"{self._path}.broken")
                log.warning("mqtt: %s is corrupt (%s); it is now %s.broken", self._path, error, self._path)
                return _connect(self._path)
        except sqlite3.Error as error:
            why = "another gateway uses it: give each its own --mqtt-spool FILE" if "locked" in str(error) else error
            raise LinkError(f"mqtt: cannot store events in {self._path}: {why}") from None
        except OSError as error:
            raise LinkError(f"mqtt: cannot store events in {self._path}: {error.strerror}") from None


def _cost(event: Event) -> int:
    return len(event.text) + OVERHEAD


def _connect(path: str) -> sqlite3.Connection:
    """Open the file with an exclusive lock. The kernel releases the lock when the process ends."""
    db = sqlite3.connect(path, timeout=0.5, isolation_level=None, check_same_thread=False)
    try:
        for pragma in ("locking_mode = EXCLUSIVE", "journal_mode = WAL", "synchronous = NORMAL", "mmap_size = 0"):
            db.execute(f"PRAGMA {pragma}")
        db.executescript(SCHEMA)
        db.execute("BEGIN EXCLUSIVE")
        db.execute("COMMIT")
    except sqlite3.Error:
        db.close()
        raise
    return db
