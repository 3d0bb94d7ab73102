"""What a complete report of the arming checks says about the current mode."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from ....interface.status import TriState
from ..autopilots.px4 import mode_name
from ..px4_events.ids import ALL_MODES
from ..px4_events.table import component_words
from .arming_report import WARNING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ..autopilots.modes import AvailableMode
    from ..px4_events import EventTable
    from .arming_report import ArmingReport, Check

MOST_REASONS: Final = 16
NONE: Final = 0
"""The health component of a check that concerns none."""


def can_arm(mask: int, group: int | None) -> TriState:
    """Whether the mode group can be armed; if the group is not known, only what holds for all of them."""
    if group is not None:
        return TriState.of(bool(mask >> group & 1))
    return TriState.FALSE if mask == 0 else TriState.TRUE if mask == ALL_MODES else TriState.UNKNOWN


def blocked_modes(mask: int, table: EventTable | None, modes: Mapping[int, AvailableMode]) -> tuple[str, ...] | None:
    """The names of the flight modes that cannot be armed; None without a table.

    A mode without a name is free for an application to register: the vehicle does not have it.
    """
    if table is None or not table.mode_groups:
        return None
    blocked = sorted(mode for mode, group in table.mode_groups.items() if not mask >> group & 1)
    names = (mode_name(mode) or (modes[mode].name if mode in modes else None) for mode in blocked)
    return tuple(dict.fromkeys(name for name in names if name))


def failing(report: ArmingReport, mask: int, group: int | None) -> list[Check]:
    """The failing checks of a mode group, the most restrictive first; all checks if the group is not known.

    A check that concerns a mode that can be armed may block no mode: PX4 gives warnings the mask of all modes. Below
    the level of a warning, such a check blocks none.
    """
    if group is not None and mask >> group & 1:
        return []
    checks = [
        check
        for check in report.checks
        if (group is None or check.modes >> group & 1) and not (check.level > WARNING and check.modes & mask)
    ]

    def order(check: Check) -> tuple[int, int, int]:
        blocks, warns = (check.modes & ~mask).bit_count(), int(bool(check.modes & mask))
        return (warns, check.level, -blocks) if group is not None else (-blocks, warns, check.level)

    return sorted(checks, key=order)


def reasons(checks: list[Check], table: EventTable | None) -> tuple[tuple[str, int], ...]:
    """The words of the checks, each with the time since which it fails, in Unix microseconds."""
    found: dict[str, int] = {}
    for check in checks:
        text = words(check, table)
        found[text] = min(found.get(text, check.since.unix_us), check.since.unix_us)
    return tuple(found.items())[:MOST_REASONS]


def words(check: Check, table: EventTable | None) -> str:
    """The message of a check; without one the component and how many modes it concerns."""
    message = None if table is None else table.message(check.event)
    if message is not None:
        return message
    number = check.modes.bit_count()
    where = "all modes" if check.modes == ALL_MODES else f"{number} mode{'s' if number != 1 else ''}"
    return f"{component_words(None, check.component)} ({where})"
