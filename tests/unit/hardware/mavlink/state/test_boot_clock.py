from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.state.boot_clock import WRAP, BootClock, heard_clock


def clocked(*samples: tuple[float, int]) -> tuple[BootClock, int]:
    """The clock after (time, time_boot_ms) samples, and the number of detected reboots."""
    boot, reboots = BootClock(samples[0][0]), 0
    for now, clock_ms in samples:
        reboots += heard_clock(boot, clock_ms, now) and boot.rebooted
    boot.shown, boot.rebooted, boot.in_turn = None, False, False  # tested below
    return boot, reboots


def test_the_sample_with_the_least_delay_gives_the_boot_time() -> None:
    assert clocked((1000.5, 60_000), (1001.0, 61_000), (1002.9, 62_000)) == (BootClock(940.0, 62_000), 0)


def test_the_first_sample_gives_the_boot_time() -> None:
    assert clocked((1000.0, 60_000)) == (BootClock(940.0, 60_000), 0)


def test_a_continuous_clock_is_not_a_reboot() -> None:
    assert clocked((1000.0, 60_000), (1001.0, 61_000), (1030.0, 90_000)) == (BootClock(940.0, 90_000), 0)


def test_a_step_back_counts_when_the_next_sample_confirms_it() -> None:
    assert clocked((1000.0, 900_000), (1001.0, 1200))[1] == 0
    assert clocked((1000.0, 900_000), (1001.0, 1200), (1001.5, 1700)) == (BootClock(999.8, 1700), 1)


def test_a_single_late_packet_is_not_a_reboot() -> None:
    boot, reboots = clocked((1000.0, 900_000), (1001.0, 890_000), (1001.5, 901_500), (1002.0, 891_000))
    assert reboots == 0
    assert boot.clock_ms == 901_500


def test_packets_repeated_in_reverse_order_are_not_a_reboot() -> None:
    assert clocked((1000.0, 900_000), (1001.0, 890_000), (1001.1, 880_000), (1001.2, 870_000))[1] == 0


@pytest.mark.parametrize("late", [4.0, 5.0, 6.0, 10.0])
@pytest.mark.parametrize("uptime", [20.0, 900.0, 100_000.0])
def test_packets_repeated_in_order_are_not_a_reboot(late: float, uptime: float) -> None:
    live = [(tick / 4, round((uptime + tick / 4) * 1000)) for tick in range(400)]
    again = [(at + late, clock_ms) for at, clock_ms in live if 20 <= at < 40]
    boot, reboots = clocked(*sorted(live + again))
    assert reboots == 0
    assert boot.at == -uptime


def test_packets_repeated_with_changing_delay_are_not_a_reboot() -> None:
    live = [(tick / 4, 60_000 + tick * 250) for tick in range(400)]
    again = [(at + 4 + n % 5 / 2, clock_ms) for n, (at, clock_ms) in enumerate(live[80:160])]
    assert clocked(*sorted(live + again))[1] == 0


@pytest.mark.parametrize("uptime", [3.0, 8.0, 20.0, 900.0])
@pytest.mark.parametrize("gap", [0.5, 1.2, 30.0])
def test_a_boot_after_the_last_sample_is_a_reboot(uptime: float, gap: float) -> None:
    last = (uptime, round(uptime * 1000))
    assert clocked((uptime - 1, last[1] - 1000), last, (uptime + gap + 0.3, 300), (uptime + gap + 0.6, 600))[1] == int(
        last[1] - 300 > 2000
    )


def test_a_small_step_back_changes_nothing() -> None:
    assert clocked((1000.0, 900_000), (1000.1, 899_000), (1000.2, 898_100)) == (BootClock(100.0, 900_000), 0)


def test_a_clock_wraparound_is_not_a_reboot() -> None:
    assert clocked((1000.0, WRAP - 1000), (1002.0, 1000), (1001.9, WRAP - 500), (1003.0, 2000))[1] == 0


def test_a_second_reboot_is_detected_too() -> None:
    assert clocked((0.0, 900_000), (1.0, 0), (2.0, 1000), (9.0, 8000), (10.0, 500), (11.0, 1500))[1] == 2


def test_a_boot_time_that_returns_after_another_shows_two_autopilots() -> None:
    boot = BootClock(0.0)
    turns = [(1000.0, 900_000), (1000.1, 10_000), (1000.2, 10_100), (1000.3, 900_300), (1000.4, 10_300)]
    assert [heard_clock(boot, clock, at) and boot.rebooted for at, clock in turns] == [False, False, True, False, False]
    assert not boot.in_turn
    assert heard_clock(boot, 10_400, 1000.5)
    assert boot.in_turn


def test_a_second_reboot_has_a_new_boot_time() -> None:
    boot = BootClock(0.0)
    for at, clock in ((0.0, 900_000), (1.0, 0), (2.0, 1000), (9.0, 8000), (10.0, 500), (11.0, 1500)):
        heard_clock(boot, clock, at)
    assert not boot.in_turn
