"""How long a speaker claims the ids, and what proves two to be one."""

from __future__ import annotations

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.hardware.mavlink.belief.clock import Lag
from mav_robot_status.hardware.mavlink.belief.counts import Count
from mav_robot_status.hardware.mavlink.belief.speakers import (
    HOLD,
    LONGEST,
    STANDS,
    Alternation,
    Speaker,
    differ,
    has_booted,
    is_same_boot,
)
from mav_robot_status.hardware.mavlink.satellite.state import stated
from mav_robot_status.mavlink.definitions import Heartbeat, HighLatency2

DISARMED, ARMED, TERMINATED = Heartbeat(0, 2, 3, 81, 3, 3), Heartbeat(0, 2, 3, 209, 4, 3), Heartbeat(0, 2, 3, 209, 8, 3)
ROVER = Heartbeat(0, 10, 3, 81, 3, 3)
SATELLITE = stated(HighLatency2(0, 0, 0, 4, 0, 2, 3, 0, 0, 0, 0, 209 - 256, 0, 0))


def at(seconds: float) -> Instant:
    return Instant(seconds, round(seconds * 1e6))


def claiming(*claims: tuple[float, Heartbeat]) -> Speaker:
    speaker = Speaker("radio", 0.0)
    for seconds, heartbeat in claims:
        speaker.heard_at = seconds
        speaker.claim(heartbeat, at(seconds))
    return speaker


def clocked(speaker: Speaker, boot: float, start: float, count: int = 5) -> Speaker:
    for tick in range(count):
        speaker.clock.hear(start + tick / 4 - boot, start + tick / 4, Lag())
    return speaker


def counted(channel: str, began: float, until: float) -> Speaker:
    """A speaker that is heard at 10 Hz on a channel."""
    speaker = Speaker(channel, began)
    count = Count(speaker, channel, 0, began)
    for tick in range(round((until - began) * 10) + 1):
        count.advance(1, began + tick / 10, began + tick / 10)
    speaker.counts.append(count)
    return speaker


@pytest.mark.parametrize(
    ("claims", "until"),
    [
        ([(0.0, DISARMED)], STANDS),
        ([(0.0, ARMED)], STANDS),
        ([(0.0, ARMED), (1.0, ARMED)], 1.0 + STANDS),
        ([(0.0, ARMED), (5.0, ARMED)], 21.0),
        ([(0.0, DISARMED), (5.0, DISARMED)], 5.0 + STANDS),
        ([(0.0, ARMED), (5.0, TERMINATED)], 5.0 + STANDS),
        ([(0.0, ARMED), (60.0, ARMED)], 60.0 + LONGEST),
        ([(0.0, SATELLITE)], 16.0),
        ([], -float("inf")),
    ],
)
def test_a_claim_stands_for_a_while_and_an_armed_one_for_some_of_its_intervals(
    claims: list[tuple[float, Heartbeat]], until: float
) -> None:
    assert claiming(*claims).stands_until == pytest.approx(until)


def test_an_armed_claim_counts_from_its_arrival_however_late_it_is() -> None:
    speaker = Speaker("radio", 0.0)
    speaker.heard_at = 30.0
    speaker.claim(ARMED, at(10.0))
    assert speaker.stands_until == 30.0 + STANDS


def test_a_late_heartbeat_claims_the_ids_if_it_says_armed() -> None:
    speaker = claiming((10.0, DISARMED))
    assert speaker.claim_late(ARMED, 12.0)
    assert (speaker.armed, speaker.stands_until) == (True, 12.0 + STANDS)
    assert not claiming((10.0, DISARMED)).claim_late(DISARMED, 15.0)
    assert not claiming((10.0, DISARMED)).claim_late(ARMED._replace(type=6, autopilot=8), 15.0)


def test_an_older_heartbeat_changes_no_claim() -> None:
    speaker = claiming((10.0, DISARMED))
    speaker.claim(ROVER, at(9.0))
    assert (speaker.kind, list(speaker.beats)) == ((3, 2), [10.0])


@pytest.mark.parametrize(
    ("beats", "step", "shows"),
    [
        ([ARMED, DISARMED] * 3, 0.9, True),
        ([ARMED, DISARMED] * 3, 1.5, False),
        ([ARMED, DISARMED, ARMED], 0.5, False),
        ([DISARMED, ROVER, DISARMED], 3.0, True),
        ([DISARMED, ROVER], 1.0, False),
    ],
)
def test_what_no_vehicle_does_shows_two(beats: list[Heartbeat], step: float, shows: bool) -> None:
    alternation = Alternation()
    assert any(alternation.shows(beat, number * step) for number, beat in enumerate(beats)) is shows


def test_a_conflict_in_a_count_keeps_its_beginning_while_it_lasts() -> None:
    speaker = Speaker("radio", 0.0)
    for seconds in (1.0, 5.0, 5.0 + 2 * HOLD):
        speaker.contradict("two types in turn", at(seconds))
        assert speaker.conflict is not None
        assert speaker.conflict.since.mono == (1.0 if seconds < 6 else seconds)
        assert speaker.conflict.last == seconds


@pytest.mark.parametrize(("boot", "same"), [(-60.0, True), (-61.5, True), (-63.0, False)])
def test_one_boot_is_proven_by_some_samples_of_the_clock(boot: float, same: bool) -> None:
    old, young = clocked(counted("radio", 0.0, 9.0), -60.0, 0.0), clocked(counted("wifi", 5.0, 9.0), boot, 5.0)
    assert is_same_boot(young, old, 6.0) is same
    assert not is_same_boot(clocked(counted("wifi", 5.0, 5.0), boot, 5.0, 1), old, 6.0)


def test_one_sample_is_enough_where_a_count_fell_silent() -> None:
    old, young = clocked(counted("radio", 0.0, 5.0), -60.0, 0.0), clocked(counted("radio", 8.0, 8.0), -60.0, 8.0, 1)
    assert is_same_boot(young, old, 8.0)
    busy = clocked(counted("radio", 0.0, 8.0), -60.0, 0.0)
    assert not is_same_boot(young, busy, 8.0)


def test_vehicles_of_another_type_are_never_one() -> None:
    old, young = clocked(counted("radio", 0.0, 9.0), -60.0, 0.0), clocked(counted("wifi", 5.0, 9.0), -60.0, 5.0)
    old.claim(DISARMED, at(1.0))
    young.claim(ROVER, at(6.0))
    assert not is_same_boot(young, old, 7.0)


@pytest.mark.parametrize(
    ("channel", "boot", "booted"), [("radio", 7.0, True), ("radio", -900.0, False), ("wifi", 7.0, False)]
)
def test_a_boot_is_a_clock_that_began_after_the_old_run_on_its_channel(channel: str, boot: float, booted: bool) -> None:
    old, young = clocked(counted("radio", 0.0, 5.0), -60.0, 0.0), clocked(counted(channel, 8.0, 9.5), boot, 8.0)
    assert has_booted(young, old, 9.5) is booted


def test_in_what_two_speakers_differ() -> None:
    one, other = claiming((1.0, DISARMED)), claiming((1.0, ARMED))
    assert differ(one, other) == "armed and disarmed at the same time"
    assert differ(one, claiming((1.0, ROVER))) == "HEARTBEAT.type and autopilot differ"
    assert differ(one, claiming((1.0, DISARMED))) is None
    clocked(one, -60.0, 0.0)
    assert differ(one, clocked(claiming((1.0, DISARMED)), -52.5, 0.0)) is None  # a second port that is late
    assert differ(one, clocked(claiming((1.0, ARMED)), -52.5, 0.0)) is None
    assert differ(one, clocked(claiming((1.0, DISARMED)), -900.0, 0.0)) == "clocks of two autopilots"
