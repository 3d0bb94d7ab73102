"""Events that wait to be delivered, on disk: in order, bounded in size and age, what is dropped is counted.

SQLite with a write-ahead log: what was committed outlives a kill of the process; a power cut may take the last moments
(synchronous=NORMAL: only that would need FULL, and a sync of the disk for each event). While the disk takes nothing
events wait in memory instead, and are written once it does.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import sqlite3
from collections import Counter, deque
from typing import TYPE_CHECKING, Final, NamedTuple

from ...errors import LinkError

if TYPE_CHECKING:
    from collections.abc import Iterator

log = logging.getLogger(__name__)

MOST_UNWRITTEN: Final = 10_000
"""Events that wait in memory while the disk is full."""
RETRY: Final = 1.0  # s until a disk that took nothing is tried again
SWEEP: Final = 10.0  # s between two looks for events that are too old
CLOCK_SET: Final = 1_500_000_000.0
"""Unix seconds (2017): before it a computer has not been told the time, and a stamp says nothing about an age."""
OVERHEAD: Final = 64  # bytes that an event costs besides its text
TELL: Final = 60.0  # s between two lines about dropped events
SCHEMA: Final = """
CREATE TABLE IF NOT EXISTS events
    (place INTEGER PRIMARY KEY, robot TEXT NOT NULL, at REAL NOT NULL, text TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS by_robot ON events (robot, place);
CREATE TABLE IF NOT EXISTS dropped (robot TEXT PRIMARY KEY, count INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS last (one INTEGER PRIMARY KEY, place INTEGER NOT NULL);
"""


class Event(NamedTuple):
    """One event that waits."""

    place: int
    """Rises with every event that the spool was ever given."""
    robot: str
    at: float
    """Unix seconds."""
    text: str


class Spool:
    """All events of one gateway. Of one thread."""

    def __init__(self, path: str, most_bytes: int, oldest: float) -> None:
        """Open the file, or make it. Raises LinkError if that cannot be, or another gateway has it."""
        self._path, self._most, self._oldest = path, most_bytes, oldest
        self._db = self._open()
        self._unwritten: deque[Event] = deque()
        self._finished: dict[int, Event] = {}
        query = "SELECT max(place) FROM (SELECT place FROM events UNION SELECT place FROM last UNION SELECT 0)"
        self.last = self._place = int(self._db.execute(query).fetchone()[0])
        """Places of the last events that were ever on the disk, and added."""
        query = f"SELECT count(*), coalesce(sum(length(text) + {OVERHEAD}), 0) FROM events"
        self._written, self._bytes = (int(number) for number in self._db.execute(query).fetchone())
        """How many events are on the disk, and their bytes."""
        self.dropped: Counter[str] = Counter(dict(self._db.execute("SELECT robot, count FROM dropped")))
        """By robot, ever since the file was made."""
        self._newly: set[str] = set()
        """Robots whose count of dropped events is not written yet."""
        self._retry_at = self._swept_at = self._told_at = -math.inf
        self._told = sum(self.dropped.values())
        self.failed = False
        """Whether the disk took nothing when it was tried last."""

    def robots(self) -> list[str]:
        """Those for whom something waits."""
        written = (robot for (robot,) in self._db.execute("SELECT DISTINCT robot FROM events"))
        return list(dict.fromkeys([*written, *(event.robot for event in self._unwritten)]))

    @property
    def settled(self) -> int:
        """The place up to which every event is on the disk, delivered or dropped."""
        return self._unwritten[0].place - 1 if self._unwritten else self._place

    @property
    def waiting(self) -> int:
        """How many events wait."""
        return max(0, self._written + len(self._unwritten) - len(self._finished))

    def add(self, event: Event) -> None:
        """Take an event, whose place is beyond those before; `flush` writes it."""
        self._place = event.place
        self._unwritten.append(event)
        if len(self._unwritten) > MOST_UNWRITTEN:
            self._drop(self._unwritten.popleft().robot)

    def count_dropped(self, robot: str, count: int) -> None:
        """Events of a robot that were dropped elsewhere, before they came here."""
        self._drop(robot, count)

    def after(self, robot: str, place: int, limit: int) -> list[Event]:
        """The oldest events of a robot beyond a place, at most so many."""
        query = "SELECT place, robot, at, text FROM events WHERE robot = ? AND place > ? ORDER BY place LIMIT ?"
        rows = (Event(*row) for row in self._db.execute(query, (robot, place, limit + len(self._finished))))
        in_memory = (event for event in self._unwritten if event.robot == robot and event.place > place)
        return [event for event in (*rows, *in_memory) if event.place not in self._finished][:limit]

    def done(self, event: Event) -> None:
        """An event is delivered; `flush` takes it from the disk."""
        self._finished[event.place] = event

    def flush(self, now: float, unix: float) -> None:
        """Write what is new, delete what is done, keep the bounds. `now` is monotonic."""
        if now < self._retry_at:
            return
        if now - self._swept_at >= SWEEP:
            self._swept_at = now
            self._sweep(unix)
        if not (self._unwritten or self._finished or self._newly):
            return
        delivered = [event for event in self._unwritten if event.place in self._finished]
        for event in delivered:  # in memory, while the disk was full
            self._unwritten.remove(event)
            del self._finished[event.place]
        with self._told_if_it_fails(now):
            with self._db:
                self._db.execute("BEGIN")
                self._write()
            self.last = self._place
            self._unwritten.clear()
            self._finished.clear()
            self._newly.clear()
        self._tell(now)

    def close(self, now: float, unix: float) -> None:
        """Write the rest, tell what waits, let go of the file."""
        self._retry_at = -math.inf
        self.flush(now, unix)
        with contextlib.suppress(sqlite3.Error):
            if self.waiting:
                log.warning("mqtt: %d events are not delivered yet; they wait in %s", self.waiting, self._path)
        self._db.close()

    def _write(self) -> None:
        count, held = self._written, self._bytes
        for event in self._finished.values():
            if self._db.execute("DELETE FROM events WHERE place = ?", (event.place,)).rowcount:  # else dropped before
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

    def _sweep(self, unix: float) -> None:
        """Drop what is too old."""
        query = "SELECT place, robot, at, text FROM events WHERE at BETWEEN ? AND ?"
        for row in self._db.execute(query, (CLOCK_SET, unix - self._oldest)).fetchall():
            event = Event(*row)
            if event.place not in self._finished:
                self._finished[event.place] = event
                self._drop(event.robot)

    def _drop(self, robot: str, count: int = 1) -> None:
        self.dropped[robot] += count
        self._newly.add(robot)

    def _tell(self, now: float) -> None:
        total = sum(self.dropped.values())
        if total > self._told and now - self._told_at >= TELL:
            log.warning("mqtt: %d events were dropped so far: too many waited, or for too long", total)
            self._told, self._told_at = total, now

    @contextlib.contextmanager
    def _told_if_it_fails(self, now: float) -> Iterator[None]:
        before = self.dropped.copy(), self._newly.copy(), self._written, self._bytes
        try:
            yield
        except sqlite3.Error as error:
            self.dropped, self._newly, self._written, self._bytes = before
            self._retry_at = now + RETRY
            if not self.failed:
                log.warning("mqtt: %s takes no events (%s); they wait in memory, trying again", self._path, error)
            self.failed = True
        else:
            if self.failed:
                log.warning("mqtt: %s takes events again", self._path)
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
                log.warning("mqtt: %s was broken (%s); it is kept as %s.broken", self._path, error, self._path)
                return _connect(self._path)
        except sqlite3.Error as error:
            why = "another gateway uses it: give each its own --mqtt-spool FILE" if "locked" in str(error) else error
            raise LinkError(f"mqtt: events cannot wait in {self._path}: {why}") from None
        except OSError as error:
            raise LinkError(f"mqtt: events cannot wait in {self._path}: {error.strerror}") from None


def _cost(event: Event) -> int:
    return len(event.text) + OVERHEAD


def _connect(path: str) -> sqlite3.Connection:
    """Open it for ourselves alone: the lock goes with the process, however it ends."""
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
