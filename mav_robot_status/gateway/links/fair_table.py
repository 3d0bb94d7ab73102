"""A bounded table of what addresses have: no host fills it alone, and who is silent gives its place to a newcomer."""

from __future__ import annotations

from collections import Counter, OrderedDict
from typing import TYPE_CHECKING, Final, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Hashable

    from ...links.base import Address

SHARE: Final = 4
"""One host holds at most the places divided by this."""
MOST_REFUSED: Final = 1024
"""The most addresses without a place that are counted."""
LOOK_AGAIN: Final = 0.5
"""Seconds without another search after one that found nobody who gives way. A search passes every entry."""


class Holder(Protocol):
    """What may have a place."""

    @property
    def source(self) -> Address:
        """Its address."""

    def gives_way(self, now: float) -> bool:
        """Whether it gives up its place to another."""


H = TypeVar("H", bound=Holder)


class FairTable(Generic[H]):
    """Holders by address: at most `most`, of one host at most a quarter. Times are monotonic seconds."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.holders: OrderedDict[Address, H] = OrderedDict()
        """By address; about the least recently used first, if the owner moves the used ones to the end."""
        self._places: Counter[Hashable] = Counter()
        """The places of each host."""
        self.refused: set[Address] = set()
        """The addresses that got no place, as far as they are counted. The owner clears it."""
        self._search_at: dict[Hashable, float] = {}
        """When to search again for a holder that gives way: of a host that has its share, or of all (None)."""

    def add(self, holder: H) -> None:
        """Give a place to a newcomer, for which `make_room` has found one."""
        self.holders[holder.source] = holder
        self._places[_host(holder.source)] += 1

    def remove(self, source: Address) -> None:
        """Free a place, if this address has one."""
        if self.holders.pop(source, None) is not None:
            host = _host(source)
            self._places[host] -= 1
            if not self._places[host]:
                del self._places[host]

    def make_room(self, source: Address, now: float) -> tuple[bool, H | None]:
        """Whether there is a place for a newcomer, and who has given it up. A holder of its own host does, if that has
        its share.
        """
        host = _host(source)
        if self._places[host] >= max(1, self.most // SHARE):
            among = host
        elif len(self.holders) >= self.most:
            among = None
        else:
            return True, None
        if now < self._search_at.get(among, now):
            return self._refuse(source)
        gone = self._first_that_gives_way(among, now)
        if gone is None:
            if len(self._search_at) > SHARE:  # hosts that had their share
                self._search_at.clear()
            self._search_at[among] = now + LOOK_AGAIN
            return self._refuse(source)
        self.remove(gone.source)
        return True, gone

    def _refuse(self, source: Address) -> tuple[bool, None]:
        if len(self.refused) < MOST_REFUSED:
            self.refused.add(source)
        return False, None

    def _first_that_gives_way(self, host: Hashable | None, now: float) -> H | None:
        """Those passed are moved to the end: so a flood of newcomers does not pass the same ones each time."""
        for _ in range(len(self.holders)):
            source, holder = next(iter(self.holders.items()))
            if (host is None or _host(source) == host) and holder.gives_way(now):
                return holder
            self.holders.move_to_end(source)
        return None


def _host(source: Address) -> Hashable:
    """The IP address of a socket address; any other address is a host of its own."""
    return source[0] if isinstance(source, tuple) and source else source
