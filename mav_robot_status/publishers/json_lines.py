"""Statuses as JSON, one object a line: the native form, or the literal industrial_msgs/RobotStatus of ROS."""

from __future__ import annotations

import json
import math
import os
import select
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Final, Literal

from ..clock import rfc3339
from ..errors import LinkError
from ..interface import FIELDS, Kind, RobotMode, TriState
from ..interface.options import Option, Options

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from ..clock import Instant
    from ..interface import Detail, PublisherContext, RobotStatus, RobotStatusMsg, Vehicle

PIPE_BUF: Final = 4096
"""Bytes that a pipe which poll() calls writable takes without blocking (PIPE_BUF of Linux)."""
CHUNK: Final = 1 << 16  # bytes written at once on replay
RETRY: Final = 0.005  # s until a full pipe is tried again
LOOK: Final = 1.0  # s between two checks of an idle reader
WORDS: Final[dict[Kind, Mapping[int, str]]] = {
    Kind.MODE: {mode: f'"{mode.name}"' for mode in RobotMode},
    Kind.TRI_STATE: {TriState.UNKNOWN: "null", TriState.FALSE: "false", TriState.TRUE: "true"},
}
"""The JSON of each value, by the kind of its field. A code is its own number."""
MEMBERS: Final = tuple((f'"{field.name}": ', WORDS.get(field.kind)) for field in FIELDS)
"""The name of each field, and the JSON of its values."""


def native_body(handle: str, status: RobotStatus, detail: Detail) -> str:
    """A native line without stamp, seq and heartbeat_age: the part that changes only with the status.

    The text ends after link.state, so that `native` can append heartbeat_age. The encoder of `json` is slow. It runs
    for new parts only, which keeps the delay of a changed line short.
    """
    errors = [{"code": e.code, "name": e.name, "text": e.text, "since": rfc3339(e.since_us)} for e in detail.errors]
    inhibits = [{"name": i.name, "text": i.text, "since": rfc3339(i.since_us)} for i in detail.inhibits]
    return (
        f"{_who(handle, detail.system, detail.component)}, {_fields(status)}, "
        f'"errors": {json.dumps(errors) if errors else "[]"}, '
        f'"inhibits": {json.dumps(inhibits) if inhibits else "[]"}, '
        f'"vehicle": {_vehicle(detail.vehicle)}, "link": {{"state": "{detail.link.value}"'
    )


@lru_cache(maxsize=256)
def _who(handle: str, system: int | None, component: int | None) -> str:
    return json.dumps({"handle": handle, "system": system, "component": component})[1:-1]


@lru_cache(maxsize=256)
def _fields(status: RobotStatus) -> str:
    return ", ".join(
        name + (str(value) if words is None else words[value])
        for (name, words), value in zip(MEMBERS, status, strict=True)
    )


@lru_cache(maxsize=256)
def _vehicle(vehicle: Vehicle) -> str:
    return json.dumps(vehicle.members())


def native(msg: RobotStatusMsg, seq: int, body: str) -> str:
    """The native line."""
    age = "null" if msg.heartbeat_age is None else f"{max(0.0, msg.heartbeat_age):.3f}"
    return f'{{"stamp": "{rfc3339(msg.unix_us)}", "seq": {seq}, {body}, "heartbeat_age": {age}}}}}\n'


def ros1(msg: RobotStatusMsg, seq: int) -> str:
    """industrial_msgs/RobotStatus of ROS 1; frame_id is the handle's name."""
    seconds, us = divmod(msg.unix_us, 1_000_000)
    header = {"seq": seq, "stamp": {"secs": seconds, "nsecs": us * 1000}, "frame_id": msg.handle}
    return json.dumps({"header": header, **_ros_fields(msg.status, "ros1")}) + "\n"


def ros2(msg: RobotStatusMsg, seq: int) -> str:
    """industrial_msgs/RobotStatus of ROS 2: every active error code, none while there is no error."""
    seconds, us = divmod(msg.unix_us, 1_000_000)
    header = {"stamp": {"sec": seconds, "nanosec": us * 1000}, "frame_id": msg.handle}
    codes = [e.code for e in msg.detail.errors] or ([msg.status.error_code] if msg.status.error_code else [])
    return json.dumps({"header": header, **_ros_fields(msg.status, "ros2", codes)}) + "\n"


def _ros_fields(
    status: RobotStatus, wire: Literal["ros1", "ros2"], codes: list[int] | None = None
) -> dict[str, object]:
    """The fields of industrial_msgs, by its names. `codes` replaces the error code where the message has a list."""
    named = ((getattr(field.row, wire), field.kind, value) for field, value in zip(FIELDS, status, strict=True))
    return {
        name: {"val": int(value)} if kind is not Kind.CODE else value if codes is None else codes
        for name, kind, value in named
        if name is not None
    }


ROS_FORMATS: Final[dict[str, Callable[[RobotStatusMsg, int], str]]] = {"ros1": ros1, "ros2": ros2}
FORMATS: Final = ("native", *ROS_FORMATS)


@dataclass(frozen=True)
class JsonOptions(Options):
    """The options of the publisher `json`."""

    path: Annotated[str, Option("file to append the JSON lines to (-: standard output)", "--json", "FILE|-|none")] = "-"
    format: Annotated[str, Option("form of the JSON lines (native)", "--format", choices=FORMATS)] = "native"
    changes_only: Annotated[bool, Option("JSON lines only on change", "--changes-only")] = False


class JsonLinesPublisher:
    """Writes lines to a file or to standard output. A slow reader loses lines; it never blocks the gateway.

    Raises BrokenPipeError after the reader has closed its end, LinkError for every other failure (a full disk).
    """

    options_type = JsonOptions

    def __init__(self, context: PublisherContext) -> None:
        options = JsonOptions.read("json", context.options)
        path = options.path
        self._format = options.format
        self.periodic = not options.changes_only
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
        """True while an earlier line is written in part, or the pipe is full."""
        return not self._patient and (bool(self._rest) or not self._writable())

    @property
    def queued(self) -> int:
        """1 while a line is written in part."""
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
        """Write the rest of a long line. Check whether an idle reader has closed its end."""
        if self._rest:
            self._write()
        elif now.mono >= self._look_at and not self._patient:
            self._look_at = now.mono + LOOK
            self._writable()
        return now.mono + RETRY if self._rest else None

    def forget(self, handle: str) -> None:
        """Release what belongs to a handle that is gone."""
        self._seq.pop(handle, None)
        self._bodies.pop(handle, None)

    def close(self) -> None:
        """Write the rest of a line if the pipe has room, and close the file."""
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
            raise BrokenPipeError("the reader of the JSON lines has closed its end")
        return True

    def _collect(self, line: bytes) -> None:
        """Collect a line. A replay writes many lines at once."""
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
        """Write while the pipe has room, at most PIPE_BUF bytes at once, so that no write blocks."""
        while self._rest and self._writable():
            done = self._put(self._rest[:PIPE_BUF])
            self._rest = self._rest[done:]
            if not done:
                return

    def _put(self, data: bytes | memoryview) -> int:
        """The number of bytes written; 0 if the pipe is full."""
        try:
            return os.write(self._fd, data)
        except BlockingIOError:
            return 0
        except BrokenPipeError:
            raise
        except OSError as error:
            raise LinkError(f"cannot write JSON lines to {self._path}: {error.strerror}") from None
