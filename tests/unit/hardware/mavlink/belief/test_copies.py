"""The memory of frames, and the channels that repeat them."""

from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.belief.copies import MOST_REMEMBERED, PROOF, REMEMBERED, Copies, Original
from mav_robot_status.hardware.mavlink.belief.counts import Count

COUNT = Count(None, "radio", 0, 0.0)


def test_the_same_bytes_are_known_for_some_time() -> None:
    copies = Copies()
    copies.remember(1, Original(0.0, COUNT))
    assert copies.original(1, REMEMBERED) == Original(0.0, COUNT)
    assert copies.original(1, REMEMBERED + 0.1) is None
    assert copies.original(2, 0.0) is None


def test_what_is_remembered_is_bounded_and_the_newest_frames_are_kept() -> None:
    copies = Copies()
    for key in range(3 * MOST_REMEMBERED):
        copies.remember(key, Original(0.001 * key / MOST_REMEMBERED, COUNT))
    assert len(copies._recent) + len(copies._former) <= 2 * MOST_REMEMBERED
    assert copies.original(3 * MOST_REMEMBERED - 1, 0.1) is not None
    assert copies.original(2 * MOST_REMEMBERED, 0.1) is not None
    assert copies.original(0, 0.1) is None


@pytest.mark.parametrize(
    ("age", "ahead", "anew"),
    [(4.0, 1, True), (4.0, None, False), (4.0, -1, False), (0.1, 1, False), (0.25, 1, True)],
)
def test_known_bytes_are_said_anew_if_they_continue_a_count_later(age: float, ahead: int | None, anew: bool) -> None:
    assert Copies().is_said_anew("radio", 5, Original(0.0, COUNT), ahead, age) is anew


@pytest.mark.parametrize(
    ("sequence", "delay", "later", "anew"),
    [(6, 4.0, 0.1, False), (30, 4.0, 0.1, True), (6, 6.0, 0.1, True), (6, 4.0, 3.0, True)],
)
def test_known_bytes_are_copies_in_a_stream_of_copies_of_the_same_delay(
    sequence: int, delay: float, later: float, anew: bool
) -> None:
    copies = Copies()
    copies.copied("wifi", 5, Original(0.0, COUNT), 4.0)
    now = 4.0 + later
    assert copies.is_said_anew("wifi", sequence, Original(now - delay, COUNT), 1, now) is anew


def test_a_channel_repeats_a_count_after_some_copies_and_for_some_time() -> None:
    copies = Copies()
    for number in range(PROOF):
        assert number == 0 or not copies.echoes["wifi"].repeats(number, float(number))
        copies.copied("wifi", number, Original(number - 0.1, COUNT), float(number))
    echo = copies.echoes["wifi"]
    assert (echo.copies, echo.sequence, round(echo.delay, 3)) == (PROOF, PROOF - 1, 0.1)
    assert [echo.repeats(number, 3.0) for number in (PROOF, PROOF + 40, PROOF + 60, PROOF - 1)] == [
        True,
        True,
        False,
        False,
    ]
    assert not echo.repeats(PROOF, 2.0 + REMEMBERED + 0.1)
