from __future__ import annotations

from dataclasses import replace

import pytest

from mav_robot_status.hardware.mavlink.motion.state import Motion, moved, settled
from mav_robot_status.hardware.mavlink.options import HardwareOptions
from mav_robot_status.interface import TriState

OPTIONS = HardwareOptions()


def driven(*samples: tuple[float, float | None], armed: bool = True, rate: float = 0.0) -> Motion:
    """The motion after (time, speed) samples."""
    motion = Motion()
    for at, speed in samples:
        moved(motion, speed, rate, armed, OPTIONS, at)
    return motion


def test_motion_begins_when_it_has_been_fast_for_three_tenths_of_a_second() -> None:
    fast = driven((0, 0.31))
    assert settled(fast, 0.29) is TriState.UNKNOWN
    assert settled(fast, 0.3) is TriState.TRUE


def test_motion_ends_when_it_has_been_slow_for_a_second() -> None:
    slow = driven((0, 1.0), (1, 1.0), (2, 0.14))
    assert settled(slow, 2.9) is TriState.TRUE
    assert settled(slow, 3.0) is TriState.FALSE


def test_between_the_thresholds_the_value_stays() -> None:
    assert driven((0, 1.0), (1, 1.0), (2, 0.2), (9, 0.2)).value is TriState.TRUE
    assert driven((0, 0.0), (2, 0.0), (3, 0.2), (9, 0.2)).value is TriState.FALSE
    assert driven((0, 0.2), (9, 0.2)).value is TriState.UNKNOWN


def test_one_slow_sample_cancels_the_start_of_a_motion() -> None:
    assert settled(driven((0, 0.4), (0.2, 0.2), (0.4, 0.4)), 0.6) is TriState.UNKNOWN


def test_a_sample_without_an_estimate_resets_the_motion() -> None:
    assert replace(driven((0, 1.0), (1, 1.0), (2, None)), at=2) == Motion(at=2)


def test_samples_far_apart_do_not_show_that_it_stood_still_between_them() -> None:
    assert driven((0, 0.0), (2, 0.0), (4, 0.0)).still_since == 0
    assert driven((0, 0.0), (3, 0.0), (4, 0.0)).still_since == 3
    assert driven((0, 0.0), (1, 0.2), (2, 0.0)).still_since == 2


@pytest.mark.parametrize(("speed", "expected"), [(0.45, TriState.FALSE), (0.55, TriState.TRUE)])
def test_a_disarmed_vehicle_has_higher_thresholds(speed: float, expected: TriState) -> None:
    moving = driven((0, 0.0), (2, 0.0), (3, speed), armed=False)
    assert settled(moving, 4) is expected


def test_turning_on_the_spot_is_motion() -> None:
    assert settled(driven((0, 0.0), rate=0.16), 0.3) is TriState.TRUE
    assert settled(driven((0, 0.0), rate=0.10), 5.0) is TriState.UNKNOWN
    assert settled(driven((0, 0.0), rate=0.07), 1.0) is TriState.FALSE


@pytest.mark.parametrize(("speed", "expected"), [(1.5, TriState.UNKNOWN), (0.9, TriState.FALSE)])
def test_thresholds_are_options(speed: float, expected: TriState) -> None:
    motion = Motion()
    moved(motion, speed, 0.0, True, HardwareOptions(v_on=2.0, v_off=1.0), 0)
    assert settled(motion, 9) is expected
