"""When each of many things is due, in order. The first is found without a search."""

from __future__ import annotations

import math
from bisect import bisect_left, insort
from collections.abc import Hashable
from itertools import count
from typing import Generic, TypeVar

K = TypeVar("K", bound="Hashable")


class DueTimes(Generic[K]):
    """A sorted list: moving 256 entries costs less than one step of a heap in Python. Times are seconds."""

    __slots__ = ("_entries", "_numbers", "_order", "first")

    def __init__(self) -> None:
        self.first = math.inf
        """The earliest time; inf if nothing is ever due."""
        self._order: list[tuple[float, int, K]] = []
        self._entries: dict[K, tuple[float, int, K]] = {}
        self._numbers = count()  # no two entries are equal, so keys are never compared

    def set(self, key: K, due: float) -> None:
        """Note when a key is due; inf: never."""
        entry = self._entries.get(key)
        if entry is not None:
            if entry[0] == due:
                return
            del self._order[bisect_left(self._order, entry)]
            del self._entries[key]
        if due < math.inf:
            self._entries[key] = entry = (due, next(self._numbers), key)
            insort(self._order, entry)
        self.first = self._order[0][0] if self._order else math.inf

    def first_key(self) -> K:
        """The key that is due first. Raises IndexError if there is none."""
        return self._order[0][2]

    def until(self, now: float) -> list[K]:
        """The keys that are due at `now`, the earliest first."""
        return [key for _, _, key in self._order[: bisect_left(self._order, (now, math.inf))]]
