from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.testing import ManualClock


def test_time_stands_still_until_it_is_advanced() -> None:
    clock = ManualClock(Instant(5.0, 1_000_000))
    assert clock() == clock.now() == Instant(5.0, 1_000_000)
    assert clock.advance(1.5) == Instant(6.5, 2_500_000)
    assert clock() == Instant(6.5, 2_500_000)


def test_it_never_steps_back() -> None:
    with pytest.raises(ValueError, match="cannot advance by -1 s"):
        ManualClock().advance(-1)


def test_small_steps_add_up_exactly() -> None:
    clock = ManualClock(Instant(0.0, 0))
    for _ in range(20):
        clock.advance(0.05)
    assert clock() == Instant(1.0, 1_000_000)
