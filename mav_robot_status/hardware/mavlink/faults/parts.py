"""The faulty parts of a vehicle: batteries, motor controllers (ESCs), and the transmitter of its Remote ID.

A part is known while it reports a fault. One report without the fault ends it, and so does silence.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

if TYPE_CHECKING:
    from ....clock import Instant

DEBOUNCE: Final = 2
"""Consecutive reports after which an error counts. Recorded: a healthy battery is UNHEALTHY in its first message."""
SILENCE: Final = 10.0
"""Seconds after which a fault that is no longer reported is no longer known. PX4 sends BATTERY_STATUS every 2 s."""
MOST: Final = 16
"""Limit of faults of one vehicle; further ones are not kept."""
NOT_READY: Final = 0
"""In place of a code: it is no error, but a reason not to arm."""


class Fault(NamedTuple):
    """A fault that a part reports."""

    text: str
    since: Instant
    last: float
    """Monotonic seconds of the latest report."""
    reports: int
    """The number of reports in a row."""
    source: str
    """The message with its fields."""


Faults = Mapping[tuple[str, int], Fault]
"""By the name of the part ("battery 2") and the code of the cause."""
NO_FAULTS: Final[Faults] = {}


def heard(faults: Faults, part: str, found: Mapping[int, str], source: str, now: Instant) -> Faults:
    """The faults after a report of one part. `found`: its faults in words, by code."""
    after = {key: fault for key, fault in faults.items() if key[0] != part and now.mono <= fault.last + SILENCE}
    for code, words in found.items():
        before = faults.get((part, code))
        if before is not None and now.mono > before.last + SILENCE:
            before = None
        if len(after) < MOST:
            since, reports = (now, 0) if before is None else (before.since, before.reports)
            after[part, code] = Fault(f"{part}: {words}", since, now.mono, reports + 1, source)
    return after
