"""Contains the faults of a third party's hardware interface: exceptions, slow calls, floods and invalid values.

Everything runs in one thread, so a call that blocks cannot be interrupted. After a slow call the interface is not
called for several times the length of that call. So the other interfaces always get most of the time.
"""

from __future__ import annotations

import logging
import math
import time
from typing import TYPE_CHECKING, Final, TypeVar

from . import Guard
from .handle_check import HandleCheck

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ...clock import Instant
    from ...interface import HardwareInterface, IoSource

log = logging.getLogger(__name__)

T = TypeVar("T")

SLOW: Final = 0.1
"""A call that takes more seconds is slow."""
PAUSE: Final = 4.0
"""Length of the pause after a slow call, as a multiple of the call."""
PERIOD: Final = 0.01
"""Least number of seconds between two turns that an interface causes, by input or by `next_due`."""
LONGEST: Final = 3.0
"""Seconds without a `read` after which the handles are unknown: nobody has looked whether the robots are heard."""
MOST_AT_ONCE: Final = 64
"""Datagrams or pieces that one source reads at once."""


class GuardedHardware:
    """Wraps the `HardwareInterface` of a third party. No method raises."""

    def __init__(self, hardware: HardwareInterface, name: str, clock: Callable[[], float] = time.monotonic) -> None:
        self._hardware = hardware
        self._guard = Guard(f"hardware interface '{name}'", through=())
        self._name = name
        self._clock = clock
        self._unread = False
        """True if a source has received something since the last `read`."""
        self._read_at = self._paused_until = -math.inf
        self._was_slow = self._lost = self._suspended = False
        self._why = "its hardware interface has failed"
        self._check = HandleCheck(name, hardware)
        self._sources: list[GuardedSource] = []
        self.handles = hardware.handles
        self.changed = False

    # calls

    @property
    def paused(self) -> bool:
        """True while it is not called: after a failure, or in the pause after a slow call."""
        return self._guard.broken or (self._paused_until > -math.inf and self._clock() < self._paused_until)

    def call(self, default: T, function: Callable[..., T], *arguments: object) -> T:
        """The result of the function; `default` after the first exception."""
        start = self._clock()
        result = self._guard.call(default, function, *arguments)
        end = self._clock()
        if end - start > SLOW:
            self._paused_until = end + PAUSE * (end - start)
            if not self._was_slow:
                self._was_slow = True
                log.warning(
                    "hardware interface '%s' took %.1f s for one call; a call must not block. It is called less often",
                    self._name, end - start,
                )  # fmt: skip
        return result

    # the port

    def read(self, now: Instant) -> None:
        """Read, and check the handles. They are unknown after a failure."""
        if not self.paused:
            self._unread, self._read_at = False, self._clock()
            self.call(None, self._read, now)
        self._guard.call(None, self._check.check, self.handles, now)
        is_late = self.paused and self._clock() - self._read_at > LONGEST
        if is_late is not self._suspended and not self._guard.broken:
            self._suspended, self.changed = is_late, True
            if is_late:
                self._guard.call(None, self._check.suspend, self.handles, "its hardware interface is too slow", now)
            else:
                self._guard.call(None, self._check.resume, self.handles, now)
        if self._guard.broken and not self._lost:
            self._lost = self.changed = True
            self._check.lose(self.handles, self._why, now)

    def _read(self, now: Instant) -> None:
        self._hardware.read(now)
        if self._hardware.changed:
            self._hardware.changed, self.changed = False, True

    def write(self, now: Instant) -> None:
        """Write."""
        if not self.paused:
            self.call(None, self._hardware.write, now)

    def next_due(self, until: float = -math.inf) -> float:
        """When it has something to do; not in a pause, and at most every PERIOD."""
        if self._guard.broken:
            return math.inf if self._lost else -math.inf
        if self.paused:
            return self._paused_until if self._suspended else min(self._paused_until, self._read_at + LONGEST + PERIOD)
        if self._unread:
            due = -math.inf
        else:
            due = self.call(math.inf, lambda: float(self._hardware.next_due(until)))
            for source in self._sources:
                due = min(due, source.next_due())
            due = -math.inf if self._guard.broken else due
        return max(due, self._read_at + PERIOD)

    def explain(self, handle: str, now: Instant) -> None:
        """Explain, unless in a pause."""
        if not self.paused:
            self.call(None, self._hardware.explain, handle, now)

    def forget(self) -> None:
        """Forget everything."""
        self.call(None, self._hardware.forget)

    def sources(self) -> Sequence[IoSource]:
        """Its sources, each with the same guard; none in a pause."""
        if self.paused:
            return ()
        inner: Sequence[IoSource] = self.call((), lambda: tuple(self._hardware.sources()))
        if [source.inner for source in self._sources] != list(inner):
            self._sources = [GuardedSource(source, self) for source in inner]
        return self._sources

    def retire(self) -> None:
        """Stop calling it. The next `read` makes its handles unknown."""
        self._guard.broken = True
        self._why = "its hardware interface is no longer configured"

    def close(self) -> None:
        """Close it, also after a failure: it may hold resources."""
        self._guard.broken = False
        self._guard.call(None, self._hardware.close)

    def received(self) -> None:
        """Note that a source has received something."""
        self._unread = True


class GuardedSource:
    """One source of a third party's hardware interface, with the guard of the interface."""

    __slots__ = ("_hardware", "inner")

    def __init__(self, inner: IoSource, hardware: GuardedHardware) -> None:
        self.inner = inner
        self._hardware = hardware

    def fileno(self) -> int:
        """The descriptor; -1 after a failure."""
        return self._hardware.call(-1, lambda: int(self.inner.fileno()))

    def receive(self, now: Instant, limit: int) -> None:
        """Receive with a lower limit. `read` follows."""
        if not self._hardware.paused:
            self._hardware.call(None, self.inner.receive, now, min(limit, MOST_AT_ONCE))
            self._hardware.received()

    def next_due(self) -> float:
        """When the source has something to do; inf after a failure."""
        return self._hardware.call(math.inf, lambda: float(self.inner.next_due()))

    def service(self, now: Instant) -> None:
        """Do what is due."""
        if not self._hardware.paused:
            self._hardware.call(None, self.inner.service, now)

    def close(self) -> None:
        """Close the source."""
        self._hardware.call(None, self.inner.close)
