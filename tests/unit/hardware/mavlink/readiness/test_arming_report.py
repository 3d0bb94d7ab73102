"""Reports of the arming checks: complete ones only, in any order, with losses and repetitions."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink.px4_events import sequence as event_sequence
from mav_robot_status.hardware.mavlink.px4_events.ids import ALL_MODES
from mav_robot_status.hardware.mavlink.px4_events.sequence import EventSequence
from mav_robot_status.hardware.mavlink.px4_events.table import EventTable
from mav_robot_status.hardware.mavlink.readiness import arming_report
from mav_robot_status.hardware.mavlink.readiness.arming_report import ArmingReport, is_complete
from mav_robot_status.mavlink.definitions import Event

from ..px4_reports import BARE, BLOCKED, LOITER_GROUP, NO_FIX, NO_FIX_NOW, NO_STICKS_NOW, event, report, table

Known = tuple[ArmingReport, EventSequence]


def after(
    events: Iterable[Event],
    known: Known = (arming_report.NOTHING, event_sequence.NOTHING),
    at: float = 100.0,
    words: EventTable | None = None,
) -> Known:
    """What is known after these events."""
    made, sequence = known
    now = Instant(at, round(at * 1e6))
    for one in events:
        sequence, arrival = event_sequence.heard(sequence, one, now)
        if arrival is not event_sequence.Arrival.REPEATED:
            made = arming_report.heard(made, sequence, one, words, now)
    return made, sequence


def test_a_whole_report_counts() -> None:
    made, sequence = after(report(1))
    assert is_complete(made, sequence)
    assert made.can_arm == BLOCKED
    assert [(check.event.id, check.component, check.level) for check in made.checks] == [(NO_FIX, 3, 3)]


@pytest.mark.parametrize("lost", range(3))
def test_a_report_with_a_lost_event_does_not_count(lost: int) -> None:
    events = report(1)
    del events[lost]
    assert not is_complete(*after(events))


def test_the_report_before_does_not_count_while_an_event_after_it_is_missing() -> None:
    known = after(report(1))
    assert is_complete(*after([event(BARE, 4, 1)], known))
    assert not is_complete(*after([event(BARE, 5, 1)], known))


def test_a_lost_event_that_arrives_later_completes_its_report() -> None:
    events = report(1)
    known = after([events[0], events[2]])
    assert not is_complete(*known)
    made, sequence = after([events[1]], known)
    assert is_complete(made, sequence)
    assert len(made.checks) == 1


def test_an_earlier_report_that_is_repeated_does_not_change_a_newer_one() -> None:
    old, new = report(1), report(4, can_arm=ALL_MODES, failing=())
    known = after([*old, *new])
    assert after([*old, *new, *old], known) == known
    assert known[0].can_arm == ALL_MODES


def test_a_check_that_stays_keeps_its_time() -> None:
    known = after(report(1), at=100.0)
    made, _ = after(report(4, failing=(NO_FIX_NOW, NO_STICKS_NOW)), known, at=110.0)
    assert [check.since.mono for check in made.checks] == [100.0, 110.0]


def test_a_check_that_returns_has_a_new_time() -> None:
    known = after(report(4, failing=()), after(report(1), at=100.0))
    made, _ = after(report(6), known, at=120.0)
    assert [check.since.mono for check in made.checks] == [120.0]


def test_two_checks_of_one_kind_have_their_own_times() -> None:
    known = after(report(1), at=100.0)
    made, _ = after(report(4, failing=(NO_FIX_NOW, NO_FIX_NOW)), known, at=110.0)
    assert [check.since.mono for check in made.checks] == [100.0, 110.0]


def test_chunks_combine() -> None:
    made, sequence = after([*report(1, can_arm=0b110), *report(4, can_arm=0b011, failing=(NO_STICKS_NOW,), chunk=1)])
    assert is_complete(made, sequence)
    assert made.can_arm == 0b010
    assert len(made.checks) == 2


def test_a_second_chunk_without_the_first_does_not_count() -> None:
    assert not is_complete(*after(report(1, chunk=1)))


def test_a_new_report_is_in_progress_until_it_is_closed() -> None:
    known = after(report(1))
    made, _ = after(report(4)[:2], known, at=105.0)
    assert (made.begun, made.begun_at) == (4, 105.0)
    assert after(report(4)[2:], (made, after(report(4)[:2], known)[1]))[0].begun is None


def test_the_mask_of_an_early_version_is_not_known() -> None:
    events = report(1)
    early = events[0]._replace(arguments=events[0].arguments[:13] + bytes(27))
    assert after([early, *events[1:]])[0].can_arm is None


@pytest.mark.parametrize("words", [None, table()])
def test_an_event_of_another_part_within_a_report_is_not_a_check(words: EventTable | None) -> None:
    begin, check, _ = report(1)
    end = report(1, failing=(NO_FIX_NOW, NO_FIX_NOW))[-1]
    made, sequence = after([begin, check, event(BARE, 3, 60_000, b"\1\0\0\0\5", 4), end], words=words)
    assert is_complete(made, sequence)
    assert [one.event.id for one in made.checks] == [NO_FIX]


@given(
    st.lists(st.sampled_from([BLOCKED, ALL_MODES, LOITER_GROUP]), min_size=2, max_size=6),
    st.data(),
)
def test_losses_and_repetitions_in_any_order_give_the_newest_report_or_none(
    masks: list[int], data: st.DataObject
) -> None:
    """A complete report is the newest one that was sent, or one after which nothing has arrived."""
    sent: list[Event] = []
    for turn, mask in enumerate(masks):
        sent += report(len(sent) + 1, can_arm=mask, time_ms=1000 * turn)
    arriving = data.draw(st.lists(st.sampled_from(sent), max_size=30))
    order = sorted(set(arriving), key=lambda e: e.sequence) if data.draw(st.booleans()) else arriving
    made, sequence = after(order)
    if is_complete(made, sequence):
        last = max(made.chunks[0].last, sequence.newest or 0)
        assert made.chunks[0].last == sequence.newest or sequence.has_all_after(made.chunks[0].last)
        assert made.can_arm == masks[(made.chunks[0].last - 1) // 3]
        assert last == sequence.newest
    made, sequence = after([*order, *report(len(sent) + 1, can_arm=7, time_ms=10_000)], (made, sequence))
    assert is_complete(made, sequence)
    assert made.can_arm == 7
