"""The boot clock of a speaker: samples in, boot times, lags and changes out."""

from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.belief.clock import SAMPLES, WRAP, Change, Clock, Lag, turned


def clocked(*samples: tuple[float, float]) -> tuple[Clock, Lag, list[Change]]:
    """The clock after (time of arrival, seconds since boot) samples on one count, and what they show."""
    clock, lag = Clock(), Lag()
    found = [clock.hear(seconds, at, lag) for at, seconds in samples]
    return clock, lag, [change for change in found if change is not None]


def steady(count: int = 20, boot: float = -60.0, start: float = 0.0) -> list[tuple[float, float]]:
    """Samples at 4 Hz of a link without delay."""
    return [(start + tick / 4, start + tick / 4 - boot) for tick in range(count)]


def test_the_fastest_frame_gives_the_boot_time() -> None:
    clock, lag, changes = clocked((1000.5, 60.0), (1001.0, 61.0), (1002.4, 62.0))
    assert (clock.booted, lag.seconds, changes) == (940.0, 0.0, [])


@pytest.mark.parametrize(("delay", "seconds"), [(0.2, 0.0), (0.9, 0.0), (1.5, 1.5), (60.0, 60.0)])
def test_a_frame_is_late_after_a_step(delay: float, seconds: float) -> None:
    last, ticks = steady()[-1]
    clock, lag, changes = clocked(*steady(), (last + delay + 0.25, ticks + 0.25))
    assert lag.seconds == pytest.approx(seconds, abs=0.01)
    assert (clock.booted, changes) == (-60.0, [])
    assert clock.last == pytest.approx(last + 0.25 + (0.0 if seconds else delay))


def test_lateness_ends_when_it_is_small_again() -> None:
    clock, lag = Clock(), Lag()
    seen = []
    for at, seconds in [(0.0, 60.0), (5.0, 61.0), (5.1, 63.0), (5.2, 65.0), (5.3, 65.2)]:
        clock.hear(seconds, at, lag)
        seen.append(round(lag.seconds, 1))
    assert seen == [0.0, 4.0, 2.1, 0.0, 0.0]


@pytest.mark.parametrize("rate", [0.5, 0.95, 1.05])
def test_a_clock_of_another_rate_is_not_late_and_does_not_boot(rate: float) -> None:
    clock, lag = Clock(), Lag()
    for tick in range(400):
        assert clock.hear(60 + rate * tick / 4, tick / 4, lag) is None
        assert lag.seconds == 0.0


@pytest.mark.parametrize("late", [4.0, 10.0])
@pytest.mark.parametrize("uptime", [20.0, 900.0, 100_000.0])
def test_frames_repeated_later_are_no_boot(late: float, uptime: float) -> None:
    live = [(tick / 4, uptime + tick / 4) for tick in range(400)]
    again = [(at + late, seconds) for at, seconds in live if 20 <= at < 40]
    clock, _, changes = clocked(*sorted(live + again))
    assert changes == []
    assert clock.booted == pytest.approx(-uptime, abs=0.1)


def test_a_boot_is_confirmed_by_some_samples_over_a_second() -> None:
    after = steady(5, boot=6.0, start=7.0)
    clock, lag = Clock(), Lag()
    for at, seconds in steady():
        clock.hear(seconds, at, lag)
    assert [clock.hear(seconds, at, lag) for at, seconds in after] == [None, None, None, None, Change.BOOT]
    assert (clock.booted, clock.samples) == (6.0, 1)


def test_a_clock_ahead_of_all_before_is_another_vehicle() -> None:
    assert clocked(*steady(), *steady(5, boot=-900.0, start=7.0))[2] == [Change.EXCHANGE]


def test_samples_that_do_not_agree_or_are_far_apart_confirm_nothing() -> None:
    some = [(7.0, 0.5), (7.5, 100.0), (8.0, 0.9), (20.0, 13.5), (27.0, 20.5), (34.0, 27.5)]
    assert clocked(*steady(), *some)[2] == []


def test_a_clock_wraps() -> None:
    clock, _, changes = clocked((0.0, WRAP - 1.0), (0.5, WRAP - 0.5), (2.0, 1.0), (1.5, 0.5), (3.0, 2.0))
    assert changes == []
    assert clock.fits(3.0, 4.0)
    assert turned(WRAP - 1.0) == pytest.approx(-1.0)


def test_a_clock_is_proven_by_samples_over_a_second() -> None:
    clock, lag = Clock(), Lag()
    for sample in range(SAMPLES):
        assert not clock.is_proven(sample / 4)
        clock.hear(60 + sample / 4, sample / 4, lag)
    assert not clock.is_proven(0.9)
    assert clock.is_proven(1.0)


def test_a_first_sample_that_is_known_to_be_late_counts_from_when_it_was_said() -> None:
    clock, lag = Clock(), Lag()
    clock.hear(60.0, 100.0, lag, 4.0)
    assert (clock.booted, lag.seconds) == (36.0, 4.0)


def test_a_frame_without_a_clock_is_as_late_as_the_one_before_for_two_seconds() -> None:
    _, lag, _ = clocked(*steady(), (10.0, 65.0))
    assert [lag.near(at) for at in (10.0, 12.0, 12.1)] == [5.0, 5.0, 0.0]


def test_of_two_clocks_of_one_boot_the_faster_one_gives_the_boot_time() -> None:
    one, late = clocked(*steady())[0], clocked(*steady(boot=-52.5))[0]
    assert one.adopt(late) == 7.5
    assert one.booted == -60.0
    assert late.adopt(one) == 0.0
    assert late.booted == -60.0
