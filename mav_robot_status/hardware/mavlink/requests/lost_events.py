"""Requests the events of PX4 that did not arrive, with REQUEST_EVENT: each at most once.

A state machine of sequence numbers, without a socket. Source: MAVLink developer guide, events interface.
"""

from __future__ import annotations

from itertools import takewhile

from ....mavlink.definitions import RequestEvent


class LostEvents:
    """The requests to one autopilot for its lost events."""

    def __init__(self, system: int, component: int) -> None:
        self._ids = (system, component)
        self._asked: frozenset[int] = frozenset()
        """The sequence numbers that were asked for and are still missing."""

    def due(self, missing: tuple[int, ...]) -> RequestEvent | None:
        """The next request, for the first run of consecutive numbers that were not asked for; None if there is none.

        `missing` are the sequence numbers that have not arrived, the oldest first.
        """
        if not missing:
            self._asked = frozenset()
            return None
        self._asked &= frozenset(missing)
        new = [number for number in missing if number not in self._asked]
        if not new:
            return None
        run = [number for _, number in takewhile(lambda pair: (new[0] + pair[0]) & 0xFFFF == pair[1], enumerate(new))]
        self._asked |= frozenset(run)
        return RequestEvent(run[0], run[-1], *self._ids)
