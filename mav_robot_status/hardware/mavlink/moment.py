"""A point in time for comparisons. It records when the first result changes."""

from __future__ import annotations

from math import inf, nextafter
from typing import TYPE_CHECKING

from .state.latest_messages import slowly_fresh_until

if TYPE_CHECKING:
    from .state.latest_messages import Heard


class Moment:
    """A time, in monotonic seconds.

    Facts compare all other times through it. `next` is therefore the first time at which a fact may change without a
    message, and no list of such times is needed.
    """

    __slots__ = ("next", "now")

    def __init__(self, now: float) -> None:
        self.now = now
        self.next = inf

    def has_come(self, at: float) -> bool:
        """Whether it is `at` or later."""
        if self.now >= at:
            return True
        if at < self.next:
            self.next = at
        return False

    def is_within(self, limit: float) -> bool:
        """Whether it is not later than `limit`."""
        if self.now > limit:
            return False
        if limit < self.next:
            self.next = nextafter(limit, inf)
        return True

    def is_fresh(self, what: Heard | None, least: float) -> bool:
        """Whether `what` is not older than `least` seconds, or than three measured intervals if that is longer."""
        return what is not None and (self.is_within(what.at + least) or self.is_within(slowly_fresh_until(what)))
