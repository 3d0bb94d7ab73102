"""What is sent on one link without being asked: bounded, shared fairly by all vehicles, and counted.

A heartbeat or a status beyond the bound waits. A newer message of the same kind about the same vehicle replaces it, and
keeps its place in the queue. So no vehicle starves, and nothing waits that is out of date.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from .channel import Channel

T = TypeVar("T")

LIMIT: Final = 1000.0
"""Bytes a second on a link to vehicles: a telemetry radio carries 5700."""
ASKED_LIMIT: Final = 10_000.0
"""Bytes a second of all that the peers of one link asked for with MAV_CMD_SET_MESSAGE_INTERVAL."""
MOST_WAITING: Final = 1024


class Waiting(NamedTuple):
    """A message for one channel."""

    channel: Channel
    message: Any
    system: int
    """The system id of the vehicle that it is about."""


class SendBudget:
    """The budget of one link. It is renewed once a second, in `renew`."""

    def __init__(self) -> None:
        self.limit: float | None = None
        """Bytes a second. None: no limit."""
        self.sent = 0
        """Bytes sent without being asked."""
        self.withheld = 0
        """Messages that were replaced or dropped while they waited."""
        self._left = self._asked_left = 0.0
        self._turn = 0
        self._waiting: dict[object, Waiting] = {}

    def renew(self, limit: float | None) -> None:
        """A second has passed."""
        self.limit = limit
        self._left = float("inf") if limit is None else limit
        self._asked_left = float("inf") if limit is None else max(limit, ASKED_LIMIT)

    @property
    def has_room(self) -> bool:
        """Whether another message may be sent in this second."""
        return self._left > 0

    def has_room_for(self, size: int) -> bool:
        """Whether more than so many bytes may be sent in this second."""
        return self._left > size

    def in_turn(self, things: Sequence[T], send: Callable[[T], int]) -> None:
        """Send something about each of these things, in turn over several seconds if the budget is too small.

        `send` sends, and returns the number of bytes.
        """
        for done in range(len(things)):
            if not self.has_room:
                self._turn += done
                self.withheld += len(things) - done
                return
            self.count(send(things[(self._turn + done) % len(things)]))

    def count(self, size: int) -> None:
        """Bytes were sent without being asked."""
        self.sent += size
        self._left -= size

    def count_asked(self, size: int) -> None:
        """Bytes were sent that a peer had asked for."""
        self._asked_left -= size

    @property
    def has_room_for_asked(self) -> bool:
        """The same for what the peers have asked for."""
        return self._asked_left > 0

    def wait(self, key: object, waiting: Waiting) -> None:
        """Keep a message until there is room. It replaces an older one with this key."""
        if key in self._waiting or len(self._waiting) >= MOST_WAITING:
            self.withheld += 1
        if key in self._waiting or len(self._waiting) < MOST_WAITING:
            self._waiting[key] = waiting

    def forget(self, key: object) -> None:
        """Let a message with this key wait no longer: a newer one is sent at once."""
        if self._waiting.pop(key, None) is not None:
            self.withheld += 1

    def next_waiting(self) -> Waiting | None:
        """The message that has waited longest, if there is room for it. It no longer waits."""
        if not self._waiting or not self.has_room:
            return None
        return self._waiting.pop(next(iter(self._waiting)))
