"""The SQLite file of the spool: opened for one process, and set aside if it is damaged. Memory can stand in for it."""

from __future__ import annotations

import os
import sqlite3
from contextlib import suppress
from typing import Final

MEMORY: Final = ":memory:"
"""The path of a spool without a file."""
SCHEMA: Final = """
CREATE TABLE IF NOT EXISTS events
    (place INTEGER PRIMARY KEY, robot TEXT NOT NULL, at REAL NOT NULL, text TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS by_robot ON events (robot, place);
CREATE TABLE IF NOT EXISTS dropped (robot TEXT PRIMARY KEY, count INTEGER NOT NULL);
CREATE TABLE IF NOT EXISTS last (one INTEGER PRIMARY KEY, place INTEGER NOT NULL);
"""
PARTS: Final = ("", "-wal", "-journal")
"""The endings of the files of one database. A new one must not find those of a damaged one."""
FULL: Final = "full"
DEFECT: Final = "I/O"
REFUSED: Final = ("locked", "unable to open", "readonly")
"""Words of SQLite's errors about other processes and permissions."""
PASSING: Final = (FULL, DEFECT, *REFUSED)
"""Words of its errors after which the same file may work again."""


def connect(path: str) -> sqlite3.Connection:
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


def is_damaged(path: str, error: sqlite3.Error) -> bool:
    """Whether the contents of the file are at fault, and not the disk, a permission or another process."""
    if says(error, "readonly"):  # a damaged header can forbid to write what the kernel permits to write
        return os.access(path, os.W_OK)
    return not (isinstance(error, sqlite3.OperationalError) and says(error, *PASSING))


def says(error: sqlite3.Error, *words: str) -> bool:
    """Whether SQLite's error has one of these words. Its numbers are not known before Python 3.11."""
    return any(word in str(error) for word in words)


def set_aside(path: str) -> None:
    """Rename the file to `path.broken`, which replaces an earlier one. Raises OSError."""
    os.replace(path, f"{path}.broken")
    for part in PARTS[1:]:
        with suppress(FileNotFoundError):
            os.remove(f"{path}.broken{part}")
        with suppress(FileNotFoundError):
            os.replace(f"{path}{part}", f"{path}.broken{part}")
