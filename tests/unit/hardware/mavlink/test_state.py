from __future__ import annotations

from collections import deque

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink.autopilots import ARDUPILOT, INAV, PX4
from mav_robot_status.hardware.mavlink.identity import Family
from mav_robot_status.hardware.mavlink.state import Heard, begin, heard, interval, is_fresh
from mav_robot_status.mavlink.definitions import Heartbeat


def arrivals(*times: float) -> Heard:
    last: Heard | None = None
    for at in times:
        last = heard("message", at, last)
    assert last is not None
    return last


def test_a_message_that_never_arrived_is_not_fresh() -> None:
    assert not is_fresh(None, 10.0, 5.0)


def test_a_message_is_fresh_up_to_and_including_its_maximum_age() -> None:
    once = arrivals(10.0)
    assert is_fresh(once, 12.5, 2.5)
    assert not is_fresh(once, 12.6, 2.5)


def test_a_slow_stream_is_fresh_for_three_intervals() -> None:
    slow = arrivals(0.0, 2.0, 4.0, 6.0)
    assert is_fresh(slow, 12.0, 2.5)
    assert not is_fresh(slow, 12.1, 2.5)


def test_a_very_slow_stream_is_fresh_for_ten_seconds() -> None:
    slow = arrivals(0.0, 30.0, 60.0)
    assert is_fresh(slow, 70.0, 2.5)
    assert not is_fresh(slow, 70.1, 2.5)


def test_a_longer_maximum_age_overrides_the_ten_seconds() -> None:
    assert is_fresh(arrivals(0.0), 30.0, 60.0)


@pytest.mark.parametrize(
    ("times", "expected"),
    [((0.0,), 0.0), ((0.0, 1.0), 1.0), ((0, 1, 2, 3, 4, 5, 105), 1), ((0, 100, 101, 102, 103, 104, 105), 1)],
)
def test_the_interval_is_the_median_of_the_last_five(times: tuple[float, ...], expected: float) -> None:
    assert interval(arrivals(*times)) == expected


def test_only_the_last_arrivals_are_stored() -> None:
    assert arrivals(*range(20)).times == deque((14, 15, 16, 17, 18, 19))


NOW = Instant(1000.0, 1_800_000_000_000_000)


def test_a_state_starts_with_a_heartbeat_and_has_the_type_of_the_vehicle() -> None:
    state = begin(Heartbeat(15, 10, 3, 0x81, 4, 3), NOW)
    assert (state.profile, state.family) == (ARDUPILOT, Family.ROVER)
    assert state.heartbeats.armed
    assert (state.booted, state.has_clock) == (NOW.mono, False)
    state.show(INAV)
    assert (state.profile, state.shown) == (INAV, INAV)


def test_a_state_that_becomes_another_keeps_nothing() -> None:
    state, other = begin(Heartbeat(15, 10, 3, 0x81, 4, 3), NOW), begin(Heartbeat(0, 2, 12, 1, 3, 3), NOW)
    state.become(other)
    assert state == other
    assert (state.profile, state.family) == (PX4, Family.COPTER)
