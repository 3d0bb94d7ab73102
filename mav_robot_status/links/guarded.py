"""A guard around a link of another package: after an exception the link is closed, and opened again later."""

from __future__ import annotations

import logging
import math
import random
from collections.abc import Callable
from contextlib import suppress
from typing import Final, TypeVar

from mav_robot_status.errors import LinkError, MavRobotStatusError
from mav_robot_status.links.base import Address, Link, Received
from mav_robot_status.links.kind import Url
from mav_robot_status.links.kinds import KINDS
from mav_robot_status.links.retry import Backoff, RandomFraction, StateLog

log = logging.getLogger(__name__)

T = TypeVar("T")

RETRY: Final = 0.2, 10.0
"""Seconds between attempts to open the link again: first, longest."""
STABLE_AFTER: Final = 2.0
"""Seconds without an exception after which the next wait is short again, and the recovery is logged."""


def open_guarded(url: Url) -> Link:
    """Open a live link; a link of another package gets a guard. Raises LinkError, UsageError."""
    return url.kind.open(url) if url.kind in KINDS else GuardedLink(url)


class GuardedLink:
    """A `Link` that passes each call to a link of another package. No method raises."""

    def __init__(self, url: Url, fraction: RandomFraction = random.random) -> None:
        """Open the link. Raises LinkError or UsageError, whatever the package raises."""
        self._url = url
        self._due = self._stable_at = math.inf
        self._failed = False
        """The link has raised since the last `service`."""
        self._unsent = self._dropped = 0
        """Drops of closed links and of sends without a link; drops of the open link."""
        self._backoff = Backoff(*RETRY, fraction)
        self._state_log = StateLog(log)
        self._link: Link | None = self._open()

    def fileno(self) -> int:
        """The descriptor of the link; -1 while it is closed."""
        return self._call(-1, lambda link: int(link.fileno()))

    @property
    def dropped(self) -> int:
        """The drops that the link counts, plus the sends while it was closed."""
        self._dropped = self._call(self._dropped, lambda link: int(link.dropped))
        return self._unsent + self._dropped

    def receive(self, limit: int = 64) -> list[Received]:
        """The pieces that wait; empty while the link is closed."""
        return self._call([], lambda link: [_checked(*piece) for piece in link.receive(limit)])

    def send(self, data: bytes, to: Address = None) -> bool:
        """Send; False while the link is closed."""
        sent = self._call(False, lambda link: bool(link.send(data, to)))
        self._unsent += self._link is None
        return sent

    def due(self) -> float:
        """When `service` has work for the link or for the guard."""
        due = self._call(math.inf, lambda link: float(link.due()))
        return min(self._due, due)  # an exception in `due` changes `_due`

    def service(self, now: float) -> None:
        """Do the work that is due at `now`: of the link, and after an exception open it again."""
        if now >= self._due:
            self._do_due(now)
        self._call(None, lambda link: link.service(now) if now >= link.due() else None)

    def close(self) -> None:
        """Close the link for good."""
        self._release()
        self._due = math.inf

    def _call(self, default: T, function: Callable[[Link], T]) -> T:
        """The result of the function; `default` if it raises, or while the link is closed."""
        if self._link is None:
            return default
        try:
            return function(self._link)
        except Exception as error:  # another package may raise anything
            self._release()
            self._failed, self._due = True, -math.inf
            line = f"{self.text} has failed: {type(error).__name__}: {error}; it is closed, trying again"
            self._state_log.down(line, error)
            return default

    def _release(self) -> None:
        """Close the link, and keep its counts."""
        link, self._link = self._link, None
        self._unsent, self._dropped = self._unsent + self._dropped, 0
        if link is not None:
            with suppress(Exception):
                link.close()

    def _do_due(self, now: float) -> None:
        if self._failed:  # `service` knows the time, and sets the wait
            self._failed = False
            self._due = self._backoff.after(now)
        elif self._link is None:
            self._reopen(now)
        elif now < self._stable_at:
            self._due = self._stable_at
        else:
            self._due = math.inf
            self._backoff.reset()
            self._state_log.up(f"{self.text}: works again")

    def _reopen(self, now: float) -> None:
        try:
            self._link = self._open()
        except MavRobotStatusError as problem:
            self._state_log.down(f"{problem}, trying again")
            self._due = self._backoff.after(now)
        else:
            self._stable_at = now + STABLE_AFTER
            self._due = now  # the owner then looks for the new descriptor

    def _open(self) -> Link:
        try:
            link = self._url.kind.open(self._url)
            self.text, self.stream = str(link.text), bool(link.stream)
        except MavRobotStatusError:
            raise
        except Exception as error:  # another package may raise anything
            raise LinkError(f"{self._url.text}: {type(error).__name__}: {error}") from error
        return link


def _checked(data: bytes, source: Address) -> Received:
    """One piece. Raises TypeError if a link returned something else."""
    hash(source)
    if not isinstance(data, bytes):
        raise TypeError(f"receive returned {type(data).__name__}, not bytes")
    return Received(data, source)
