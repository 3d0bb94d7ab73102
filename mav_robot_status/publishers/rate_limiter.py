"""Rate limits for MAVLink publishers, for each audience and each handle separately."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Hashable, Sequence
from typing import ClassVar, Final, Generic, TypeVar

from ..clock import Instant
from ..interface import Audience, LinkState, Publisher, PublisherContext, RobotStatusMsg
from ..interface.options import Options

MOST_CHANGES: Final = 5
WINDOW: Final = 1.0  # s
SLACK: Final = 0.01  # s: a message this much early still counts as periodic
LONGEST_REST: Final = 1.0  # s: a new audience, or one that asks for a status, gets one that is at most this old

S = TypeVar("S")


class Schedule:
    """The last messages about one handle, sent to one audience, and their times."""

    __slots__ = ("_changes", "_content", "_settled", "last")

    def __init__(self) -> None:
        self.last = -math.inf
        """The nominal time of the last periodic message. It keeps the phase."""
        self._content: object = None
        self._changes: deque[float] = deque(maxlen=MOST_CHANGES)
        self._settled: RobotStatusMsg | None = None

    def due(self, msg: RobotStatusMsg, content: object, interval: float, now: float) -> float:
        """When to send `msg`: `now` (it then counts as sent), a later time, or inf for never.

        A message is due once in `interval` seconds, and earlier if its content differs from the last one sent, at most
        MOST_CHANGES times in WINDOW.
        """
        if msg is self._settled:
            return math.inf
        periodic = now - self.last >= interval - SLACK
        changed = content != self._content
        if not periodic and changed and len(self._changes) == MOST_CHANGES and now < self._changes[0] + WINDOW:
            return min(self._changes[0] + WINDOW, self.last + interval)
        self._settled = msg
        if not periodic and not changed:
            return math.inf
        if periodic:
            # a fixed phase: otherwise jitter adds up and lowers the rate
            late = now - self.last >= 2 * interval
            self.last = now if late else self.last + interval
        else:
            self._changes.append(now)
        self._content = content
        return now


class RateLimitedPublisher(Publisher, ABC, Generic[S]):
    """Holds the last message of each handle, and a state `S` for each handle and audience.

    A new audience gets the last message of each handle at once; if there was no audience before, in the next turn. The
    state of a gone audience is deleted. Nothing is sent about a vehicle before its first heartbeat.
    """

    live_only = True
    name: ClassVar[str]
    state_type: ClassVar[type]
    """The class S."""

    options_type = Options

    def __init__(self, context: PublisherContext) -> None:
        """Raises UsageError for an option: there are none."""
        Options.read(self.name, context.options)
        self._port = context.mavlink
        self.periodic = True
        """False while there is no audience: then periodic messages would only wake the process."""
        self._offered: Sequence[Audience] | None = None
        """The audiences of the port when they were last seen."""
        self._audiences: list[Audience] = []
        self._states: dict[Hashable, dict[str, S]] = {}
        self._latest: dict[str, RobotStatusMsg] = {}
        self._waiting: dict[str, None] = {}
        """Handles with a message that may be due, in order of arrival."""
        self._rests: dict[str, float] = {}
        """When the first periodic message of each handle will be due, monotonic seconds."""

    @abstractmethod
    def wants(self, audience: Audience) -> bool:
        """True if this audience gets messages."""

    @abstractmethod
    def send_due(self, msg: RobotStatusMsg, system: int, audience: Audience, state: S, now: float) -> float:
        """Send a message if it is due; return when a delayed message will be due, or inf."""

    @abstractmethod
    def next_periodic(self, audience: Audience, state: S) -> float:
        """When the next periodic message to this audience will be due, monotonic seconds."""

    @property
    def queued(self) -> int:
        """Handles with a delayed message."""
        return len(self._waiting)

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hold the message. `service` follows every round of updates and sends it to audiences for which it is due."""
        if msg.detail.system is None or msg.detail.link is LinkState.NEVER_SEEN:
            self._latest.pop(msg.handle, None)
            return
        self._latest[msg.handle] = msg
        if self._audiences:
            self._waiting[msg.handle] = None

    def rests_until(self, handle: str) -> float:
        """Until when a periodic message of this handle is of no use: none is due before."""
        return self._rests.get(handle, -math.inf)

    def service(self, now: Instant) -> float | None:
        """Send due messages; return when a delayed change will be due."""
        offered = self._port.audiences()
        if offered is not self._offered:
            self._offered = offered
            rested = self._serve([audience for audience in offered if self.wants(audience)])
            if self._audiences and not self.periodic:
                self.periodic = True
                if self._waiting:  # held since the last change: the pipeline first publishes them again
                    return now.mono
            self.periodic = bool(self._audiences)
            if rested and self._audiences:
                self._send_waiting(now.mono)
                return now.mono  # a controller that rests asks again
        if not self._waiting:
            return None
        return self._send_waiting(now.mono)

    def forget(self, handle: str) -> None:
        """Release what belongs to a handle that is gone."""
        self._latest.pop(handle, None)
        self._rests.pop(handle, None)
        for states in self._states.values():
            states.pop(handle, None)

    def _serve(self, audiences: list[Audience]) -> bool:
        """Send to these from now on. Returns whether a controller rests because of the previous ones."""
        if audiences == self._audiences:
            return False
        rested = bool(self._rests)
        self._audiences = audiences
        self._rests.clear()
        self._states = {a.key: self._states.get(a.key, {}) for a in audiences}
        self._waiting = dict.fromkeys(self._latest) if audiences else {}
        return rested

    def _send_waiting(self, now: float) -> float | None:
        """Send the due messages; return when a delayed change will be due."""
        again, waiting, self._waiting = math.inf, self._waiting, {}
        for handle in waiting:
            due = self._send_to_all(handle, now)
            if due < math.inf:
                self._waiting[handle] = None
                again = min(again, due)
        return None if again == math.inf else again

    def _send_to_all(self, handle: str, now: float) -> float:
        """Send the message of one handle to every audience; return when a delayed message will be due."""
        msg = self._latest.get(handle)
        if msg is None or msg.detail.system is None:
            return math.inf
        due, rests = math.inf, now + LONGEST_REST
        for audience in self._audiences:
            if audience.systems is not None and msg.detail.system not in audience.systems:
                continue
            states = self._states[audience.key]
            state = states.get(handle)
            if state is None:
                state = states[handle] = self.state_type()
            due = min(due, self.send_due(msg, msg.detail.system, audience, state, now))
            rests = min(rests, self.next_periodic(audience, state) - SLACK)
        if due == math.inf:
            self._rests[handle] = rests
        else:
            self._rests.pop(handle, None)
        return due
