"""A bounded queue of messages for another thread of the same process. `mav_robot_status.statuses` reads it."""

from __future__ import annotations

import threading
from collections import deque
from typing import Final

from ..interface import Options, Publisher, PublisherContext, RobotStatusMsg

MAX_MESSAGES: Final = 10_000


class QueuePublisher(Publisher):
    """Holds messages until another thread takes them. It has no options.

    On live links a full queue drops its oldest message and counts it, so a slow reader never delays the gateway. A
    replay waits for the reader and drops nothing.
    """

    periodic = True
    options_type = Options

    def __init__(self, context: PublisherContext) -> None:
        """Raises UsageError for an option: there are none."""
        Options.read("queue", context.options)
        self.dropped = 0
        """Messages dropped because the reader was too slow."""
        self._patient = context.patient
        self._messages: deque[RobotStatusMsg] = deque()
        self._changed = threading.Condition()
        self._ended = False

    def publish(self, msg: RobotStatusMsg) -> None:
        """Append the message."""
        with self._changed:
            while self._patient and len(self._messages) >= MAX_MESSAGES and not self._ended:
                self._changed.wait()
            if len(self._messages) >= MAX_MESSAGES:
                self._messages.popleft()
                self.dropped += 1
            self._messages.append(msg)
            self._changed.notify_all()

    def end(self) -> None:
        """No more messages follow. The reader still gets the waiting ones."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()

    def take(self) -> RobotStatusMsg | None:
        """Remove and return the oldest message; block until there is one. None: the queue has ended and is empty."""
        with self._changed:
            while not self._messages and not self._ended:
                self._changed.wait()
            if not self._messages:
                return None
            self._changed.notify_all()
            return self._messages.popleft()
