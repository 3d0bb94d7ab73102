"""What the readers of onboard logs make of bytes: named records with their values, without a meaning."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

Value = int | float | str | tuple[int | float, ...]

SIGN_OF_LIFE: Final = ""
"""The name of a record that says only that the log goes on at this time."""
LIFE_US: Final = 250_000
"""The longest time between two records of a reader while the log goes on, microseconds."""
BACK_US: Final = 5_000_000
"""Records are not strictly in the order of their times. A step back by more than this is a new start."""
LEAP_US: Final = 500_000
"""A longer step forward counts only if the following record continues it."""
CONTINUES_US: Final = 10_000_000
"""The longest step from a record that leaps to the one that continues it."""


class Record(NamedTuple):
    """One record."""

    us: int
    """Microseconds since the autopilot has started. It never decreases, but at a new start."""
    name: str
    """As the log calls it: `ARM`, `actuator_armed`."""
    values: Mapping[str, Value]
    """By the names in the log."""


@dataclass(slots=True)
class Counts:
    """What a reader has found."""

    records: int = 0
    bad_bytes: int = 0
    """Bytes that belong to no record."""
    dropouts: int = 0
    """How often the autopilot has noted that it could not write."""


class Reader(Protocol):
    """A reader of one form of log. No input makes it raise, and it keeps at most one incomplete record."""

    counts: Counts

    @property
    def pending(self) -> int:
        """Bytes of an incomplete record."""

    def feed(self, data: bytes) -> Sequence[Record]:
        """The records that are complete now and wanted."""

    def finish(self) -> Sequence[Record]:
        """The records that were held back; call it at the end."""

    def names(self) -> frozenset[str]:
        """The kinds of records that the log announces."""


class Clock:
    """Decides which times of records are plausible. A damaged record can hold any number."""

    def __init__(self) -> None:
        self.us: int | None = None
        """The time that the log has reached."""
        self._held: list[Record] = []
        """Records with a time that leaps, until the next one confirms it."""

    def take(self, record: Record, out: list[Record]) -> None:
        """Append the record to `out`, with what it confirms."""
        us, latest = record.us, self.us
        if latest is None or -BACK_US <= us - latest <= LEAP_US:
            if self._held and latest is not None:
                self._held.clear()
            self.us = us if latest is None else max(us, latest)
            out.append(record if us == self.us else record._replace(us=self.us))
            return
        if self._held and -BACK_US <= us - self._held[-1].us <= CONTINUES_US:
            self.us = max(us, self._held[-1].us)
            out += [*self._held, record._replace(us=self.us)]
            self._held = []
        else:
            self._held = [record]

    def finish(self) -> list[Record]:
        """What waits at the end, if its time is plausible."""
        held, self._held = self._held, []
        return [one for one in held if self.us is not None and 0 <= one.us - self.us <= CONTINUES_US]
