"""Lines to a file or to standard output. Never blocks. An output that fails is tried again, and never has half a line.

A write can fail at any time: no room (ENOSPC, EFBIG, EDQUOT), a defect (EIO), a file system that went away, a FIFO that
nobody reads yet, or whose reader left. While it fails, only the latest line of each robot is held; the others are
counted. Only the end of the reader of standard output is an error, because nobody reads the program then.
"""

from __future__ import annotations

import errno
import logging
import math
import os
import select
from stat import S_ISFIFO, S_ISREG
from typing import Final, TextIO

from ..clock import Instant
from ..errors import LinkError

log = logging.getLogger(__name__)

PIPE_BUF: Final = 4096
"""Bytes that a pipe which poll() calls writable takes without blocking (PIPE_BUF of Linux)."""
RETRY: Final = 0.005  # s until a full pipe is tried again
RETRY_FAILED: Final = 5.0  # s until an output that failed is tried again
LOOK: Final = 1.0  # s between two checks of an idle reader
PACE: Final = 60.0  # s between two log lines about failures
GONE: Final = select.POLLERR | select.POLLHUP | select.POLLNVAL
FLAGS: Final = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK
MODE: Final = 0o644
UNREAD: Final = "nobody reads this pipe yet"
CHUNK: Final = 1 << 16  # bytes written at once on replay


class LineOutput:
    """Writes whole lines. Raises BrokenPipeError after the reader of standard output has closed its end."""

    def __init__(self, path: str, stdout: TextIO) -> None:
        """Open the output; `-` is standard output. Raises LinkError if that fails; a FIFO may have no reader yet."""
        self._path = None if path == "-" else path
        self.text = "standard output" if path == "-" else path
        """The name of the output in messages."""
        self.dropped = 0
        """Lines that are not in the output."""
        self._line = ("", b"")  # the line that is written, with its robot
        self._rest = b""
        self._before = b""  # a newline if the file ends with half a line
        self._held: dict[str, bytes] = {}
        self._failure: str | None = None
        self._told: str | None = None
        self._tell_at = self._look_at = -math.inf
        self._retry_at = math.inf
        self._poll = select.poll()
        self._is_ready = False
        """Whether the output was just seen to be writable, so that `write` need not look."""
        self._is_file = False
        """A file is always writable."""
        self._fd = -1
        descriptor = stdout.fileno() if self._path is None else -1
        try:
            self._open(descriptor)
        except OSError as error:
            if not _is_unread(path, error):
                raise LinkError(f"cannot write JSON lines to {self.text}: {error.strerror}") from None
            self._fail(UNREAD)

    @property
    def queued(self) -> int:
        """The lines that wait."""
        return bool(self._rest) + len(self._held)

    def busy(self) -> bool:
        """True while an earlier line is written in part, or the pipe is full. An output that has failed takes lines."""
        if self._failure is not None:
            return False
        if self._rest or self._held:
            return True
        self._is_ready = self._is_writable()
        return not self._is_ready and self._failure is None

    def write(self, robot: str, line: bytes) -> None:
        """Write a line about a robot. Only called while not busy."""
        if self._failure is not None:
            self._hold(robot, line)
            return
        self._begin(robot, line)

    def service(self, now: Instant) -> float | None:
        """Write what waits. Check whether an idle reader has closed its end. Returns when to be called again."""
        if now.mono < self._look_at and not (self._rest or self._held or self._failure or self._told):
            return None  # called in every turn, and hardly ever with work
        if self._failure is not None:
            if now.mono >= self._retry_at:
                self._try_again()
        elif self._rest:
            self._write()
        elif now.mono >= self._look_at:
            self._look_at = now.mono + LOOK
            self._is_writable()
        self._write_held()
        self._report(now.mono)
        if self._failure is not None:
            return self._retry_at
        return now.mono + RETRY if self.queued else None

    def close(self) -> None:
        """Write the rest of a line if there is room, and close a file. A second call does nothing."""
        try:
            if self._rest and self._failure is None:
                self._write()
        finally:
            if self._failure is not None:
                self.dropped += self.queued
                self._rest, self._held = b"", {}
                log.warning("%s: %d lines are not in it", self.text, self.dropped)
                self._failure = None
            self._close()

    def _open(self, descriptor: int = -1) -> None:
        if self._path is not None:
            descriptor = os.open(self._path, FLAGS, MODE)
            self._before = b"\n" if _ends_within_a_line(self._path, descriptor) else b""
        self._fd = descriptor
        self._is_file = S_ISREG(os.fstat(descriptor).st_mode)
        self._poll.register(descriptor, select.POLLOUT)

    def _close(self) -> None:
        if self._path is not None and self._fd >= 0:
            self._poll.unregister(self._fd)
            os.close(self._fd)
            self._fd = -1

    def _is_writable(self) -> bool:
        if self._is_file:
            return True
        events = self._poll.poll(0)
        if not events:
            return False
        if events[0][1] & GONE:
            if self._path is None:
                raise BrokenPipeError("the reader of the JSON lines has closed its end")
            self._fail("its reader has closed its end")
            return False
        return True

    def _begin(self, robot: str, line: bytes) -> None:
        self._line = robot, line
        self._rest = self._before + line
        self._write()

    def _write(self) -> None:
        """Write while the pipe has room, at most PIPE_BUF bytes at once, so that no write blocks."""
        ready, self._is_ready = self._is_ready, False
        while self._rest and (ready or self._is_writable()):
            ready = False
            try:
                done = os.write(self._fd, self._rest[:PIPE_BUF])
            except BlockingIOError:
                return
            except BrokenPipeError:
                if self._path is None:
                    raise
                self._fail("its reader has closed its end")
                return
            except OSError as error:
                self._fail(error.strerror or str(error))
                return
            self._rest = self._rest[done:]
            if not self._rest:
                self._before = b""

    def _write_held(self) -> None:
        while self._held and self._failure is None and not self._rest and self._is_writable():
            robot = next(iter(self._held))
            self._begin(robot, self._held.pop(robot))

    def _fail(self, reason: str) -> None:
        """Take back half a line, and close a file: its file system may be replaced. The line is held."""
        self._failure = reason
        robot, line = self._line
        done = len(self._before) + len(line) - len(self._rest)
        if self._rest and (self._path is not None or not done):  # half a line on standard output is completed later
            self._take_back(done)
            self._rest = b""
            self._hold(robot, line)
        self._close()
        self._retry_at = -math.inf  # not known here; `_report` sets it

    def _take_back(self, done: int) -> None:
        try:
            status = os.fstat(self._fd)
            if done and S_ISREG(status.st_mode):
                os.ftruncate(self._fd, status.st_size - done)
        except OSError:
            pass  # the line that follows begins with a newline

    def _hold(self, robot: str, line: bytes) -> None:
        self.dropped += robot in self._held
        self._held[robot] = line

    def _try_again(self) -> None:
        self._failure = None
        try:
            if self._path is not None:
                self._open()
        except OSError as error:
            self._fail(UNREAD if _is_unread(self.text, error) else error.strerror or str(error))
            return
        self._write()

    def _report(self, now: float) -> None:
        """Log the beginning and the end of a failure, and set the time of the next attempt."""
        failure = self._failure
        if failure is not None:
            if self._retry_at <= now:
                self._retry_at = now + RETRY_FAILED
            if failure != self._told and now >= self._tell_at:
                self._told, self._tell_at = failure, now + PACE
                log.warning("cannot write JSON lines to %s: %s; trying again", self.text, failure)
        elif self._told is not None and not self.queued:
            self._told = None
            log.warning("writing %s again; %d lines are not in it", self.text, self.dropped)


class PatientLineOutput:
    """The same for a replay: it waits for a slow reader, and a failure is an error."""

    queued = dropped = 0

    def __init__(self, path: str, stdout: TextIO) -> None:
        """Open the output. Raises LinkError if that fails."""
        self._lines: list[bytes] = []
        self._waiting = 0
        self._owned = path != "-"
        self.text = path if self._owned else "standard output"
        self._fd = -1 if self._owned else stdout.fileno()
        try:
            if self._owned:
                self._fd = os.open(path, FLAGS, MODE)
        except OSError as error:
            why = UNREAD if _is_unread(path, error) else error.strerror
            raise LinkError(f"cannot write JSON lines to {self.text}: {why}") from None
        if self._owned and _ends_within_a_line(path, self._fd):
            self._lines.append(b"\n")

    def busy(self) -> bool:
        """Never."""
        return False

    def write(self, robot: str, line: bytes) -> None:
        """Collect a line: a replay writes many at once. Raises BrokenPipeError, LinkError."""
        self._lines.append(line)
        self._waiting += len(line)
        if self._waiting >= CHUNK:
            self._flush()

    def service(self, now: Instant) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Write what was collected, and close a file. A second call does nothing."""
        try:
            self._flush()
        finally:
            if self._owned:
                self._owned = False
                os.close(self._fd)

    def _flush(self) -> None:
        data = memoryview(b"".join(self._lines))
        self._lines.clear()
        self._waiting = 0
        while data:
            try:
                data = data[os.write(self._fd, data) :]
            except BlockingIOError:
                room = select.poll()
                room.register(self._fd, select.POLLOUT)
                room.poll()
            except BrokenPipeError:
                raise
            except OSError as error:
                raise LinkError(f"cannot write JSON lines to {self.text}: {error.strerror}") from None


def _is_unread(path: str, error: OSError) -> bool:
    """Whether the file cannot be opened because it is a FIFO without a reader."""
    return error.errno == errno.ENXIO and S_ISFIFO(os.stat(path).st_mode)


def _ends_within_a_line(path: str, descriptor: int) -> bool:
    """Whether a file ends with half a line, as a kill may leave one. True if that cannot be seen."""
    status = os.fstat(descriptor)
    if not S_ISREG(status.st_mode) or not status.st_size:
        return False
    try:
        reading = os.open(path, os.O_RDONLY)
    except OSError:
        return True
    try:
        return os.pread(reading, 1, status.st_size - 1) != b"\n"
    finally:
        os.close(reading)
