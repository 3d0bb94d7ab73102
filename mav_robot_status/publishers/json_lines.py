"""Statuses as JSON, one object a line: the native form, or the literal industrial_msgs/RobotStatus of ROS."""

from __future__ import annotations

import json
import math
import os
import select
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from ..clock import rfc3339
from ..errors import LinkError, UsageError
from ..interface import RobotMode

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ..clock import Instant
    from ..interface import Detail, PublisherContext, RobotStatus, RobotStatusMsg, Vehicle

PIPE_BUF: Final = 4096
"""Bytes that a pipe which poll() calls writable takes without blocking (PIPE_BUF of Linux)."""
CHUNK: Final = 1 << 16  # bytes written at once on replay
RETRY: Final = 0.005  # s until a full pipe is tried again
LOOK: Final = 1.0  # s between looks whether the reader is still there, while there is nothing to write
WORDS: Final = {-1: "null", 0: "false", 1: "true"}
MODES: Final = {int(mode): mode.name for mode in RobotMode}


def native_body(handle: str, status: RobotStatus, detail: Detail) -> str:
    """The part of a native line that stays while the status does: all but stamp, seq and heartbeat_age.

    It is open behind link.state. What the encoder of `json` takes its time for is asked of it where there is something
    new only: a line that says that something has changed is one that somebody waits for.
    """
    errors = [{"code": e.code, "name": e.name, "text": e.text, "since": rfc3339(e.since_us)} for e in detail.errors]
    inhibits = [{"name": i.name, "text": i.text, "since": rfc3339(i.since_us)} for i in detail.inhibits]
    return (
        f'{_who(handle, detail.system, detail.component)}, "mode": "{MODES[status.mode]}", '
        f'"e_stopped": {WORDS[status.e_stopped]}, "drives_powered": {WORDS[status.drives_powered]}, '
        f'"motion_possible": {WORDS[status.motion_possible]}, "in_motion": {WORDS[status.in_motion]}, '
        f'"in_error": {WORDS[status.in_error]}, "error_code": {status.error_code}, '
        f'"errors": {json.dumps(errors) if errors else "[]"}, '
        f'"inhibits": {json.dumps(inhibits) if inhibits else "[]"}, '
        f'"vehicle": {_vehicle(detail.vehicle)}, "link": {{"state": "{detail.link.value}"'
    )


@lru_cache(maxsize=256)
def _who(handle: str, system: int | None, component: int | None) -> str:
    return json.dumps({"handle": handle, "system": system, "component": component})[1:-1]


@lru_cache(maxsize=256)
def _vehicle(vehicle: Vehicle) -> str:
    return json.dumps(vehicle._asdict())


def native(msg: RobotStatusMsg, seq: int, body: str) -> str:
    """The native line."""
    age = "null" if msg.heartbeat_age is None else f"{max(0.0, msg.heartbeat_age):.3f}"
    return f'{{"stamp": "{rfc3339(msg.unix_us)}", "seq": {seq}, {body}, "heartbeat_age": {age}}}}}\n'


def ros1(msg: RobotStatusMsg, seq: int) -> str:
    """industrial_msgs/RobotStatus of ROS 1; frame_id is the handle's name."""
    seconds, us = divmod(msg.unix_us, 1_000_000)
    header = {"seq": seq, "stamp": {"secs": seconds, "nsecs": us * 1000}, "frame_id": msg.handle}
    return json.dumps({"header": header, **_vals(msg.status), "error_code": msg.status.error_code}) + "\n"


def ros2(msg: RobotStatusMsg, seq: int) -> str:
    """industrial_msgs/RobotStatus of ROS 2: every active error code, none while there is no error."""
    seconds, us = divmod(msg.unix_us, 1_000_000)
    header = {"stamp": {"sec": seconds, "nanosec": us * 1000}, "frame_id": msg.handle}
    codes = [e.code for e in msg.detail.errors] or ([msg.status.error_code] if msg.status.error_code else [])
    return json.dumps({"header": header, **_vals(msg.status), "error_codes": codes}) + "\n"


def _vals(status: RobotStatus) -> dict[str, dict[str, int]]:
    return {name: {"val": int(value)} for name, value in status._asdict().items() if name != "error_code"}


ROS_FORMATS: Final[dict[str, Callable[[RobotStatusMsg, int], str]]] = {"ros1": ros1, "ros2": ros2}
FORMATS: Final = ("native", *ROS_FORMATS)


class JsonLinesPublisher:
    """Writes lines to a file, or to standard output. A reader that is too slow loses lines, never the gateway time.

    Options: `path` (a file to append to; `-`, the default, is standard output), `format` (native, ros1, ros2),
    `changes_only` (no periodic lines). Raises BrokenPipeError once the reader has gone, LinkError if nothing can be
    written for another reason (a full disk).
    """

    @staticmethod
    def check_options(options: Mapping[str, object]) -> None:
        """Raises UsageError for an option that there is not, or that cannot be so."""
        unknown = sorted(set(options) - {"path", "format", "changes_only"})
        if unknown:
            raise UsageError(f"json: unknown option '{unknown[0]}'; there are path, format and changes_only")
        if options.get("format", "native") not in FORMATS:
            raise UsageError(f"json: format '{options['format']}' is none of {', '.join(FORMATS)}")
        if not isinstance(options.get("changes_only", False), bool):
            raise UsageError(f"json: changes_only must be true or false, not '{options['changes_only']}'")

    def __init__(self, context: PublisherContext) -> None:
        options = context.options
        self.check_options(options)
        path = str(options.get("path", "-"))
        self._format = str(options.get("format", "native"))
        self.periodic = not options.get("changes_only", False)
        if path == "-":
            self._fd, self._owned = context.stdout.fileno(), False
        else:
            try:
                self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NONBLOCK, 0o644)
            except OSError as error:
                raise LinkError(f"cannot write JSON lines to {path}: {error.strerror}") from None
            self._owned = True
        self._path = "standard output" if path == "-" else path
        self._patient = context.patient
        self._look_at = -math.inf
        self._waiting = 0
        self._lines: list[bytes] = []
        self._poll = select.poll()
        self._poll.register(self._fd, select.POLLOUT)
        self._rest = b""
        self._seq: dict[str, int] = {}
        self._bodies: dict[str, tuple[RobotStatus, Detail, str]] = {}

    def busy(self) -> bool:
        """True while an earlier line is not wholly written, or the reader has no room for another."""
        return not self._patient and (bool(self._rest) or not self._writable())

    @property
    def queued(self) -> int:
        """1 while a line is not wholly written."""
        return int(bool(self._rest))

    def publish(self, msg: RobotStatusMsg) -> None:
        """Write one line."""
        seq = self._seq.get(msg.handle, 0)
        self._seq[msg.handle] = seq + 1
        other = ROS_FORMATS.get(self._format)
        line = native(msg, seq, self._body(msg)) if other is None else other(msg, seq)
        if self._patient:
            self._collect(line.encode())
        else:
            self._rest = line.encode()
            self._write()

    def service(self, now: Instant) -> float | None:
        """Write the rest of a long line; notice that the reader has gone although there is nothing to write."""
        if self._rest:
            self._write()
        elif now.mono >= self._look_at and not self._patient:
            self._look_at = now.mono + LOOK
            self._writable()
        return now.mono + RETRY if self._rest else None

    def close(self) -> None:
        """Write the rest of a line if the reader takes it, and close a file of our own."""
        try:
            if self._rest:
                self._write()
            self._flush()
        finally:
            if self._owned:
                self._owned = False
                os.close(self._fd)

    def _body(self, msg: RobotStatusMsg) -> str:
        cached = self._bodies.get(msg.handle)
        if cached is not None and cached[0] is msg.status and cached[1] is msg.detail:
            return cached[2]
        body = native_body(msg.handle, msg.status, msg.detail)
        self._bodies[msg.handle] = (msg.status, msg.detail, body)
        return body

    def _writable(self) -> bool:
        events = self._poll.poll(0)
        if not events:
            return False
        if events[0][1] & (select.POLLERR | select.POLLHUP | select.POLLNVAL):
            raise BrokenPipeError("the reader of the JSON lines has gone")
        return True

    def _collect(self, line: bytes) -> None:
        """On replay lines are written many at a time."""
        self._lines.append(line)
        self._waiting += len(line)
        if self._waiting >= CHUNK:
            self._flush()

    def _flush(self) -> None:
        data = memoryview(b"".join(self._lines))
        self._lines.clear()
        self._waiting = 0
        while data:
            done = self._put(data)
            data = data[done:]
            if not done:
                self._poll.poll()

    def _write(self) -> None:
        """Write while the reader takes it, never more at once than cannot block."""
        while self._rest and self._writable():
            done = self._put(self._rest[:PIPE_BUF])
            self._rest = self._rest[done:]
            if not done:
                return

    def _put(self, data: bytes | memoryview) -> int:
        """The bytes that were written; 0 if there is no room now."""
        try:
            return os.write(self._fd, data)
        except BlockingIOError:
            return 0
        except BrokenPipeError:
            raise
        except OSError as error:
            raise LinkError(f"cannot write JSON lines to {self._path}: {error.strerror}") from None
