"""The faulty parts of a vehicle, as a value."""

from __future__ import annotations

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.faults.parts import MOST, NO_FAULTS, SILENCE, heard

START = Instant(1000.0, 1_800_000_000_000_000)


def test_reports_in_a_row_are_counted_from_the_first() -> None:
    faults = heard(NO_FAULTS, "battery 2", {2014: "hot"}, "source", START)
    faults = heard(faults, "battery 2", {2014: "hot"}, "source", later(START, 2))
    (fault,) = faults.values()
    assert (fault.text, fault.reports, fault.since, fault.last) == ("battery 2: hot", 2, START, START.mono + 2)


def test_a_healthy_report_ends_the_faults_of_its_part_alone() -> None:
    faults = heard(NO_FAULTS, "battery 1", {2014: "hot", 2004: "empty"}, "", START)
    faults = heard(faults, "ESC 1", {4007: "stuck"}, "", START)
    assert list(heard(faults, "battery 1", {2014: "hot"}, "", START)) == [("ESC 1", 4007), ("battery 1", 2014)]
    assert list(heard(faults, "battery 1", {}, "", START)) == [("ESC 1", 4007)]


def test_a_fault_after_a_silence_is_a_new_one() -> None:
    faults = heard(NO_FAULTS, "ESC 1", {4007: "stuck"}, "", START)
    now = later(START, SILENCE + 0.1)
    (fault,) = heard(faults, "ESC 1", {4007: "stuck"}, "", now).values()
    assert (fault.reports, fault.since) == (1, now)


def test_the_number_of_faults_is_bounded() -> None:
    faults = NO_FAULTS
    for number in range(300):
        faults = heard(faults, f"battery {number}", {2014: "hot", 2004: "empty"}, "", START)
    assert len(faults) == MOST
