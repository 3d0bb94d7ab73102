"""A third party's controller or publisher: its exceptions stop it, and nothing else."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any, Final, TypeVar

from ..errors import MavRobotStatusError

if TYPE_CHECKING:
    from collections.abc import Callable

    from ..clock import Instant
    from ..interface import Publisher, RobotStatusMsg

log = logging.getLogger(__name__)

T = TypeVar("T")

FOR_THE_PERSON: Final = (MavRobotStatusError, BrokenPipeError)
"""What a controller may let through: an output failed for good, the reader of standard output has gone."""


class Guard:
    """Calls into one part. After its first exception, which is logged, the part is called no more."""

    def __init__(self, what: str, through: tuple[type[Exception], ...] = FOR_THE_PERSON) -> None:
        self.what = what
        self.broken = False
        self._through = through

    def call(self, default: T, function: Callable[..., T], *arguments: Any) -> T:
        """What the function returns; `default` if it raises, or once one has."""
        if self.broken:
            return default
        try:
            return function(*arguments)
        except self._through:
            raise
        except Exception:  # whatever a third party's code raises
            self.broken = True
            log.exception("%s has failed and is stopped; everything else goes on", self.what)
            return default


class GuardedPublisher:
    """A third party's publisher under guard: the controllers that feed it need not know."""

    def __init__(self, publisher: Publisher, name: str) -> None:
        self._publisher = publisher
        self._guard = Guard(f"publisher '{name}'", through=(MavRobotStatusError,))
        self.periodic = bool(getattr(publisher, "periodic", True))

    def busy(self) -> bool:
        """As the publisher says; never once it is broken."""
        return self._guard.call(False, self._publisher.busy)

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hand on."""
        self._guard.call(None, self._publisher.publish, msg)

    def service(self, now: Instant) -> float | None:
        """Hand on."""
        return self._guard.call(None, self._publisher.service, now)

    @property
    def queued(self) -> int:
        """What the publisher holds, if it tells."""
        return _number(self._publisher, "queued")

    @property
    def dropped(self) -> int:
        """What the publisher had no room for, if it tells."""
        return _number(self._publisher, "dropped")

    def close(self) -> None:
        """Hand on, also to a broken one: it may hold something."""
        self._guard.broken = False
        self._guard.call(None, self._publisher.close)


def _number(publisher: Publisher, name: str) -> int:
    value = getattr(publisher, name, 0)  # a third party may call something else so
    return value if isinstance(value, int) else 0
