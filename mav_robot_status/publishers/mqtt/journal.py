"""The newest events, in a file before they are published. The file survives a kill of the process.

The spool runs in a busy thread and syncs now and then. The journal has its own thread, which only writes; an event
takes some hundredths of a millisecond. Data that the kernel has accepted survives the process, but not a power failure.
Writing restarts at the beginning of the file whenever the spool has every event in it.
"""

from __future__ import annotations

import contextlib
import json
import logging
import math
import os
import queue
import threading
import zlib
from collections.abc import Iterator
from typing import Final

from ...errors import LinkError
from .spool import Event

log = logging.getLogger(__name__)

SIZE: Final = 1 << 20
"""Bytes of the file. They are allocated at the start, so that a disk that fills up later does no harm."""
LONGEST: Final = 0.2
"""Seconds for which a hanging disk, or a busy computer, may delay the gateway. It delays the gateway once, and again
only after everything is written."""
MOST_PENDING: Final = 10_000
"""Events that may wait for a hanging disk."""
CLOSING: Final = 1.0  # s to wait for the thread


class Journal:
    """The gateway's thread calls `append`, the spool's thread `forget`."""

    def __init__(self, path: str, last: int) -> None:
        """Open or create the file. `last` is the place of the last event that the spool has. Raises LinkError."""
        self._path = path
        try:
            self._fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise LinkError(f"mqtt: cannot store events in {path}: {error.strerror}") from None
        with contextlib.suppress(OSError):  # a full disk, or a file system without fallocate
            os.posix_fallocate(self._fd, 0, SIZE)
        self._end, self.place = 0, last
        """The offset of the next record in the file, and the place of the last event."""
        self._in_spool: float = last
        self.left = [event for event in self._read() if event.place > last]
        """The events that the spool does not have."""
        self._pending: queue.SimpleQueue[tuple[Event, threading.Lock] | None] = queue.SimpleQueue()
        self._behind: threading.Lock | None = None
        """Released when every event for which the gateway did not wait is written."""
        self._late = self._refused = 0
        self._thread = threading.Thread(target=self._run, name="mqtt journal", daemon=True)
        self._thread.start()

    def append(self, event: Event) -> None:
        """Write an event. Return when it is in the file, or after LONGEST. Places must rise."""
        if self._behind is not None and self._behind.acquire(blocking=False):
            self._behind = None
        if self._behind is not None and self._pending.qsize() >= MOST_PENDING:
            self._late += 1
            return
        done = threading.Lock()
        done.acquire()
        self._pending.put((event, done))
        if self._behind is None and done.acquire(timeout=LONGEST):
            return
        if self._behind is None:
            log.warning(
                "mqtt: %s: the disk wrote no event within %g s; events wait in memory and do not survive a kill",
                self._path, LONGEST,
            )  # fmt: skip
        self._late += 1
        self._behind = done

    def forget(self, place: float) -> None:
        """The spool has every event up to this place."""
        self._in_spool = place

    def close(self) -> None:
        """End the thread. Events that the spool does not have stay in the file for the next start."""
        self._pending.put(None)
        self._thread.join(CLOSING)
        if not self._thread.is_alive():  # a live thread still uses the file
            os.close(self._fd)
        if unsure := self._late + self._refused:
            log.warning("mqtt: %d events were published before they were on the disk", unsure)

    def _run(self) -> None:
        while (pending := self._pending.get()) is not None:
            event, done = pending
            try:
                self._write(event)
            except OSError:  # the spool logs it
                self._refused += 1
            done.release()

    def _write(self, event: Event) -> None:
        if self.place <= self._in_spool:
            self._end = 0
        record = _record(event)
        if self._end + len(record) > SIZE or os.pwrite(self._fd, record, self._end) < len(record):
            raise OSError
        self._end += len(record)
        self.place = event.place

    def _read(self) -> Iterator[Event]:
        """The events up to the first incomplete record, or the first one from before the last restart."""
        data, last = os.pread(self._fd, SIZE, 0), -math.inf
        for record in data.split(b"\n"):
            try:
                event = Event(*json.loads(record[9:]))
            except (ValueError, TypeError):
                return
            if _record(event) != record + b"\n" or event.place <= last:
                return
            self._end += len(record) + 1
            self.place = max(self.place, event.place)
            last = event.place
            yield event


def _record(event: Event) -> bytes:
    text = json.dumps(event).encode()
    return b"%08x %s\n" % (zlib.crc32(text), text)
