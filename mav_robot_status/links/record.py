"""Recording to a .tlog: a sequence of records, each 8 bytes of microseconds since 1970 (big-endian) and one frame.

QGroundControl, Mission Planner, MAVProxy and pymavlink read such files. A thread writes, because one write to an SD
card can take seconds. It passes the frames to the system at least once a second: a process that is killed loses no
more. The file is synchronised (fsync) when it is closed and when it is rotated. At other times the system decides when
to write (Linux: within about 30 s), and a power cut loses the rest.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import Final

from mav_robot_status.errors import MavRobotStatusError
from mav_robot_status.links.tlog_file import open_tlog

log = logging.getLogger(__name__)

MAX_BYTES: Final = 100_000_000
"""Bytes of one file: about 8 hours at the stream rates of a ground station (13 MB an hour)."""
KEEP: Final = 9
"""The most rotated files. With the current file these are 1 GB."""
MAX_WAITING: Final = 1 << 19
"""Bytes that may wait for the disk; as many again may be in the current write. This is minutes of frames."""
FLUSH_EVERY: Final = 0.5
"""Seconds between two writes, so that one wake-up and one write serve many frames."""
RETRY_EVERY: Final = 5.0
"""Seconds until the next attempt after a failed write."""
CLOSE_WAIT: Final = 5.0
"""Seconds that `close` waits for the disk."""

_TOO_SLOW: Final = "the disk does not keep up"
_LAST_STAMP: Final = (1 << 64) - 1


class TlogWriter:
    """Writes frames to a file of limited size. The caller never waits for the disk."""

    def __init__(self, path: str, *, max_bytes: int = MAX_BYTES, keep: int = KEEP) -> None:
        """Open the file, and append if it exists.

        Before it would exceed `max_bytes` it is rotated: flight.tlog becomes flight.1.tlog, flight.1.tlog becomes
        flight.2.tlog, and so on. A file beyond number `keep` (at least 1) is deleted, so there are at most `keep` + 1.

        Raises LinkError if the file cannot be written, UsageError if it is not a recorded log.
        """
        self._path = path
        self.text = f"recording to {path}"
        """What the writer does, for the log."""
        self.dropped = 0
        """Frames that are not in the file: the disk was too slow, a write failed, or they came after `close`."""
        self._file = open_tlog(path, max_bytes, keep)
        self._trouble = ""  # why frames cannot be written now, as it was logged
        self._closing = False
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._waiting: deque[bytes] = deque()
        self._waiting_bytes = 0
        self._batch: deque[bytes] = deque()  # the frames that the thread writes; they stay here if the write fails
        self._thread = threading.Thread(target=self._run, name=f"record {path}", daemon=True)
        self._thread.start()

    def write(self, unix_us: int, frame: bytes) -> None:
        """Record a whole MAVLink frame with its time in microseconds since 1970. Never waits for the disk or raises."""
        if not 0 <= unix_us <= _LAST_STAMP:
            unix_us = min(max(unix_us, 0), _LAST_STAMP)
        record = unix_us.to_bytes(8, "big") + frame
        with self._lock:
            before = self._waiting_bytes
            after = before + len(record)
            if after <= MAX_WAITING and not self._closing:
                self._waiting.append(record)
                self._waiting_bytes = after
                if not before or before < MAX_WAITING // 2 <= after:
                    self._changed.notify()
                return
            self.dropped += 1
            if self._trouble or self._closing:
                return
            self._trouble = _TOO_SLOW
        self._warn(_TOO_SLOW)

    def close(self) -> None:
        """Write the frames that wait, for at most `CLOSE_WAIT` seconds, and close the file."""
        with self._changed:
            if self._closing:
                return
            self._closing = True
            self._changed.notify()
        self._thread.join(CLOSE_WAIT)
        self.dropped += len(self._batch) + len(self._waiting)
        if self.dropped:
            log.warning("%s: %d frames are not in it", self._path, self.dropped)

    def _run(self) -> None:
        closing = False
        while not closing:
            closing = self._wait()
            try:
                self._file.append(self._batch)
                if closing:
                    self._file.close()
            except (OSError, MavRobotStatusError) as problem:
                self._refused((problem.strerror if isinstance(problem, OSError) else None) or str(problem))
            else:
                self._written()

    def _wait(self) -> bool:
        """Wait until there are frames to write, or a retry is due. True if the writer closes."""
        with self._changed:
            if self._batch:
                self._changed.wait_for(lambda: self._closing, RETRY_EVERY)
            else:
                self._changed.wait_for(lambda: bool(self._waiting) or self._closing)
                self._changed.wait_for(lambda: self._waiting_bytes >= MAX_WAITING // 2 or self._closing, FLUSH_EVERY)
            if self._closing or not self._batch:
                self._batch.extend(self._waiting)
                self._waiting.clear()
                self._waiting_bytes = 0
            return self._closing

    def _refused(self, reason: str) -> None:
        """Log a failed write, unless its reason was logged already."""
        with self._changed:
            news, self._trouble = reason != self._trouble, reason
        if news:
            self._warn(reason)

    def _written(self) -> None:
        """Log that writing works again, once half of the queue is free: a disk that is too slow is logged once."""
        with self._changed:
            news = bool(self._trouble) and self._waiting_bytes < MAX_WAITING // 2
            if news:
                self._trouble = ""
        if news:
            log.warning("writing %s again; %d frames are not in it", self._path, self.dropped)

    def _warn(self, reason: str) -> None:
        log.warning("cannot write %s: %s; the status continues", self._path, reason)
