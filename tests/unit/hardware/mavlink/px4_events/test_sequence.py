"""Events in any order: what is new, what is missing, and when the count begins anew."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink.px4_events.sequence import (
    ASKABLE,
    KEPT,
    NOTHING,
    Arrival,
    EventSequence,
    heard,
    refused,
    told,
)
from mav_robot_status.mavlink.definitions import CurrentEventSequence, ResponseEventError

from ..px4_reports import event

NOW = Instant(100.0, 100_000_000)
RESET = 1


def after(*sequences: int, known: EventSequence = NOTHING) -> EventSequence:
    for sequence in sequences:
        known, _ = heard(known, event(7, sequence, 1000), NOW)
    return known


def arrival(known: EventSequence, sequence: int, time_ms: int = 1000) -> Arrival:
    return heard(known, event(7, sequence, time_ms), NOW)[1]


def test_the_first_event_is_the_newest_and_nothing_is_missing() -> None:
    known = after(7)
    assert (known.newest, known.missing, known.since) == (7, (), 100.0)


def test_a_gap_is_missing_until_its_events_arrive() -> None:
    known = after(65534, 2)
    assert known.missing == (65535, 0, 1)
    assert not known.has_all_after(65534)
    known = after(0, 65535, 1, known=known)
    assert known.missing == ()
    assert known.has_all_after(65534)


def test_a_repeated_event_and_an_old_one_are_not_used() -> None:
    known = after(1, 2, 3)
    assert arrival(known, 2) is Arrival.REPEATED
    assert arrival(known, 65500) is Arrival.REPEATED


def test_a_missing_event_arrives_late() -> None:
    assert arrival(after(1, 3), 2) is Arrival.LATE


def test_a_clock_that_goes_back_begins_anew() -> None:
    known, _ = heard(after(1, 2, 3), event(7, 9, 60_000), NOW)
    assert arrival(known, 2, 500) is Arrival.NEWEST
    assert heard(known, event(7, 2, 500), NOW)[0].newest == 2


def test_another_event_with_the_same_number_begins_anew() -> None:
    assert heard(after(1, 2, 3), event(7, 3, 999), NOW)[0].events.keys() == {3}


def test_the_count_tells_what_is_missing() -> None:
    known = told(after(5), CurrentEventSequence(7, 0), NOW)
    assert known.missing == (6, 7)
    assert not known.has_all_after(5)


def test_an_event_that_its_count_announced_is_the_newest() -> None:
    for known in (told(NOTHING, CurrentEventSequence(6, 0), NOW), told(after(5), CurrentEventSequence(6, 0), NOW)):
        assert arrival(known, 6) is Arrival.NEWEST
        assert after(6, known=known).has_all_after(5)
        assert arrival(after(6, known=known), 6) is Arrival.REPEATED


def test_a_count_that_is_late_changes_nothing() -> None:
    known = after(*range(5, 10))
    assert told(known, CurrentEventSequence(7, 0), NOW) is known


def test_a_reset_and_a_count_far_back_begin_anew() -> None:
    known = after(*range(5, 10))
    assert told(known, CurrentEventSequence(7, RESET), NOW) == EventSequence(7, since=100.0)
    assert told(known, CurrentEventSequence(9, RESET), NOW) is known
    forged = after(20_000, known=known)
    assert told(forged, CurrentEventSequence(9, 0), NOW) == EventSequence(9, since=100.0)


def test_what_the_autopilot_no_longer_has_is_counted_and_no_longer_missing() -> None:
    known = refused(after(1, 5), ResponseEventError(2, 4, 0, 0, 0))
    assert (known.missing, known.lost) == ((4,), 2)
    assert not known.has_all_after(1)
    assert refused(known, ResponseEventError(9, 4, 0, 0, 0)) is known


@given(st.lists(st.tuples(st.integers(0, 65535), st.integers(0, 2**32 - 1), st.sampled_from("eetr")), max_size=150))
def test_nothing_grows_whatever_arrives(steps: list[tuple[int, int, str]]) -> None:
    known = NOTHING
    for sequence, time_ms, kind in steps:
        if kind == "e":
            known, _ = heard(known, event(7, sequence, time_ms), NOW)
        elif kind == "t":
            known = told(known, CurrentEventSequence(sequence, time_ms % 2), NOW)
        else:
            known = refused(known, ResponseEventError(sequence, time_ms % 65536, 0, 0, 0))
        assert len(known.events) <= KEPT
        assert len(known.missing) <= ASKABLE
        assert not set(known.missing) & known.events.keys()


@given(st.integers(0, 65535), st.permutations(range(1, 20)), st.data())
def test_any_order_with_repetitions_is_complete_in_the_end(first: int, order: list[int], data: st.DataObject) -> None:
    known = after(first)
    for number in order:
        known = after((first + number) & 0xFFFF, known=known)
        known = after((first + data.draw(st.sampled_from([0, number]))) & 0xFFFF, known=known)
    assert known.missing == ()
    assert known.has_all_after(first)
