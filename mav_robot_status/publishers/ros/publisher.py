"""The `ros2` publisher: thins the messages of each handle, and hands them to its own thread."""

from __future__ import annotations

import math
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from ...clock import now as present
from ...errors import UsageError
from ...extras import install
from .settings import DDS, Ros2Options, read
from .worker import Gone, Worker

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ...clock import Instant
    from ...interface import Detail, PublisherContext, RobotStatus, RobotStatusMsg
    from .settings import Ros2Settings
    from .transport import Transport

SLACK: Final = 0.02  # s: a message this much early still counts as periodic


class _Published:
    """The last message of one handle that was handed over."""

    __slots__ = ("content", "due")

    def __init__(self) -> None:
        self.content: tuple[RobotStatus, Detail] | None = None
        self.due = -math.inf
        """When (monotonic seconds) the next one is due if nothing changes."""


class Ros2Publisher:
    """industrial_msgs/RobotStatus and diagnostics as ROS 2 topics.

    Raises UsageError for a wrong option and if the extra is not installed. A router that cannot be reached is not an
    error. A replay publishes nothing: a log does not have a robot's current status.
    """

    live_only = True

    options_type = Ros2Options
    check_options = staticmethod(read)

    def __init__(self, context: PublisherContext, clock: Callable[[], Instant] = present) -> None:
        settings = self.check_options(context.options)
        transport = transport_of(settings)
        self.periodic = settings.rate > 0
        self._period = 1 / settings.rate if self.periodic else math.inf
        self._published: dict[str, _Published] = {}
        self._waiting: list[RobotStatusMsg] = []
        self._worker = Worker(transport, settings, clock)
        if not context.patient:
            self._worker.start()

    def busy(self) -> bool:
        """Never: a full queue drops its oldest message."""
        return False

    @property
    def queued(self) -> int:
        """Messages that wait for the thread."""
        return self._worker.queued

    @property
    def dropped(self) -> int:
        """Messages that were not published: there was no connection, or the queue was full."""
        return self._worker.dropped

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hold the message until `service`, which follows every round of updates."""
        self._waiting.append(msg)

    def service(self, now: Instant) -> float | None:
        """Hand over each change, and else one message in a period for each handle."""
        if self._waiting:
            due = [msg for msg in self._waiting if self._is_due(msg, now.mono)]
            self._waiting.clear()
            if due:
                self._worker.hand_over(due)
        return None

    def forget(self, handle: str) -> None:
        """Remove the topic of a handle that is gone."""
        self._waiting = [msg for msg in self._waiting if msg.handle != handle]
        self._published.pop(handle, None)
        self._worker.hand_over([Gone(handle)])

    def close(self) -> None:
        """Publish the rest, and leave the network."""
        self._worker.close()

    def _is_due(self, msg: RobotStatusMsg, now: float) -> bool:
        """A change does not move the phase of the periodic messages."""
        last = self._published.get(msg.handle)
        if last is None:
            last = self._published[msg.handle] = _Published()
        content, before = (msg.status, msg.detail), last.content
        last.content = content
        if now >= last.due - SLACK:
            in_phase = now < last.due + self._period
            last.due = (last.due if in_phase else now) + self._period
            return True
        return content != before


def transport_of(settings: Ros2Settings) -> Transport:
    """The transport of the configured middleware. Raises UsageError if its extra is not installed."""
    with extra_of(settings):
        if settings.middleware == DDS:
            from .dds import DdsTransport

            return DdsTransport(settings)
        from .zenoh import ZenohTransport

        return ZenohTransport(settings)


@contextmanager
def extra_of(settings: Ros2Settings) -> Iterator[None]:
    """Import a middleware in this context. Raises UsageError if its extra is not installed."""
    try:
        yield
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("mav_robot_status"):
            raise
        extra = "ros2-dds" if settings.middleware == DDS else "ros2"
        raise UsageError(f"ros2: this output needs an extra: {install(extra)}") from None
