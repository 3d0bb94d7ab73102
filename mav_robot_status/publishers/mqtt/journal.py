"""The newest events, on the disk before anybody is told of them: a file that outlives a kill of the process.

The spool has a thread that is busy with other things, and lets the disk sync now and then. This file is only ever
written, by a thread of its own, which takes some hundredths of a millisecond: what the kernel has taken it keeps,
whatever becomes of the process (not of the power). It begins anew whenever the spool has all that is in it.
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
from typing import TYPE_CHECKING, Final

from ...errors import LinkError
from .spool import Event

if TYPE_CHECKING:
    from collections.abc import Iterator

log = logging.getLogger(__name__)

SIZE: Final = 1 << 20
"""Bytes of the file, taken from the disk at the start: a full one does not matter then."""
LONGEST: Final = 0.2
"""Seconds for which a disk that takes nothing, or a computer too busy for the thread, holds up the gateway; once, and
again after everything was taken."""
MOST_ASKED: Final = 10_000
"""Events that wait for such a disk."""
CLOSING: Final = 1.0  # s to wait for the thread


class Journal:
    """`keep` is for the gateway's thread, `forget` for the spool's."""

    def __init__(self, path: str, last: int) -> None:
        """Open the file, or make it. `last`: the place of the last event that the spool has. Raises LinkError."""
        self._path = path
        try:
            self._fd = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        except OSError as error:
            raise LinkError(f"mqtt: events cannot wait in {path}: {error.strerror}") from None
        with contextlib.suppress(OSError):  # full, or a file system that cannot
            os.posix_fallocate(self._fd, 0, SIZE)
        self._end, self.place = 0, last
        """Where the next event comes in the file, and what the last one was."""
        self._taken: float = last
        self.left = [event for event in self._read() if event.place > last]
        """Those that the spool has not."""
        self._asked: queue.SimpleQueue[tuple[Event, threading.Lock] | None] = queue.SimpleQueue()
        self._behind: threading.Lock | None = None
        """Released when the disk has taken everything for which the gateway did not wait."""
        self._late = self._refused = 0
        self._thread = threading.Thread(target=self._run, name="mqtt journal", daemon=True)
        self._thread.start()

    def keep(self, event: Event) -> None:
        """Returns when the event is on the disk, or after LONGEST. Places have to rise."""
        if self._behind is not None and self._behind.acquire(blocking=False):
            self._behind = None
        if self._behind is not None and self._asked.qsize() >= MOST_ASKED:
            self._late += 1
            return
        done = threading.Lock()
        done.acquire()
        self._asked.put((event, done))
        if self._behind is None and done.acquire(timeout=LONGEST):
            return
        if self._behind is None:
            log.warning(
                "mqtt: %s: the disk took no event within %g s; until it does, those that wait in memory would not "
                "outlive a kill", self._path, LONGEST,
            )  # fmt: skip
        self._late += 1
        self._behind = done

    def forget(self, place: float) -> None:
        """Up to this place no event is needed any more."""
        self._taken = place

    def close(self) -> None:
        """End; what the spool has not is there again at the next start."""
        self._asked.put(None)
        self._thread.join(CLOSING)
        if not self._thread.is_alive():  # else it has the file
            os.close(self._fd)
        if unsure := self._late + self._refused:
            log.warning("mqtt: %d events were told to others before they were on the disk", unsure)

    def _run(self) -> None:
        while (asked := self._asked.get()) is not None:
            event, done = asked
            try:
                self._write(event)
            except OSError:  # the spool tells of it
                self._refused += 1
            done.release()

    def _write(self, event: Event) -> None:
        if self.place <= self._taken:
            self._end = 0
        record = _record(event)
        if self._end + len(record) > SIZE or os.pwrite(self._fd, record, self._end) < len(record):
            raise OSError
        self._end += len(record)
        self.place = event.place

    def _read(self) -> Iterator[Event]:
        """Up to what was not written wholly, or was there before the file began anew."""
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
