from __future__ import annotations

import pytest

from mav_robot_status.gateway.pace import BURST, PACE, RATE, UNCOUNTED, Pace


def rests(pace: Pace, every: float, pieces: int, times: int = 200) -> list[float]:
    """Seconds of rest after each of `times` reads of `pieces`, which come every so many seconds."""
    found = []
    now = 100.0
    for _ in range(times):
        pace.count(pieces, now)
        rest = max(0.0, pace.rests_until - now)
        found.append(rest)
        now += max(every, rest)
    return found


@pytest.mark.parametrize("rate", [80, 500, 800, 1900])
def test_input_below_the_rate_is_never_delayed(rate: int) -> None:
    assert set(rests(Pace(), 1 / rate, 1)) == {0.0}


def test_input_above_the_rate_soon_gathers_for_the_whole_pace() -> None:
    found = rests(Pace(), 1 / (4 * RATE), 1)
    assert found[0] == 0.0
    assert found[100] > 0.0
    assert rests(Pace(), PACE, round(4 * RATE * PACE))[10:] == pytest.approx([PACE] * 190)


def test_one_burst_is_not_delayed_and_a_longer_one_only_once() -> None:
    assert rests(Pace(), 0.1, BURST // 2) == [0.0] * 200
    pace = Pace()
    pace.count(5 * BURST, 100.0)
    assert pace.rests_until == 100.0 + PACE
    pace.count(1, 100.1)
    assert pace.rests_until < 100.1


def test_a_source_that_does_not_count_is_delayed_above_500_a_second() -> None:
    assert rests(Pace(), 1 / 490, UNCOUNTED)[-1] == 0.0
    assert rests(Pace(), 1 / 1000, UNCOUNTED)[-1] > 0.0


def test_gathered_input_is_read_at_most_once_in_the_time() -> None:
    pace = Pace(gather=0.01)
    pace.count(1, 2.0)
    assert pace.rests_until == 2.01
