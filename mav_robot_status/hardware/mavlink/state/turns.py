"""Detects two senders that speak in turn on one way: a value alternates faster than one vehicle changes it."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING, Final

from ....values import NamedTuple
from ..armed import is_armed

if TYPE_CHECKING:
    from collections.abc import Callable

    from ....mavlink.definitions import Heartbeat

PERIOD: Final = 0.9
"""Seconds between two heartbeats of one autopilot, with a margin. Quicker turns are those of one sender."""
TURN: Final = 10.0
"""Seconds within which two autopilots with the same ids alternate."""


class Rule(NamedTuple):
    """What one vehicle does not do: alternate between two values of `of`, in `runs` runs within `within` seconds."""

    what: str
    of: Callable[[Heartbeat], object]
    runs: int
    within: float
    one_may: bool
    """Whether one sender may do it, if its sequence numbers show that it is only one."""


RULES: Final = (
    Rule("HEARTBEAT.type and autopilot", attrgetter("autopilot", "type"), 3, TURN, False),
    Rule("armed and disarmed", is_armed, 5, 4.0, True),
    Rule("HEARTBEAT.custom_mode", attrgetter("custom_mode"), 6, 3.0, True),
)
"""No vehicle changes its type twice without a reboot. A person may arm, disarm and arm again within seconds, and turn
a mode switch to and fro, but not as often as two senders do. A program may: then the sequence numbers are one count.
"""


class Turns:
    """The latest runs of equal values in the heartbeats of one way, for each rule."""

    __slots__ = ("_runs",)

    def __init__(self) -> None:
        self._runs: tuple[list[tuple[object, float, bool]], ...] = tuple([] for _ in RULES)

    def heard(self, heartbeat: Heartbeat, now: float, *, counted: bool = False) -> str | None:
        """Note a heartbeat that differs from the one before. Returns what alternates, if that shows two senders.

        `counted`: its sequence number continues the count of the one before.
        """
        found = None
        for rule, runs in zip(RULES, self._runs, strict=True):
            value = rule.of(heartbeat)
            if runs and runs[-1][0] == value:
                continue
            runs.append((value, now, counted))
            del runs[: -rule.runs]
            if len(runs) < rule.runs or not PERIOD <= now - runs[0][1] <= rule.within:
                continue
            alternate = all(run[0] == runs[i % 2][0] for i, run in enumerate(runs))
            is_one = rule.one_may and all(run[2] for run in runs[1:])
            if alternate and not is_one:
                found = rule.what
        return found
