"""`IndustrialRobotStatusController`: publishes the status of a handle at a rate. It has no other logic.

A port of ros_control's industrial_robot_status_controller. Where it differs, a comment starts with `ORIGINAL:`;
`docs/explanation/controller.md` lists them.
"""

from __future__ import annotations

import logging
import math
import sys
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from .clock import Instant
from .errors import ConfigError
from .interface import (
    DEFAULT_HANDLE_NAME,
    Detail,
    IndustrialRobotStatusHandle,
    IndustrialRobotStatusInterface,
    InterfaceManager,
    Publisher,
    RobotStatus,
    RobotStatusMsg,
)

log = logging.getLogger(__name__)

DEFAULT_PUBLISH_RATE: Final = 10.0  # Hz
MOST_CHANGES: Final = 20  # messages a second on change, for each publisher
WINDOW: Final = 1.0  # s
RETRY: Final = 0.02  # s until a busy publisher is tried again


class _Output:
    """One publisher, and what was published to it."""

    __slots__ = ("changes", "due", "last", "publisher", "rests_until", "sent", "skipped", "waiting")

    def __init__(self, publisher: Publisher, start: float, rate: float, may_rest: bool) -> None:
        self.publisher = publisher
        self.rests_until: Callable[[str], float] | None = getattr(publisher, "rests_until", None) if may_rest else None
        self.last = start
        """When the last periodic message was due; it keeps the phase."""
        self.due = _strictly_after(start, rate)
        """When the next one is due; inf at a rate of 0 or less."""
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
        self._sent: tuple[RobotStatus, Detail] | None = None
        """What the handle held at the last update."""

    def init(self, hw: InterfaceManager, parameters: Mapping[str, object], publishers: Sequence[Publisher]) -> None:
        """Read the parameters and find the handle. The log names each default that is used.

        Raises ConfigError for a parameter of the wrong type, UnknownHandleError if no handle has that name.
        """
        # ORIGINAL: a rate of a wrong type is the default. Here it is an error: a typing mistake must not be a rate.
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
        # ORIGINAL: returns false for an unknown handle. Here it raises, because nobody reads a return value.
        # ORIGINAL: copies the handle. Here it is the registered one, which may be removed.
        self.handle = hw.get(IndustrialRobotStatusInterface).get_handle(name)
        self._publishers = publishers

    def starting(self, time: Instant) -> None:
        """Start publishing. The first periodic message is due one period after `time`."""
        on_change = self.publish_on_change  # otherwise a periodic message is the first that shows a change
        self._outputs = [_Output(p, time.mono, self.publish_rate, on_change) for p in self._publishers]

    def update(self, time: Instant, period: float) -> None:
        """Publish what is due at `time`. `period` (seconds since the last update) is ros_control's; it is not used.

        ORIGINAL: publishes periodically only. Here a change is published at once, at most 20 times a second. It does
        not move the periodic phase.
        """
        handle = self.handle
        status, detail, now = handle.status, handle.detail, time.mono
        if self._sent is None or self._sent[0] is not status or self._sent[1] is not detail:
            self._sent = status, detail
        msg: RobotStatusMsg | None = None
        for output in self._outputs:
            due = now >= output.due and output.publisher.periodic
            if due and output.rests_until is not None:
                due = now >= output.rests_until(handle.name)
            if not due and not (self._has_changed(output) and self._may_change(output, now)):
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
                boot_s = None if handle.booted_at is None else now - handle.booted_at
                msg = RobotStatusMsg(handle.name, time.unix_us, status, detail, age, boot_s)
            output.sent = self._sent
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
        last, handle = self._sent, self.handle
        if last is not None and (last[0] is not handle.status or last[1] is not handle.detail):
            last = None
        for output in self._outputs:
            if output.due < due and output.publisher.periodic:
                wanted = output.due if output.rests_until is None else output.rests_until(handle.name)
                due = min(due, max(output.due, wanted))
            if (output.sent is not last or last is None) and self._has_changed(output):
                full = len(output.changes) == MOST_CHANGES
                due = min(due, output.changes[0] + WINDOW if full else now)
        return max(due, now + RETRY) if due <= now else due

    def _has_changed(self, output: _Output) -> bool:
        """Whether a change waits to be published."""
        if not self.publish_on_change:
            return False
        sent, handle = output.sent, self.handle
        if sent is None:
            return True
        status, detail = sent  # usually the same objects, which need no comparison
        return (status is not handle.status and status != handle.status) or (
            detail is not handle.detail and detail != handle.detail
        )

    def _keep_phase(self, output: _Output, now: float) -> None:
        """The next period begins where this one was due, not where it was published."""
        period = 1 / self.publish_rate
        output.last = last = output.last + period
        # ORIGINAL: advances by one period only, so a burst of all missed messages follows a stall.
        if last + period < now:
            output.last = last = now - math.fmod(now - last, period)
        output.due = math.nextafter(last + period, math.inf)

    def _may_change(self, output: _Output, now: float) -> bool:
        changes = output.changes
        return len(changes) < MOST_CHANGES or now >= changes[0] + WINDOW


def _strictly_after(last: float, rate: float) -> float:
    """The first time that is strictly later than a period after `last`; never at a rate of 0 or less."""
    return math.nextafter(last + 1 / rate, math.inf) if rate > 0 else math.inf


def _number(rate: object) -> float:
    """The parameter `publish_rate`. Raises ConfigError."""
    if isinstance(rate, int | float) and not isinstance(rate, bool) and abs(rate) <= sys.float_info.max:
        return float(rate)
    raise ConfigError(f"publish_rate: must be a number of Hz, not {rate!r}")
