"""The `mqtt` publisher: writes each change to disk at once, and hands statuses to its own thread."""

from __future__ import annotations

import json
import logging
import secrets
from typing import TYPE_CHECKING, Final

from ...clock import now as present
from ...errors import UsageError
from ...extras import install
from ...interface import Detail, Publisher, PublisherContext, RobotStatus, RobotStatusMsg
from .lines import event_of, members_of
from .naming import Naming
from .settings import MqttOptions, read

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...clock import Instant
    from ...json_object import JsonObject
    from .worker import Worker

log = logging.getLogger(__name__)

PERIOD: Final = 1.0  # s between two statuses of a robot if nothing changes
SLACK: Final = 0.02  # s: a status this much early still counts as periodic


class _Published:
    """The last publication of one handle."""

    __slots__ = ("content", "members", "robot", "sent_at", "seq")

    def __init__(self, robot: str) -> None:
        self.robot = robot
        self.content: tuple[RobotStatus, Detail] | None = None
        self.members: JsonObject = {}
        """The members of `content`, as its last event has them."""
        self.seq = 0
        """The number of its last event."""
        self.sent_at = float("-inf")
        """When (monotonic seconds) its last status was handed over."""


class MqttPublisher(Publisher):
    """Statuses, events and connection states of robots on an MQTT broker.

    Options: see docs/reference/mqtt.md. Raises UsageError for a wrong option and if the extra is not installed,
    LinkError if the spool cannot be opened. A broker that cannot be reached is not an error. A replay publishes
    nothing: a log does not have a robot's current status.
    """

    periodic = True
    live_only = True
    durable = True

    options_type = MqttOptions
    check_options = staticmethod(read)

    def __init__(self, context: PublisherContext, clock: Callable[[], Instant] = present) -> None:
        options = self.check_options(context.options)
        self._naming = Naming(options.robot)
        try:
            from . import worker
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("mav_robot_status"):
                raise
            raise UsageError(f"mqtt: this output needs an extra: {install('mqtt')}") from None
        self._session = secrets.token_hex(4)
        self._published: dict[str, _Published | None] = {}
        self._names: dict[str, str] = {}
        """Handles by the name of their robot."""
        self._statuses: dict[str, RobotStatusMsg] = {}
        self._waiting: list[tuple[_Published, RobotStatusMsg]] = []
        self._worker: Worker | None = None
        if not context.patient:
            self._worker = worker.Worker(options, clock)
            self._worker.start()

    @property
    def queued(self) -> int:
        """Events that the broker has not acknowledged."""
        return self._worker.waiting if self._worker else 0

    @property
    def dropped(self) -> int:
        """Events that were deleted undelivered: they exceeded the limit of size or age."""
        return self._worker.dropped if self._worker else 0

    def publish(self, msg: RobotStatusMsg) -> None:
        """Write a change to disk. It is then delivered, or counted as dropped, even after a kill of the process.

        The status waits until `service`, which follows every round of updates.
        """
        last = self._of(msg) if self._worker else None
        if last is None or self._worker is None:
            return
        content = (msg.status, msg.detail)
        if content != last.content:
            before, last.content, last.members = last.members, content, members_of(msg)
            last.seq += 1
            last.sent_at = float("-inf")
            event = event_of(msg, before, last.members, last.robot, self._session, last.seq)
            self._worker.add(last.robot, json.dumps(event), msg.unix_us / 1e6)
        self._waiting.append((last, msg))

    def service(self, now: Instant) -> float | None:
        """Hand over the status of each robot once in a PERIOD, and after a change."""
        for last, msg in self._waiting:
            if last.robot in self._statuses or now.mono - last.sent_at >= PERIOD - SLACK:
                last.sent_at = now.mono
                self._statuses[last.robot] = msg
        self._waiting.clear()
        if self._worker and self._statuses:
            self._worker.hand_over(self._statuses)
            self._statuses = {}
        return None

    def forget(self, handle: str) -> None:
        """End the connection of a handle that is gone. Its name is free for another robot."""
        last = self._published.pop(handle, None)
        if last is None or self._worker is None:
            return
        self._waiting = [(one, msg) for one, msg in self._waiting if one is not last]
        self._statuses.pop(last.robot, None)
        del self._names[last.robot]
        self._published = {name: one for name, one in self._published.items() if one is not None}
        self._worker.forget(last.robot)

    def close(self) -> None:
        """End the thread. Undelivered events wait on disk."""
        if self._worker:
            self._worker.close()

    def _of(self, msg: RobotStatusMsg) -> _Published | None:
        """The last publication of a message's handle; None if its robot has no name, or the name of another robot."""
        if msg.handle not in self._published:
            name = self._naming.name(msg)
            if name is None:
                return None
            other = self._names.setdefault(name, msg.handle)
            if other != msg.handle:
                log.warning(
                    "mqtt: '%s' and '%s' both have the robot name '%s': the second is not published; give each its "
                    "own name, for example --mqtt-robot {host}-{system}-{component}",
                    other, msg.handle, name,
                )  # fmt: skip
            self._published[msg.handle] = _Published(name) if other == msg.handle else None
        return self._published[msg.handle]
