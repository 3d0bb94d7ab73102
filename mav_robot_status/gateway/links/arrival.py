"""When input arrived that was not read at once: after a pause of the process, and while a link delivers too much.

A read gives the bytes, not the time of their arrival. Normally the loop reads within milliseconds. It does not after
SIGSTOP, a pause of the virtual machine, a suspend of the system, or a turn that took long. Then old input must not pass
for new: a vehicle that was disarmed before the pause may be armed now.

- A datagram has the time stamp of the kernel.
- Nothing dates the bytes of a stream. They count as arrived when the link was last seen empty: they
  cannot be older.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from ...clock import Instant
from ...links.base import DatedLink
from ...links.stream import CHUNK

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ...links.base import Address, Link
    from .endpoint import Endpoint

    Piece = tuple[bytes, Address]
    Pieces = Sequence[Piece]
    Found = tuple[list[tuple[Instant, Piece]], dict[Address, Instant]]
    """Pieces with their times; for each source with unread input, the earliest time at which that may have arrived."""

LATE: Final = 0.2
"""Seconds between two looks at the links after which the stamps of datagrams are read."""
STALL: Final = 0.5
"""Seconds by which a wake-up may be late before the bytes of streams count as old."""
WALL_STEP: Final = 0.1
"""Seconds by which the wall clock may drift against the monotonic one between two looks. The kernel stamps datagrams
with the wall clock: if that was set meanwhile, the stamps prove nothing."""
BATCH: Final = 8
"""Pieces read before parsing. Bounds the bytes and the time in a flood of long pieces."""
MOST_PIECES: Final = 64
"""Pieces of a stream read at once after a pause."""
USUAL: Final = 256
"""Bytes of a datagram. A longer one counts as several, so that a limit in datagrams also limits bytes."""


class Pause(NamedTuple):
    """A look at the links that came later than usual."""

    since: Instant
    """The look before."""
    until: Instant
    """The late look."""
    stalled: bool
    """Whether the process did not run, or was busy. Otherwise it waited for input, and read it at once."""


class Arrivals:
    """Dates the input of the links of one gateway that may be old."""

    def __init__(self) -> None:
        self.pause: Pause | None = None
        self._behind: dict[Endpoint, dict[Address, Instant]] = {}
        """The links with unread input, and for each source the earliest time at which that may have arrived."""

    def left(self, endpoint: Endpoint, pieces: Pieces, now: Instant) -> bool:
        """Note that a read at `now` has left input on a link, unless all pieces of a stream are short.

        Returns whether input of any link may be old.
        """
        sources = {source for data, source in pieces if len(data) >= CHUNK} if endpoint.link.stream else {None}
        return self._keep(endpoint, dict.fromkeys(sources, now))

    def receive(self, endpoint: Endpoint, now: Instant, limit: int) -> tuple[list[tuple[Instant, Piece]], bool]:
        """Receive on a link: pieces with the time of their arrival, and whether input of any link may still be old."""
        if self.pause is not None and self.pause.until is not now:
            self.pause = None
        link, pause = endpoint.link, self.pause
        behind = self._behind.pop(endpoint, {})
        if isinstance(link, DatedLink):
            since = behind.get(None) or (pause.since if pause else now)
            found, left = _datagrams(link, since, now, limit)
        else:
            found, left = _undated(link, behind, pause.since if pause and pause.stalled else now, limit)
        return found, self._keep(endpoint, left)

    def forget(self, endpoint: Endpoint) -> None:
        """The link is closed."""
        self._behind.pop(endpoint, None)

    def _keep(self, endpoint: Endpoint, left: dict[Address, Instant]) -> bool:
        if left:
            self._behind[endpoint] = left
        return self.pause is not None or bool(self._behind)


def _datagrams(link: DatedLink, since: Instant, now: Instant, limit: int) -> Found:
    """Datagrams with stamps. Those that are left arrived after the last one that was read."""
    found: list[tuple[Instant, Piece]] = []
    at = since
    while limit > 0:
        pieces = link.receive_dated(BATCH)
        for data, source, stamp in pieces:
            at = arrived(stamp, since, now)
            found.append((at, (data, source)))
            limit -= 1 + len(data) // USUAL
        if len(pieces) < BATCH:
            return found, {}
    return found, {None: at}


def _undated(link: Link, behind: dict[Address, Instant], oldest: Instant, limit: int) -> Found:
    """Input that nothing dates: of streams, and of datagram links without stamps."""
    asked = min(limit, MOST_PIECES)
    pieces = link.receive(asked)
    found: list[tuple[Instant, Piece]] = []
    left = {}
    for data, source in pieces:
        key = source if link.stream else None
        at = behind.get(key, oldest)
        found.append((at, (data, source)))
        if len(data) >= CHUNK if link.stream else len(pieces) == asked:
            left[key] = at
        else:
            left.pop(key, None)
    return found, left


def arrived(stamp: int | None, since: Instant, now: Instant) -> Instant:
    """When a datagram arrived, by the kernel's `stamp` (microseconds since 1970): not before `since`, not after `now`.

    At `since` the link was empty. If there is no stamp, or the wall clock was set meanwhile, the datagram is as old as
    it can be.
    """
    if stamp is None:
        return since
    elapsed = now.mono - since.mono
    age = (now.unix_us - stamp) * 1e-6
    stepped = abs((now.unix_us - since.unix_us) * 1e-6 - elapsed) > WALL_STEP
    if stepped or not -STALL <= age <= elapsed + WALL_STEP:
        return since
    age = min(max(age, 0.0), elapsed)
    return Instant(now.mono - age, now.unix_us - round(age * 1e6))
