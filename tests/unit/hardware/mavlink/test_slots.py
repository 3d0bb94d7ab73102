from __future__ import annotations

import logging

import pytest

from mav_robot_status.hardware.mavlink.slots import WINDOW, Newcomers

VEHICLE = (1, 1)


def admitted(newcomers: Newcomers, *seconds: float, full: bool = True) -> list[bool]:
    return [newcomers.admits(VEHICLE, full, second) for second in seconds]


def test_a_newcomer_gets_a_free_place_at_once() -> None:
    assert admitted(Newcomers(), 100.0, full=False) == [True]


def test_without_a_free_place_heartbeats_in_three_seconds_are_needed() -> None:
    assert admitted(Newcomers(), 100.0, 101.1, 102.2) == [False, False, True]


def test_many_heartbeats_in_one_second_count_once() -> None:
    assert not any(admitted(Newcomers(), *(100.0 + n / 100 for n in range(90))))


def test_heartbeats_of_other_ids_do_not_count() -> None:
    newcomers = Newcomers()
    assert not any(newcomers.admits((n % 250 + 2, n // 250), True, 100.0 + n / 300) for n in range(6000))
    assert newcomers.admits((5, 0), True, 121.0) is False


def test_while_newcomers_wait_a_free_place_is_not_given_away_at_once() -> None:
    newcomers = Newcomers()
    newcomers.admits((9, 9), True, 100.0)
    assert admitted(newcomers, 103.0, full=False) == [False]
    assert admitted(newcomers, 104.5 + WINDOW, full=False) == [True]


def test_a_full_table_is_logged_once_a_minute(caplog: pytest.LogCaptureFixture) -> None:
    newcomers = Newcomers()
    with caplog.at_level(logging.WARNING):
        for tenth in range(700):
            newcomers.admits((tenth % 250 + 1, tenth % 200), True, 100.0 + tenth / 10)
    assert len(caplog.records) == 2
