"""Statuses as JSON, one object a line: the native form, or the literal industrial_msgs/RobotStatus of ROS."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Final, Literal

from ..clock import Instant, rfc3339
from ..interface import (
    FIELDS,
    Detail,
    Kind,
    PublisherContext,
    RobotStatus,
    RobotStatusMsg,
)
from ..interface.options import Option, Options
from ..json_object import JsonObject
from .line_output import LineOutput, PatientLineOutput


def members(handle: str, status: RobotStatus, detail: Detail) -> JsonObject:
    """The members of a native line that change only with the status: all but stamp, seq and heartbeat_age."""
    return {
        "handle": handle,
        "system": detail.system,
        "component": detail.component,
        **{field.name: field.plain(value) for field, value in zip(FIELDS, status, strict=True)},
        "errors": [error.members() for error in detail.errors],
        "inhibits": [inhibit.members() for inhibit in detail.inhibits],
        "vehicle": detail.vehicle.members(),
        **detail.group_members(),
        "link": {"state": detail.link.value},
    }


def native_body(handle: str, status: RobotStatus, detail: Detail) -> str:
    """The text of `members`, without the brackets around it: it ends after link.state, where `native` continues."""
    body = json.dumps(members(handle, status, detail))[1:-2]
    return body.replace("\x7f", r"\u007f")  # the one control character that JSON does not escape


def native(msg: RobotStatusMsg, seq: int, body: str) -> str:
    """The native line."""
    age = "null" if msg.heartbeat_age is None else f"{max(0.0, msg.heartbeat_age):.3f}"
    boot = "" if msg.boot_s is None else f'"boot_s": {msg.boot_s:.3f}, '
    return f'{{"stamp": "{rfc3339(msg.unix_us)}", {boot}"seq": {seq}, {body}, "heartbeat_age": {age}}}}}\n'


def ros1(msg: RobotStatusMsg, seq: int) -> str:
    """industrial_msgs/RobotStatus of ROS 1; frame_id is the handle's name."""
    seconds, us = divmod(msg.unix_us, 1_000_000)
    header = {"seq": seq, "stamp": {"secs": seconds, "nsecs": us * 1000}, "frame_id": msg.handle}
    return json.dumps({"header": header, **_ros_fields(msg.status, "ros1")}) + "\n"


def ros2(msg: RobotStatusMsg, seq: int) -> str:
    """industrial_msgs/RobotStatus of ROS 2: every active error code, none while there is no error."""
    seconds, us = divmod(msg.unix_us, 1_000_000)
    header = {"stamp": {"sec": seconds, "nanosec": us * 1000}, "frame_id": msg.handle}
    codes = error_codes(msg.status, msg.detail)
    return json.dumps({"header": header, **_ros_fields(msg.status, "ros2", codes)}) + "\n"


def error_codes(status: RobotStatus, detail: Detail) -> list[int]:
    """`error_codes` of ROS 2: every active code, the most important first."""
    return [e.code for e in detail.errors] or ([status.error_code] if status.error_code else [])


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


class Bodies:
    """The text of each handle's latest status: most lines repeat the line before."""

    def __init__(self) -> None:
        self._latest: dict[str, tuple[RobotStatus, Detail, str]] = {}

    def of(self, msg: RobotStatusMsg) -> str:
        """`native_body` of a message."""
        cached = self._latest.get(msg.handle)
        if cached is not None and cached[0] is msg.status and cached[1] is msg.detail:
            return cached[2]
        body = native_body(msg.handle, msg.status, msg.detail)
        self._latest[msg.handle] = (msg.status, msg.detail, body)
        return body

    def forget(self, handle: str) -> None:
        """Release what belongs to a handle that is gone."""
        self._latest.pop(handle, None)


class JsonLinesPublisher:
    """Writes lines to a file or to standard output. A slow reader loses lines; it never blocks the gateway.

    A replay waits for a slow reader instead. Raises BrokenPipeError after the reader of standard output has closed its
    end, and LinkError if the output cannot be opened, or if it fails in a replay.
    """

    options_type = JsonOptions

    def __init__(self, context: PublisherContext) -> None:
        options = JsonOptions.read("json", context.options)
        self._format = options.format
        self.periodic = not options.changes_only
        output = PatientLineOutput if context.patient else LineOutput
        self._output: LineOutput | PatientLineOutput = output(options.path, context.stdout)
        self._seq: dict[str, int] = {}
        self._bodies = Bodies()

    def busy(self) -> bool:
        """True while an earlier line is written in part, or the pipe is full."""
        return self._output.busy()

    @property
    def queued(self) -> int:
        """The lines that wait."""
        return self._output.queued

    @property
    def dropped(self) -> int:
        """The lines that are missing because the output failed."""
        return self._output.dropped

    def publish(self, msg: RobotStatusMsg) -> None:
        """Write one line."""
        seq = self._seq.get(msg.handle, 0)
        self._seq[msg.handle] = seq + 1
        other = ROS_FORMATS.get(self._format)
        line = native(msg, seq, self._bodies.of(msg)) if other is None else other(msg, seq)
        self._output.write(msg.handle, line.encode())

    def service(self, now: Instant) -> float | None:
        """Write what waits. Check whether an idle reader has closed its end."""
        return self._output.service(now)

    def forget(self, handle: str) -> None:
        """Release what belongs to a handle that is gone."""
        self._seq.pop(handle, None)
        self._bodies.forget(handle)

    def close(self) -> None:
        """Write the rest of a line if the pipe has room, and close the file."""
        self._output.close()
