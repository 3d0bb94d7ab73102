"""The file of a recording: size-capped, rotated, and always one of whole records.

The one thing of MAVLink's format that the file's format needs is the length that a header tells.
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
"""Bytes written at once."""
TAIL: Final = 1 << 16
"""Bytes at the end of a file that are searched for its last whole record."""
LONGEST: Final = 8 + 10 + 255 + 2 + 13
"""Bytes of the longest record: stamp, header, payload, CRC, signature."""
# A stamp before 2112 and the part of a header that tells a frame's length. The stamp alone begins with 12 zero bits.
_HEAD: Final = re.compile(rb"\0[\0-\x0f].{6}(?:\xfe.|\xfd..)", re.DOTALL)
_SOME_HEAD: Final = bytes(8) + b"\xfd\0\0"
_WHY_NOT: Final = {
    errno.ENOENT: "there is no folder {folder!r}; make it, or record elsewhere",
    errno.EACCES: "no permission; record to a folder that you may write to",
    errno.EAGAIN: "another program is recording to it; record to another file",
}


class TlogFile:
    """The file that is being written, and those that were before it. Its size is always one of whole records."""

    def __init__(self, path: str, most_bytes: int, keep: int) -> None:
        """Open it. Raises OSError, and UsageError if what is there is no recorded log."""
        self._path = path
        real = os.path.realpath(path)  # what a symbolic link names is rotated beside it, on the disk that was meant
        stem, suffix = os.path.splitext(real)
        self._names = [real, *(f"{stem}.{number}{suffix}" for number in range(1, max(keep, 1) + 1))]
        self._most_bytes = most_bytes
        self._size = 0
        self._descriptor = -1
        self._open()

    def append(self, records: deque[bytes]) -> None:
        """Write records; each is taken out once it is whole in the file.

        Raises OSError, UsageError. The file is then opened anew at the next attempt: its disk may have been exchanged.
        """
        try:
            if self._descriptor < 0:
                self._open()
            while records:
                if self._size and self._size + len(records[0]) > self._most_bytes:
                    self._rotate()
                self._write_some(records)
        except OSError:
            with suppress(OSError):  # nothing torn may stay, even if the process ends before the next attempt
                os.ftruncate(self._descriptor, self._size)
            self._let_go()
            raise

    def close(self) -> None:
        """Force everything onto the disk. Raises OSError if that fails; the file is closed all the same."""
        try:
            if self._descriptor >= 0:
                os.fsync(self._descriptor)
        finally:
            self._let_go()

    def _write_some(self, records: deque[bytes]) -> None:
        """As many as fit into a chunk and into the file, but at least one."""
        room = min(CHUNK, self._most_bytes - self._size)
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
        """Move each file to the next number, up to the first that is free, and begin a new one."""
        self.close()
        free = 0
        while free < len(self._names) - 1 and os.path.lexists(self._names[free]):
            free += 1
        for number in range(free, 0, -1):
            os.replace(self._names[number - 1], self._names[number])
        self._open()

    def _open(self) -> None:
        """Open to append, behind the last whole record."""
        real = self._names[0]
        if os.path.exists(real) and not os.path.isfile(real):
            raise UsageError(f"cannot record to {self._path!r}: it is no file; write for example flight.tlog")
        descriptor = os.open(real, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
        try:
            _lock(descriptor)
            there = os.fstat(descriptor).st_size
            size = _whole_size(descriptor, there)
            if size < 0:
                raise UsageError(f"{self._path!r} does not begin as a recorded log does; record to another file")
            if size < there:
                os.ftruncate(descriptor, size)
                log.info("%s ended in a torn record: %d bytes were cut off", self._path, there - size)
        except BaseException:
            os.close(descriptor)
            raise
        self._descriptor, self._size = descriptor, size

    def _let_go(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def open_tlog(path: str, most_bytes: int, keep: int) -> TlogFile:
    """The file, or one line for the person."""
    if not path.lower().endswith(".tlog"):
        raise UsageError(f"cannot record to {path!r}: the name must end in .tlog; write for example flight.tlog")
    try:
        return TlogFile(path, most_bytes, keep)
    except OSError as error:
        folder = os.path.dirname(path) or "."
        reason = _WHY_NOT.get(error.errno or 0, f"{error.strerror}; record elsewhere").format(folder=folder)
        raise LinkError(f"cannot record to {path!r}: {reason}") from None
    except ValueError:
        raise UsageError(f"cannot record to {path!r}: not a file name; write for example flight.tlog") from None


def _lock(descriptor: int) -> None:
    """Two programs would write into each other's records. A file system that has no locks does without."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:
        pass


def _whole_size(descriptor: int, size: int) -> int:
    """Where the last whole record of a file ends; -1 if it is no recorded log. Looks only at both ends of the file.

    A crash leaves a record torn, a power cut may leave zeros behind it. More than that is not ours, and stays.
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
    return start + whole if len(tail[whole:].rstrip(b"\0")) < LONGEST else size


def _whole(data: bytes) -> int:
    """Where the last whole record in `data` ends; the data may begin within a record, and hold garbage."""
    at = end = 0
    while head := _HEAD.search(data, at):
        start = head.start()
        following = start + _length(data, start)
        if following <= len(data):
            at = end = following
        elif start == at:
            break  # in step: the torn one
        else:
            at = start + 1
    return end


def _length(data: bytes, start: int) -> int:
    """Bytes of the record whose head stands at `start`: the one thing about MAVLink that the file's format needs."""
    if data[start + 8] == 0xFE:
        return 8 + 8 + data[start + 9]
    return 8 + 12 + data[start + 9] + (13 if data[start + 10] & 1 else 0)
