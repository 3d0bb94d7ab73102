"""Statuses thinned, whatever the controller's rate, for each audience and each handle by itself."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from typing import TYPE_CHECKING, ClassVar, Final, Generic, TypeVar

from ..errors import UsageError
from ..interface import LinkState

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping

    from ..clock import Instant
    from ..interface import Audience, PublisherContext, RobotStatusMsg

MOST_CHANGES: Final = 5
WINDOW: Final = 1.0  # s
SLACK: Final = 0.01  # s: a message that comes this much early still counts as periodic

S = TypeVar("S")


class Schedule:
    """What one audience was told about one handle, and when."""

    __slots__ = ("_changes", "_content", "_last", "_settled")

    def __init__(self) -> None:
        self._last = -math.inf
        """The time of the last periodic message: it keeps the phase."""
        self._content: object = None
        self._changes: deque[float] = deque(maxlen=MOST_CHANGES)
        self._settled: RobotStatusMsg | None = None

    def turn(self, msg: RobotStatusMsg, content: object, interval: float, now: float) -> float:
        """When `msg` is to be sent: `now`, and it counts as sent; a later time; inf if there is no need to.

        It goes out once in `interval` seconds; before that if its content is another than that of the last one sent,
        MOST_CHANGES times in WINDOW at the most.
        """
        if msg is self._settled:
            return math.inf
        periodic = now - self._last >= interval - SLACK
        changed = content != self._content
        if not periodic and changed and len(self._changes) == MOST_CHANGES and now < self._changes[0] + WINDOW:
            return min(self._changes[0] + WINDOW, self._last + interval)
        self._settled = msg
        if not periodic and not changed:
            return math.inf
        if periodic:
            # the phase is kept, or jitter would add up and thin further
            late = now - self._last >= 2 * interval
            self._last = now if late else self._last + interval
        else:
            self._changes.append(now)
        self._content = content
        return now


class ThinnedPublisher(ABC, Generic[S]):
    """Holds the last message of each handle, and what each audience was told: an `S` for each handle and audience.

    An audience that is new is told at once what is known; nothing is remembered of one that has gone. About a vehicle
    that was never heard nothing is said.
    """

    periodic = True
    name: ClassVar[str]
    memory: ClassVar[type]
    """The class S."""

    @classmethod
    def check_options(cls, options: Mapping[str, object]) -> None:
        """Raises UsageError for an option: there are none."""
        for option in options:
            raise UsageError(f"{cls.name}: unknown option '{option}'; there are none")

    def __init__(self, context: PublisherContext) -> None:
        """Raises UsageError for an option: there are none."""
        self.check_options(context.options)
        self._port = context.mavlink
        self._audiences: list[Audience] = []
        self._told: dict[Hashable, dict[str, S]] = {}
        self._latest: dict[str, RobotStatusMsg] = {}
        self._waiting: dict[str, None] = {}
        """Handles with something that may have to be told, in the order in which it came."""

    @abstractmethod
    def wants(self, audience: Audience) -> bool:
        """True if anything is for this audience."""

    @abstractmethod
    def tell(self, msg: RobotStatusMsg, system: int, audience: Audience, told: S, now: float) -> float:
        """Send what is its turn; when what is held back will be, inf if nothing is."""

    def busy(self) -> bool:
        """Never: what is too much is held back, and only its last state is kept."""
        return False

    @property
    def queued(self) -> int:
        """Handles about which something is held back."""
        return len(self._waiting)

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hold the message; `service`, called after every round of updates, sends it where it is its turn."""
        if msg.detail.system is None or msg.detail.link is LinkState.NEVER_SEEN:
            self._latest.pop(msg.handle, None)
            return
        self._latest[msg.handle] = msg
        self._waiting[msg.handle] = None

    def service(self, now: Instant) -> float | None:
        """Send what is its turn; when a change that is held back will be."""
        audiences = [audience for audience in self._port.audiences() if self.wants(audience)]
        if audiences != self._audiences:
            self._audiences = audiences
            self._told = {a.key: self._told.get(a.key, {}) for a in audiences}
            self._waiting = dict.fromkeys(self._latest)
        again, waiting, self._waiting = math.inf, self._waiting, {}
        for handle in waiting:
            due = self._tell_all(handle, now.mono)
            if due < math.inf:
                self._waiting[handle] = None
                again = min(again, due)
        return None if again == math.inf else again

    def close(self) -> None:
        """Nothing is held."""

    def _tell_all(self, handle: str, now: float) -> float:
        """Tell every audience about one handle; when something that is held back will be due."""
        msg = self._latest.get(handle)
        if msg is None or msg.detail.system is None:
            return math.inf
        due = math.inf
        for audience in self._audiences:
            memories = self._told[audience.key]
            told = memories.get(handle)
            if told is None:
                told = memories[handle] = self.memory()
            due = min(due, self.tell(msg, msg.detail.system, audience, told, now))
        return due
