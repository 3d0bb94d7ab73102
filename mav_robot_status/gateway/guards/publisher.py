"""Contains exceptions of third parties' publishers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from ...errors import MavRobotStatusError
from . import Guard

if TYPE_CHECKING:
    from ...clock import Instant
    from ...interface import Publisher, RobotStatusMsg


class GuardedPublisher:
    """Calls a third party's publisher. No method raises, except for MavRobotStatusError."""

    def __init__(self, publisher: Publisher, name: str) -> None:
        self._publisher = publisher
        self._guard = Guard(f"publisher '{name}'", through=(MavRobotStatusError,))
        self.periodic = bool(getattr(publisher, "periodic", True))

    def busy(self) -> bool:
        """Whether the publisher is busy; False after a failure."""
        return self._guard.call(False, self._publisher.busy)

    def publish(self, msg: RobotStatusMsg) -> None:
        """Publish a message."""
        self._guard.call(None, self._publisher.publish, msg)

    def service(self, now: Instant) -> float | None:
        """Do pending work."""
        return self._guard.call(None, self._publisher.service, now)

    def rests_until(self, handle: str) -> float:
        """Until when it has no use for a periodic message; -inf if it does not say, or after a failure."""
        rests_until = getattr(self._publisher, "rests_until", None)
        found = self._guard.call(None, rests_until, handle) if callable(rests_until) else None
        return found if isinstance(found, int | float) and not math.isnan(found) else -math.inf

    def forget(self, handle: str) -> None:
        """Release what belongs to a handle that is gone."""
        forget = getattr(self._publisher, "forget", None)
        if callable(forget):
            self._guard.call(None, forget, handle)

    @property
    def queued(self) -> int:
        """Messages that wait in the publisher; 0 if it does not count them."""
        return _number(self._publisher, "queued")

    @property
    def dropped(self) -> int:
        """Messages that the publisher dropped; 0 if it does not count them."""
        return _number(self._publisher, "dropped")

    def close(self) -> None:
        """Close it, also after a failure: it may hold resources."""
        self._guard.broken = False
        self._guard.call(None, self._publisher.close)


def _number(publisher: Publisher, name: str) -> int:
    value = getattr(publisher, name, 0)  # a third party may use the name for something else
    return value if isinstance(value, int) else 0
