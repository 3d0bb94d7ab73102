"""The file of a recording: limited in size, rotated, and always complete records.

This module needs only one part of MAVLink's format: the length in the header of a frame.
"""

from __future__ import annotations

import errno
import fcntl
import logging
import os
import re
from collections import deque
from contextlib import suppress
from typing import Final

from mav_robot_status.errors import LinkError, UsageError

log = logging.getLogger(__name__)

CHUNK: Final = 1 << 16
"""The most bytes of one write, except for a longer record."""
TAIL: Final = 1 << 16
"""Bytes at the end of a file that are searched for the last whole record."""
MODE: Final = 0o640
"""Permissions of a new file: a recording shows where people live. A file that exists keeps its own."""
MAX_RECORD: Final = 8 + 10 + 255 + 2 + 13
"""Bytes of the longest record: stamp, header, payload, CRC, signature."""
# A stamp before 2112, which begins with 12 zero bits, and the part of a header with the length of the frame.
_HEAD: Final = re.compile(rb"\0[\0-\x0f].{6}(?:\xfe.|\xfd..)", re.DOTALL)
_SOME_HEAD: Final = bytes(8) + b"\xfd\0\0"
_WHY_NOT: Final = {
    errno.ENOENT: "no such folder {folder!r}; make it or record elsewhere",
    errno.EACCES: "no permission; record to a folder that you may write to",
    errno.EAGAIN: "another program is recording to it; record to another file",
}


class TlogFile:
    """The current file and the rotated ones. The current file always ends with a whole record."""

    def __init__(self, path: str, max_bytes: int, keep: int) -> None:
        """Open it. Raises OSError; UsageError if the file exists and is not a recorded log."""
        self._path = path
        real = os.path.realpath(path)  # the target of a symbolic link is rotated in its own folder
        stem, suffix = os.path.splitext(real)
        self._names = [real, *(f"{stem}.{number}{suffix}" for number in range(1, max(keep, 1) + 1))]
        self._max_bytes = max_bytes
        self._size = 0
        self._descriptor = -1
        self._open()

    def append(self, records: deque[bytes]) -> None:
        """Write records, and remove each from `records` when it is in the file.

        Raises OSError, UsageError. The next attempt then opens the file again: the disk may have been replaced.
        """
        try:
            if self._descriptor < 0:
                self._open()
            while records:
                if self._size and self._size + len(records[0]) > self._max_bytes:
                    self._rotate()
                self._write_some(records)
        except OSError:
            with suppress(OSError):  # no partial record may stay, even if the process ends before the next attempt
                os.ftruncate(self._descriptor, self._size)
            self._close_descriptor()
            raise

    def close(self) -> None:
        """Synchronise the file with the disk, and close it. Raises OSError if that fails; the file is closed anyway."""
        try:
            if self._descriptor >= 0:
                os.fsync(self._descriptor)
        finally:
            self._close_descriptor()

    def _write_some(self, records: deque[bytes]) -> None:
        """Write as many records as fit into a chunk and into the file, at least one."""
        room = min(CHUNK, self._max_bytes - self._size)
        chunk = bytearray()
        for record in records:
            if chunk and len(chunk) + len(record) > room:
                break
            chunk += record
        done = 0
        try:
            while done < len(chunk):
                done += os.write(self._descriptor, chunk[done:])
        finally:
            while records and done >= len(records[0]):
                done -= len(records[0])
                self._size += len(records.popleft())

    def _rotate(self) -> None:
        """Rename each file to the next number, up to the first free number, and start a new file."""
        self.close()
        free = 0
        while free < len(self._names) - 1 and os.path.lexists(self._names[free]):
            free += 1
        for number in range(free, 0, -1):
            os.replace(self._names[number - 1], self._names[number])
        self._open()

    def _open(self) -> None:
        """Open the file to append after the last whole record."""
        real = self._names[0]
        if os.path.exists(real) and not os.path.isfile(real):
            raise UsageError(f"cannot record to {self._path!r}: it is not a file; write for example flight.tlog")
        descriptor = os.open(real, os.O_RDWR | os.O_CREAT | os.O_APPEND, MODE)
        try:
            _lock(descriptor)
            there = os.fstat(descriptor).st_size
            size = _whole_size(descriptor, there)
            if size < 0:
                raise UsageError(f"{self._path!r} does not begin as a recorded log does; record to another file")
            if size < there:
                os.ftruncate(descriptor, size)
                log.info("%s ended with a partial record: %d bytes were removed", self._path, there - size)
        except BaseException:
            os.close(descriptor)
            raise
        self._descriptor, self._size = descriptor, size

    def _close_descriptor(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def check_name(path: str) -> None:
    """Raise UsageError for a name that no recording has."""
    if not path.lower().endswith(".tlog"):
        raise UsageError(f"cannot record to {path!r}: the name must end in .tlog; write for example flight.tlog")


def open_tlog(path: str, max_bytes: int, keep: int) -> TlogFile:
    """The open file. Raises LinkError or UsageError, one line that says what to do."""
    check_name(path)
    try:
        return TlogFile(path, max_bytes, keep)
    except OSError as error:
        folder = os.path.dirname(path) or "."
        reason = _WHY_NOT.get(error.errno or 0, f"{error.strerror}; record elsewhere").format(folder=folder)
        raise LinkError(f"cannot record to {path!r}: {reason}") from None
    except ValueError:
        raise UsageError(f"cannot record to {path!r}: not a file name; write for example flight.tlog") from None


def _lock(descriptor: int) -> None:
    """Lock the file: two programs would mix their records. A file system without locks is accepted."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass


def _whole_size(descriptor: int, size: int) -> int:
    """Where the last whole record of a file ends; -1 if the file is not a recorded log. Reads only both ends of it.

    A crash leaves a partial record, and a power cut may leave zeros after it. Anything else is kept.
    """
    while True:
        start = max(0, size - TAIL)
        tail = os.pread(descriptor, size - start, start)
        if tail.strip(b"\0"):
            break
        if not start:
            return 0
        size = start
    head = os.pread(descriptor, len(_SOME_HEAD), 0)
    if not _HEAD.match(head + _SOME_HEAD[len(head) :]):
        return -1
    whole = _whole(tail)
    return start + whole if len(tail[whole:].rstrip(b"\0")) < MAX_RECORD else size


def _whole(data: bytes) -> int:
    """Where the last whole record in `data` ends; the data may start within a record, and contain garbage."""
    at = end = 0
    while head := _HEAD.search(data, at):
        start = head.start()
        following = start + _length(data, start)
        if following <= len(data):
            at = end = following
        elif start == at:
            break  # in sync: this is the partial record
        else:
            at = start + 1
    return end


def _length(data: bytes, start: int) -> int:
    """The size in bytes of the record that starts at `start`."""
    if data[start + 8] == 0xFE:
        return 8 + 8 + data[start + 9]
    return 8 + 12 + data[start + 9] + (13 if data[start + 10] & 1 else 0)
