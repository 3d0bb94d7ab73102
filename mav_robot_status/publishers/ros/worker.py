"""The thread that publishes on ROS 2. The gateway's thread only appends to a queue."""

from __future__ import annotations

import logging
import random
import threading
from collections import deque
from typing import TYPE_CHECKING, Final, NamedTuple

from ...interface import Inhibit, RobotStatus, RobotStatusMsg
from ..error_reporter import ErrorReporter
from .messages import (
    DIAGNOSTIC_ARRAY,
    HARDWARE_STATUS,
    ROBOT_STATUS,
    diagnostic_array,
    hardware_status,
    robot_status,
)
from .naming import DIAGNOSTICS, Topics, beside
from .transport import Sample, UnreachableError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ...clock import Instant
    from .settings import Ros2Settings
    from .transport import Transport

log = logging.getLogger(__name__)

MOST_QUEUED: Final = 10_000
"""Messages that may wait for the thread, while the middleware blocks."""
TURN: Final = 1.0  # s between two looks at the connection
FIRST_WAIT, LONGEST_WAIT = 1.0, 5.0  # s between two attempts; doubled each time, with jitter
STEADY: Final = 10.0  # s after which a connection counts as steady and the wait is reset
SLOW: Final = 3.0
"""Seconds. A middleware that takes longer for one message has stalled, and drops messages without a word."""
CLOSING: Final = 3.0  # s to wait for the thread at the end


class Gone(NamedTuple):
    """A handle is gone: no message of it follows."""

    handle: str


class Worker:
    """Sends messages in their order. While the middleware is away, it keeps the last one of each handle."""

    def __init__(self, transport: Transport, settings: Ros2Settings, clock: Callable[[], Instant]) -> None:
        self._transport, self._clock = transport, clock
        self._errors = ErrorReporter("ros2", settings.name)
        self._topics = Topics(settings.namespace, settings.topic)
        self._with_hardware_status = settings.hardware_status
        self._changed = threading.Condition()
        self._queue: deque[RobotStatusMsg | Gone] = deque()
        self._full = self._stop = False
        self.dropped = 0
        """Messages that were not published. Other threads read it."""
        self._latest: dict[str, RobotStatusMsg] = {}
        self._unsent: set[str] = set()
        """Handles whose latest message is not published yet."""
        self._opened: float | None = None
        """When (monotonic seconds) the connection was opened; None while there is none."""
        self._wait, self._due = FIRST_WAIT, float("-inf")
        self._thread = threading.Thread(target=self._run, name="ros2", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    @property
    def queued(self) -> int:
        """Messages that wait for the thread."""
        return len(self._queue)

    def hand_over(self, items: Sequence[RobotStatusMsg | Gone]) -> None:
        """Append to the queue. A full queue loses its oldest messages; they are counted, and logged once."""
        if not self._thread.is_alive():  # it has failed or ended: nobody takes them
            return
        with self._changed:
            self._queue.extend(items)
            excess = len(self._queue) - MOST_QUEUED
            if excess > 0:
                self._drop_oldest(excess)
            self._changed.notify()

    def close(self) -> None:
        """Publish the remaining messages and an unknown status of each handle, then end the thread."""
        with self._changed:
            self._stop = True
            self._changed.notify()
        if self._thread.is_alive():
            self._thread.join(CLOSING)

    def _drop_oldest(self, excess: int) -> None:
        """A `Gone` stays: without it the handle would keep its topic."""
        messages = [number for number, item in enumerate(self._queue) if isinstance(item, RobotStatusMsg)]
        lost = set(messages[:excess])
        self._queue = deque(item for number, item in enumerate(self._queue) if number not in lost)
        self.dropped += len(lost)
        if not self._full:
            log.warning("ros2: more messages come than can be published: the oldest ones are dropped")
        self._full = True

    # -- the thread ----------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        try:
            while not self._stop:
                items = self._take()
                self._look()
                self._serve(items)
            self._part()
        except Exception:  # a bug here must not stop the gateway
            log.exception("ros2: the output has failed and is stopped; everything else continues")

    def _take(self) -> deque[RobotStatusMsg | Gone]:
        with self._changed:
            if not (self._queue or self._stop):
                self._changed.wait(TURN)
            items, self._queue = self._queue, deque()
            self._full = False
        return items

    def _serve(self, items: deque[RobotStatusMsg | Gone]) -> None:
        for item in items:
            if isinstance(item, Gone):
                self._forget(item.handle)
            else:
                self._publish(item)

    def _look(self) -> None:
        """Notice a lost connection. When an attempt is due, connect, and publish what was not published."""
        now = self._clock().mono
        if self._opened is None:
            if now >= self._due:
                self._open()
            return
        reason = self._transport.lost()
        if reason is not None:
            self._opened = None
            self._transport.close()
            self._open(reason)
        elif now - self._opened >= STEADY:
            self._wait = FIRST_WAIT
            self._errors.holds()

    def _open(self, lost: str | None = None) -> None:
        """Connect. `lost` is why the previous connection ended; it is logged only if the new one opens."""
        try:
            self._transport.open()
        except UnreachableError as error:
            self._lose(str(error))
            return
        if lost is not None:
            self._errors.fails(lost)
        self._opened = self._clock().mono
        self._errors.opens()
        for handle in sorted(self._latest):  # all: what was sent into a connection that was lost may not have arrived
            self._send(self._latest[handle])

    def _lose(self, reason: str) -> None:
        self._errors.fails(reason)
        self._opened = None
        self._transport.close()
        self._due = self._clock().mono + self._wait * random.uniform(0.7, 1.3)
        self._wait = min(2 * self._wait, LONGEST_WAIT)

    def _publish(self, msg: RobotStatusMsg) -> None:
        """Send a message now, or as the latest one of its handle when there is a connection again."""
        self.dropped += msg.handle in self._unsent
        self._latest[msg.handle] = msg
        self._unsent.add(msg.handle)
        if self._opened is not None:
            self._send(msg)

    def _send(self, msg: RobotStatusMsg) -> None:
        if self._opened is None:
            return
        before = self._clock().mono
        try:
            for sample in self._samples(msg):
                self._transport.send(sample)
        except UnreachableError as error:
            self._lose(str(error))
            return
        if self._clock().mono - before > SLOW:
            self._lose("it does not read what is sent")
            return
        self._unsent.discard(msg.handle)

    def _samples(self, msg: RobotStatusMsg) -> tuple[Sample, ...]:
        ns = msg.unix_us * 1000
        topic = self._topics.of(msg.handle)
        samples = (
            Sample(topic, ROBOT_STATUS, robot_status(msg), ns),
            Sample(DIAGNOSTICS, DIAGNOSTIC_ARRAY, diagnostic_array(msg), ns),
        )
        if not self._with_hardware_status:
            return samples
        return (*samples, Sample(beside(topic), HARDWARE_STATUS, hardware_status(msg, self._latest), ns))

    def _forget(self, handle: str) -> None:
        self._latest.pop(handle, None)
        self._unsent.discard(handle)
        topic = self._topics.forget(handle)
        if topic is None or self._opened is None:
            return
        try:
            self._transport.remove(topic)
            if self._with_hardware_status:
                self._transport.remove(beside(topic))
        except UnreachableError as error:
            self._lose(str(error))

    def _part(self) -> None:
        """Publish the remaining messages, then unknown statuses: ROS keeps no last message for others."""
        self._serve(self._take())
        now = self._clock()
        self._latest = {handle: unknown(msg, now) for handle, msg in self._latest.items()}
        for msg in self._latest.values():
            self._send(msg)
        self._transport.close()


def unknown(msg: RobotStatusMsg, now: Instant) -> RobotStatusMsg:
    """The last message of a handle: the gateway stops, so nothing is known of the robot."""
    why = Inhibit("LINK_STALE", "the gateway has stopped", now.unix_us)
    return RobotStatusMsg(msg.handle, now.unix_us, RobotStatus(), msg.detail.lost(why), None)
