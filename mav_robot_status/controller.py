"""`IndustrialRobotStatusController`: publishes the status of a handle at a rate. It has no other logic.

A port of ros_control's industrial_robot_status_controller. Where it differs, a comment starts with `ORIGINAL:`;
`docs/explanation/controller.md` lists them.
"""

from __future__ import annotations

import logging
import math
import sys
from collections import deque
from typing import TYPE_CHECKING, Final

from .errors import ConfigError
from .interface import DEFAULT_HANDLE_NAME, IndustrialRobotStatusHandle, IndustrialRobotStatusInterface, RobotStatusMsg

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from .clock import Instant
    from .interface import Detail, InterfaceManager, Publisher, RobotStatus

log = logging.getLogger(__name__)

DEFAULT_PUBLISH_RATE: Final = 10.0  # Hz
MOST_CHANGES: Final = 20  # messages a second on change, for each publisher
WINDOW: Final = 1.0  # s
RETRY: Final = 0.02  # s until a busy publisher is tried again


class _Output:
    """One publisher, and what was published to it."""

    __slots__ = ("changes", "last", "publisher", "sent", "skipped", "waiting")

    def __init__(self, publisher: Publisher, start: float) -> None:
        self.publisher = publisher
        self.last = start
        """When the last periodic message was due; it keeps the phase."""
        self.sent: tuple[RobotStatus, Detail] | None = None
        self.changes: deque[float] = deque(maxlen=MOST_CHANGES)
        self.waiting = False
        self.skipped = 0
        """How often the publisher was busy when a message was due."""


class IndustrialRobotStatusController:
    """Publishes the status of one handle periodically, and on change."""

    def __init__(self) -> None:
        self.publish_rate = DEFAULT_PUBLISH_RATE
        self.publish_on_change = True
        self.handle: IndustrialRobotStatusHandle
        self._publishers: Sequence[Publisher] = ()
        self._outputs: list[_Output] = []

    def init(self, hw: InterfaceManager, parameters: Mapping[str, object], publishers: Sequence[Publisher]) -> None:
        """Read the parameters and find the handle. The log names each default that is used.

        Raises ConfigError for a parameter of the wrong type, UnknownHandleError if no handle has that name.
        """
        rate = parameters.get("publish_rate")
        if rate is None:
            log.info("'publish_rate' not set, using default: %g Hz", DEFAULT_PUBLISH_RATE)
        else:
            self.publish_rate = _number(rate)
        name = parameters.get("handle_name")
        if name is None:
            name = DEFAULT_HANDLE_NAME
            log.info("'handle_name' not set, using default: '%s'", name)
        elif not isinstance(name, str):
            raise ConfigError(f"handle_name: must be a text, not {name!r}")
        on_change = parameters.get("publish_on_change", True)
        if not isinstance(on_change, bool):
            raise ConfigError(f"publish_on_change: must be true or false, not {on_change!r}")
        self.publish_on_change = on_change
        self.handle = hw.get(IndustrialRobotStatusInterface).get_handle(name)
        self._publishers = publishers

    def starting(self, time: Instant) -> None:
        """Start publishing. The first periodic message is due one period after `time`."""
        self._outputs = [_Output(publisher, time.mono) for publisher in self._publishers]

    def update(self, time: Instant, period: float) -> None:
        """Publish what is due at `time`. `period` (seconds since the last update) is ros_control's; it is not used.

        ORIGINAL: publishes periodically only. Here a change is published at once, at most 20 times a second. It does
        not move the periodic phase.
        """
        handle = self.handle
        now = time.mono
        msg: RobotStatusMsg | None = None
        for output in self._outputs:
            sent = output.sent
            changed = self.publish_on_change and (
                sent is None
                or (sent[0] is not handle.status and sent[0] != handle.status)
                or (sent[1] is not handle.detail and sent[1] != handle.detail)
            )
            due = self._is_due(output, now)
            if not due and not (changed and self._may_change(output, now)):
                continue
            if output.publisher.busy():
                # ORIGINAL: skips a busy publisher too, but does not count it.
                output.skipped += not output.waiting
                output.waiting = True
                continue
            output.waiting = False
            if due:
                self._keep_phase(output, now)
            else:
                output.changes.append(now)
            if msg is None:
                age = None if handle.heard_at is None else now - handle.heard_at
                msg = RobotStatusMsg(handle.name, time.unix_us, handle.status, handle.detail, age)
            output.sent = (handle.status, handle.detail)
            output.publisher.publish(msg)

    def stopping(self, time: Instant) -> None:
        """Stop publishing. The log gives the number of skipped messages."""
        skipped = sum(output.skipped for output in self._outputs)
        if skipped:
            log.warning("%s: an output was busy %d times, and messages were skipped", self.handle.name, skipped)
        self._outputs = []

    def skipped(self, publisher: Publisher) -> int:
        """How often this publisher was busy when a message was due, since `starting`."""
        return sum(output.skipped for output in self._outputs if output.publisher is publisher)

    def next_due(self, now: float) -> float:
        """When (monotonic seconds) `update` has something to do, unless the handle changes first.

        The gateway calls this after each `update`, and calls `update` again at that time or when the handle changes.
        """
        due = math.inf
        for output in self._outputs:
            if self.publish_rate > 0 and output.publisher.periodic:
                # strictly later than due, see _is_due
                due = min(due, math.nextafter(output.last + 1 / self.publish_rate, math.inf))
            if self.publish_on_change and output.sent != (self.handle.status, self.handle.detail):
                full = len(output.changes) == MOST_CHANGES
                due = min(due, output.changes[0] + WINDOW if full else now)
        return max(due, now + RETRY) if due <= now else due

    def _is_due(self, output: _Output, now: float) -> bool:
        """Strictly later than a period after the last periodic message; never at a rate of 0 or less."""
        rate = self.publish_rate
        return rate > 0 and output.publisher.periodic and output.last + 1 / rate < now

    def _keep_phase(self, output: _Output, now: float) -> None:
        """The next period begins where this one was due, not where it was published."""
        period = 1 / self.publish_rate
        output.last += period
        # ORIGINAL: advances by one period only, so a burst of all missed messages follows a stall.
        if output.last + period < now:
            output.last = now - math.fmod(now - output.last, period)

    def _may_change(self, output: _Output, now: float) -> bool:
        changes = output.changes
        return len(changes) < MOST_CHANGES or now >= changes[0] + WINDOW


def _number(rate: object) -> float:
    """The parameter `publish_rate`. Raises ConfigError."""
    if isinstance(rate, int | float) and not isinstance(rate, bool) and abs(rate) <= sys.float_info.max:
        return float(rate)
    raise ConfigError(f"publish_rate: must be a number of Hz, not {rate!r}")
