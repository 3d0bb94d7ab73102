"""PX4's report of its arming checks: which mode groups may be armed, and the checks that fail.

A report is a summary, one event for each failing check, and a second summary that closes it. It counts when all of it
has arrived, in whatever order. It no longer counts while an event after it is missing, because that event may begin a
newer report. Chunks combine as in libevents (`health_and_arming_checks.cpp`): AND for what can be armed, all checks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Final, NamedTuple

from ....interface.status import TriState
from ..autopilots.px4 import mode_name
from ..px4_events import ARMING_SUMMARY, HEALTH_SUMMARY
from ..px4_events.ids import ALL_MODES, PROTOCOL, component_name
from ..px4_events.sequence import HALF, KEPT, distance
from ..px4_events.table import check_numbers, component_words, summary_numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ....clock import Instant
    from ....mavlink.definitions import Event
    from ..autopilots.modes import AvailableMode
    from ..px4_events import EventTable
    from ..px4_events.sequence import EventSequence

MOST_CHUNKS: Final = 4
IN_PROGRESS: Final = 1.5
"""Seconds from the beginning of a report to its end. The report before it counts for this time."""
WARNING: Final = 4
"""The log level down to which a failing check sets the bit of its component in a summary."""


class Check(NamedTuple):
    """A failing check."""

    event: Event
    modes: int
    """The mask of the mode groups."""
    component: int
    """The index of the health component."""
    since: Instant
    """Since when every report contains it."""

    @property
    def level(self) -> int:
        """The external log level: 0 is an emergency."""
        return self.event.log_levels & 0x0F


class Chunk(NamedTuple):
    """One complete report, or a part of one."""

    last: int
    """The sequence number of its last event."""
    can_arm: int
    """The mask of the mode groups that can be armed."""
    is_plain: bool
    """Whether the mask means this in every state. Early versions send another one while armed."""
    checks: tuple[Check, ...]


class ArmingReport(NamedTuple):
    """The latest report."""

    chunks: Mapping[int, Chunk] = {}
    """By number."""
    begun: int | None = None
    """The sequence number of the summary that begins a newer report, which is not complete yet."""
    begun_at: float = 0.0
    """When it arrived, monotonic seconds."""

    @property
    def can_arm(self) -> int | None:
        """The mask of the mode groups that can be armed; None if it is not known."""
        mask = ALL_MODES
        for chunk in self.chunks.values():
            mask &= chunk.can_arm
        return mask if all(chunk.is_plain for chunk in self.chunks.values()) else None

    @property
    def checks(self) -> tuple[Check, ...]:
        """The failing checks of all chunks."""
        return tuple(check for _, chunk in sorted(self.chunks.items()) for check in chunk.checks)


NOTHING: Final = ArmingReport()


def heard(
    before: ArmingReport, known: EventSequence, event: Event, table: EventTable | None, now: Instant
) -> ArmingReport:
    """The report after a new event, which is in `known` already."""
    report = before
    if event.id == ARMING_SUMMARY and event.sequence == known.newest:
        report = report._replace(begun=event.sequence, begun_at=now.mono)
    for sequence, last in known.events.items():
        if last.id == HEALTH_SUMMARY:
            report = _with_report_to(report, known, sequence, table, now)
    return report


def is_complete(report: ArmingReport, known: EventSequence) -> bool:
    """Whether there is a report, and no event after it is missing."""
    numbers = sorted(report.chunks)
    if not numbers or numbers != list(range(len(numbers))):
        return False
    return all(known.has_all_after(chunk.last) for chunk in report.chunks.values())


def _with_report_to(
    report: ArmingReport, known: EventSequence, last: int, table: EventTable | None, now: Instant
) -> ArmingReport:
    """`report` after the events that end with the closing summary `last`, if these are all there and newer."""
    found = _events_to(known, last)
    if found is None:
        return report
    first, *checks, closing = found
    summary, health = summary_numbers(table, first), summary_numbers(table, closing)
    number = summary[0]
    before = report.chunks.get(number)
    if number != health[0] or number >= MOST_CHUNKS or (before is not None and not _is_newer(last, before.last, known)):
        return report
    components = summary[1] | summary[2] | health[2] | health[3]
    failing = tuple(_checks(checks, components, table, before, now))
    chunk = Chunk(last, summary[3], len(summary) > 4 and summary[4] != 0, failing)
    begun = report.begun if report.begun is not None and 0 < distance(last, report.begun) < HALF else None
    return report._replace(chunks={**report.chunks, number: chunk}, begun=begun)


def _events_to(known: EventSequence, last: int) -> list[Event] | None:
    """The events from the summary that begins the report to the one that closes it; None if one is missing."""
    found = [known.events[last]]
    for back in range(1, KEPT):
        event = known.events.get((last - back) & 0xFFFF)
        if event is None or event.id == HEALTH_SUMMARY:
            return None
        found.append(event)
        if event.id == ARMING_SUMMARY:
            return found[::-1]
    return None


def _is_newer(last: int, before: int, known: EventSequence) -> bool:
    """Whether a remembered report is newer than the one before it, which may be forgotten by now."""
    return last != before and (before not in known.events or distance(before, last) < HALF)


def _checks(
    events: list[Event], components: int, table: EventTable | None, before: Chunk | None, now: Instant
) -> Iterator[Check]:
    """The failing checks among the events of a report. Other parts of the autopilot may send events in between."""
    times: dict[int, int] = {}
    known = {} if before is None else _by_occurrence(before)
    for event in events:
        modes, component = check_numbers(table, event)
        if not _is_check(event, modes, component, components, table):
            continue
        occurrence = times[event.id] = times.get(event.id, 0) + 1
        same = known.get((event.id, occurrence))
        yield Check(event, modes, component, now if same is None else same.since)


def _by_occurrence(chunk: Chunk) -> dict[tuple[int, int], Check]:
    """The checks by their id, and by their turn among those with the same id: one for each of several sensors."""
    found: dict[tuple[int, int], Check] = {}
    for check in chunk.checks:
        turn = sum(1 for number, _ in found if number == check.event.id) + 1
        found[check.event.id, turn] = check
    return found


def _is_check(event: Event, modes: int, component: int, components: int, table: EventTable | None) -> bool:
    """Whether an event within a report is a check: by its group in the table.

    Without a table by its arguments: the component of a warning or an error has its bit in a summary.
    """
    definition = None if table is None else table.events.get(event.id)
    if definition is not None:
        return definition.is_check
    level = event.log_levels & 0x0F
    if not modes or level >= PROTOCOL or component_name(component).startswith("component "):
        return False
    return level > WARNING or bool(components >> component & 1)


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
