"""Recording to a .tlog: 8 bytes of microseconds since 1970, big-endian, and a frame as it came; again and again.

QGroundControl, Mission Planner, MAVProxy and pymavlink open such files. A thread stands between caller and disk, for an
SD card may take seconds over one write. It hands the frames to the system at least once a second: a process that is
killed loses no more. The file is forced onto the disk (fsync) when it is closed and when it is rotated; in between the
system writes when it likes (Linux: within about 30 s), and a power cut loses what it had not yet written.
"""

from __future__ import annotations

import logging
import threading
from collections import deque
from typing import Final

from mav_robot_status.errors import MavRobotStatusError
from mav_robot_status.link.tlog_file import open_tlog

log = logging.getLogger(__name__)

MOST_BYTES: Final = 100_000_000
"""Bytes of one file: most of a day at a ground station's stream rates (13 MB an hour), quickly copied from a card."""
KEEP: Final = 9
"""Rotated files that are kept; with the one being written 1 GB in all."""
MOST_WAITING: Final = 1 << 19
"""Bytes that wait for the disk, and as many again may be on their way to it: minutes of frames."""
FLUSH_EVERY: Final = 0.5
"""Seconds that frames are gathered, so that few wake-ups and few writes serve them."""
RETRY_EVERY: Final = 5.0
"""Seconds until a disk that refused is tried again."""
CLOSE_WAIT: Final = 5.0
"""Seconds that closing waits for the disk."""

_TOO_SLOW: Final = "the disk does not keep up"
_LAST_STAMP: Final = (1 << 64) - 1


class TlogWriter:
    """Writes frames to a file that never grows beyond a size; nothing that the disk does is felt by the caller."""

    def __init__(self, path: str, *, most_bytes: int = MOST_BYTES, keep: int = KEEP) -> None:
        """Open the file, to append if there is one. Raises LinkError if it cannot be written, UsageError if it may not.

        Before it would exceed `most_bytes` it is renamed, flight.tlog to flight.1.tlog, and that to flight.2.tlog,
        and so on; what would come after number `keep` (1 at least) is deleted. So there are `keep` + 1 files at most.
        """
        self._path = path
        self.text = f"recording to {path}"
        """What is done, in words."""
        self.dropped = 0
        """Frames that are not in the file: the disk was too slow or refused them, or they came after `close`."""
        self._file = open_tlog(path, most_bytes, keep)
        self._trouble = ""  # why frames cannot be written now, as the log was told
        self._closing = False
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._waiting: deque[bytes] = deque()
        self._waiting_bytes = 0
        self._batch: deque[bytes] = deque()  # what the thread is writing; what a disk refuses stays in it
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
            if after <= MOST_WAITING and not self._closing:
                self._waiting.append(record)
                self._waiting_bytes = after
                if not before or before < MOST_WAITING // 2 <= after:
                    self._changed.notify()
                return
            self.dropped += 1
            if self._trouble or self._closing:
                return
            self._trouble = _TOO_SLOW
        self._complain(_TOO_SLOW)

    def close(self) -> None:
        """Write what is waiting, for at most `CLOSE_WAIT` seconds, and close the file."""
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
        """Until there is something to write, or it is time to try again, or, then true, the end has come."""
        with self._changed:
            if self._batch:
                self._changed.wait_for(lambda: self._closing, RETRY_EVERY)
            else:
                self._changed.wait_for(lambda: bool(self._waiting) or self._closing)
                self._changed.wait_for(lambda: self._waiting_bytes >= MOST_WAITING // 2 or self._closing, FLUSH_EVERY)
            if self._closing or not self._batch:
                self._batch.extend(self._waiting)
                self._waiting.clear()
                self._waiting_bytes = 0
            return self._closing

    def _refused(self, reason: str) -> None:
        """Say so, unless that has been said."""
        with self._changed:
            news, self._trouble = reason != self._trouble, reason
        if news:
            self._complain(reason)

    def _written(self) -> None:
        """Say that the trouble is over, once there is room again: a disk that is always too slow is told of once."""
        with self._changed:
            news = bool(self._trouble) and self._waiting_bytes < MOST_WAITING // 2
            if news:
                self._trouble = ""
        if news:
            log.warning("writing %s again; %d frames are not in it", self._path, self.dropped)

    def _complain(self, reason: str) -> None:
        log.warning("cannot write %s: %s; the status goes on", self._path, reason)
