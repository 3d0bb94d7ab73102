"""The `mcap` publisher: statuses in files, for Foxglove and rosbag tools.

A chunk is written once a second and at CHUNK bytes, so a crash loses at most that. A file that exists is never
overwritten: `status.mcap` is followed by `status-2.mcap`.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ...data_files import data_file
from ...errors import LinkError, UsageError
from ...extras import install
from ..json_lines import Bodies, native
from ..ros.definitions import DEFINITIONS
from ..ros.messages import DIAGNOSTIC_ARRAY, ROBOT_STATUS, MessageType, diagnostic_array, robot_status
from ..ros.naming import DIAGNOSTICS, Topics
from .settings import McapOptions, read

if TYPE_CHECKING:
    from ...clock import Instant
    from ...interface import PublisherContext, RobotStatusMsg
    from .file import File, Schema

log = logging.getLogger(__name__)

FLUSH: Final = 1.0  # s until a chunk that is not full is written
RETRY: Final = 5.0  # s until a new file is begun after a failure


class McapPublisher:
    """Writes each message to an MCAP file. A file that fails is followed by a new one; what is lost is counted.

    Raises UsageError for a wrong option and if the extra is not installed, LinkError if the file cannot be created, or
    if it fails in a replay.
    """

    periodic = True

    options_type = McapOptions
    check_options = staticmethod(read)

    def __init__(self, context: PublisherContext) -> None:
        options, self._limits = self.check_options(context.options)
        try:
            from . import file as files
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("mav_robot_status"):
                raise
            raise UsageError(f"mcap: this output needs an extra: {install('mcap')}") from None
        self._files = files
        self._path = Path(options.path)
        self._ros2 = options.format == "ros2"
        self._patient = context.patient
        self._number = 1
        self._bodies = Bodies()
        self._seq: dict[str, int] = {}
        self._topics = Topics("", "robot_status")
        self._schema = files.Schema(
            "mav_robot_status.RobotStatus",
            "jsonschema",
            data_file("robot_status.schema.json", "mav_robot_status/data").read_bytes(),
            "json",
        )
        self._flush_at = self._retry_at = math.inf
        self.dropped = 0
        """Messages that are in no file."""
        self._file: File | None = None
        try:
            self._file = self._next_file()
        except OSError as error:
            raise LinkError(f"cannot write MCAP to {options.path}: {error.strerror}") from None

    @property
    def queued(self) -> int:
        """Messages that wait for the end of their chunk."""
        return 0 if self._file is None else self._file.waiting

    def busy(self) -> bool:
        """Never: the file system takes what is written."""
        return False

    def publish(self, msg: RobotStatusMsg) -> None:
        """Add one message, or two of ROS 2."""
        seq = self._seq.get(msg.handle, 0)
        self._seq[msg.handle] = seq + 1
        if self._file is not None and self._is_full(self._file, msg.unix_us):
            self._guarded(self._split)
        if self._file is None:
            self.dropped += 1
            return
        self._guarded(lambda file: self._add(file, msg, seq))

    def service(self, now: Instant) -> float | None:
        """Write the chunk if it is time, and begin a new file after a failure."""
        if self._file is None:
            if self._retry_at == math.inf:
                self._retry_at = now.mono + RETRY
            elif now.mono >= self._retry_at:
                self._begin()
            return self._retry_at if self._file is None else None
        if not self._file.waiting or self._patient:
            self._flush_at = math.inf
            return None
        if self._flush_at == math.inf:
            self._flush_at = now.mono + FLUSH
        elif now.mono >= self._flush_at:
            self._flush_at = math.inf
            self._guarded(self._files.File.flush)
            return None
        return self._flush_at

    def forget(self, handle: str) -> None:
        """Release what belongs to a handle that is gone."""
        self._seq.pop(handle, None)
        self._bodies.forget(handle)
        self._topics.forget(handle)

    def close(self) -> None:
        """Finish the file. A second call does nothing."""
        if self._file is not None:
            self._guarded(self._files.File.finish)
        if self._file is not None:
            self._file.close()
            self._file = None

    def _is_full(self, file: File, us: int) -> bool:
        return file.first_us is not None and (us - file.first_us >= self._limits.us or file.size >= self._limits.size)

    def _split(self, file: File) -> None:
        file.finish()
        self._file = self._next_file()
        file.close()

    def _add(self, file: File, msg: RobotStatusMsg, seq: int) -> None:
        if self._ros2:
            file.add(self._topics.of(msg.handle), self._ros_schema(ROBOT_STATUS), msg.unix_us, robot_status(msg), seq)
            file.add(DIAGNOSTICS, self._ros_schema(DIAGNOSTIC_ARRAY), msg.unix_us, diagnostic_array(msg), seq)
            return
        topic = f"/{msg.handle}/robot_status".encode("utf-8", "replace").decode()
        file.add(topic, self._schema, msg.unix_us, native(msg, seq, self._bodies.of(msg)).encode(), seq)

    def _ros_schema(self, kind: MessageType) -> Schema:
        return self._files.Schema(kind.ros_name, "ros2msg", DEFINITIONS[kind.ros_name].encode(), "cdr")

    def _next_file(self) -> File:
        """Create the next file whose name is free."""
        while True:
            path = self._path
            if self._number > 1:
                path = path.with_name(f"{path.stem}-{self._number}{path.suffix}")
            try:
                made = self._files.File(path, "ros2" if self._ros2 else "")
            except FileExistsError:
                self._number += 1
                continue
            self._number += 1
            log.info("mcap: writing %s", path)
            return made

    def _begin(self) -> None:
        try:
            self._file = self._next_file()
        except OSError:
            self._retry_at = math.inf
            return
        log.warning("mcap: writing again, to %s; %d messages are in no file", self._file.path, self.dropped)
        self._retry_at = math.inf

    def _guarded(self, step: Callable[[File], None]) -> None:
        """Run a step on the file. A failure ends the file. Raises LinkError in a replay."""
        file = self._file
        assert file is not None
        try:
            step(file)
        except OSError as error:
            self.dropped += file.waiting
            file.close()
            self._file, self._retry_at = None, math.inf
            reason = error.strerror or str(error)
            if self._patient:
                raise LinkError(f"cannot write MCAP to {file.path}: {reason}") from None
            log.warning("mcap: %s: %s; a new file follows when that works", file.path, reason)
