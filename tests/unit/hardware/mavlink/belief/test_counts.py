"""One count of sequence numbers, step by step."""

from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.belief.counts import HELD, LATE_FOR, MAX_DROPOUT, MAX_MISORDER, SAME, Count


def heard(*frames: tuple[float, int]) -> Count:
    """A count after (time, number) frames, each of which advances it."""
    (began, first), *others = frames
    count = Count(None, "radio", first, began)
    count.advance(1, began, began)
    for at, number in others:
        place = count.place(number, at)
        assert place is not None
        assert place > 0
        count.advance(place, at, at)
    return count


@pytest.mark.parametrize(
    ("newest", "number", "place"),
    [
        (10, 11, 1),
        (10, 12, 2),
        (255, 0, 1),
        (250, 3, 9),
        (10, 11 + MAX_DROPOUT, 1 + MAX_DROPOUT),
        (10, 12 + MAX_DROPOUT, None),
        (10, 138, None),
        (10, 9, None),  # it was heard
        (10, 10, None),
    ],
)
def test_a_number_ahead_continues_the_count_and_one_that_was_heard_does_not(
    newest: int, number: int, place: int | None
) -> None:
    count = heard(*((at / 10, (newest - 9 + at) & 255) for at in range(10)))
    assert count.place(number, 10.0) == place


def test_a_missing_number_is_late_and_only_for_some_time_and_once() -> None:
    count = heard((0.0, 5), (0.1, 6), (0.2, 9))
    assert [count.place(number, 0.3) for number in (7, 8)] == [-2, -1]
    assert count.place(8, 0.2 + LATE_FOR + 0.1) is None
    assert count.said_behind(1, 0.3) == pytest.approx(0.2, abs=0.001)
    assert count.place(8, 0.3) is None
    assert count.place(7, 0.3) == -2


def test_a_number_far_behind_is_not_late() -> None:
    count = heard((0.0, 0), (0.1, 2), *((0.2 + n / 100, 3 + n) for n in range(MAX_MISORDER)))
    assert count.place(1, 0.8) is None


def test_a_frame_before_the_first_one_is_late_for_a_moment() -> None:
    count = heard((0.0, 5))
    assert (count.place(4, 0.5), count.place(4, 1.5)) == (-1, None)


def test_what_is_missing_is_lost_after_a_second_and_is_told_once() -> None:
    count = heard((0.0, 1), (0.5, 2))
    assert count.advance(3, 1.0, 1.0) is None
    assert [count.advance(1, at, at) for at in (1.5, 1.9, 2.1, 2.5)] == [None, None, 0.5, None]


def test_a_number_of_a_frame_that_says_nothing_is_not_missing() -> None:
    count = heard((0.0, 1))
    count.fill(2)
    count.advance(2, 0.1, 0.1)
    assert count.place(2, 0.2) is None
    count.advance(2, 0.3, 0.3)
    assert count.place(4, 0.4) == -1
    count.fill(4)
    assert count.place(4, 0.4) is None


def test_a_number_ahead_that_is_used_stays_so_until_the_count_has_reached_it() -> None:
    count = heard((0.0, 1))
    count.fill(5)
    count.advance(2, 0.1, 0.1)
    count.advance(4, 0.2, 0.2)
    assert (count.place(5, 0.3), count.place(4, 0.3)) == (None, -3)


def test_late_frames_are_dated_in_the_order_of_their_numbers() -> None:
    count = heard((0.0, 1), (0.1, 5))
    later = count.said_behind(2, 0.2)
    earlier = count.said_behind(3, 0.3)
    assert 0.0 < earlier < later < 0.1


def test_a_sender_whose_number_never_changes_is_one_count_and_a_changing_one_has_no_number_twice() -> None:
    count = heard((0.0, 7))
    for at in (1.0, 2.0):
        assert count.place(7, at) == SAME
        assert count.advance(SAME, at, at) is None
    assert not count.changes
    count = heard((0.0, 7), (1.0, 8))
    assert count.changes
    assert count.place(8, 2.0) is None


@pytest.mark.parametrize(
    ("ahead", "silent", "held"),
    [(1, 5.0, 4.9), (HELD, 5.0, 4.7), (HELD + 1, 5.0, 0.0), (1, 0.9, 0.0)],
)
def test_a_frame_that_goes_on_after_a_silence_was_held_back_for_the_whole_of_it(
    ahead: int, silent: float, held: float
) -> None:
    count = heard(*((at / 10, at) for at in range(20)))
    assert count.held_for(ahead, 1.9 + silent) == pytest.approx(held, abs=0.01)


def test_a_slow_sender_is_not_held_back() -> None:
    count = heard((0.0, 0), (0.9, 1), (1.8, 2))
    assert count.held_for(1, 3.8) == 0.0


def test_a_count_is_silent_when_its_frames_do_not_come_as_usual() -> None:
    fast, slow = heard(*((at / 50, at) for at in range(50))), heard((0.0, 0), (0.5, 1))
    assert (fast.is_silent(0.98 + 0.1), fast.is_silent(0.98 + 0.3)) == (False, True)
    assert (slow.is_silent(1.4), slow.is_silent(1.6)) == (False, True)


def test_a_count_of_copies_tells_no_loss_while_its_source_is_heard_and_fills_its_numbers() -> None:
    source = heard((0.0, 1), (0.1, 3))
    copies = Count(None, "wifi", 2, 0.2, source)
    copies.advance(1, 0.2, 0.2)
    assert source.place(2, 0.3) is None
    assert [copies.advance(2, 0.5 + at, 0.5 + at) for at in range(3)] == [None, None, 0.2]


def test_distances_are_the_shorter_way_round() -> None:
    assert [heard((0.0, 250)).distance(number) for number in (250, 251, 249, 4, 122)] == [0, 1, 1, 10, 128]
