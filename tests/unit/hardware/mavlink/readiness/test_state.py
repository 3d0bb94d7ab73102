"""The reasons not to arm, as a value: bursts of texts, lost and repeated ones."""

from __future__ import annotations

import math

from mav_robot_status.clock import Instant, later
from mav_robot_status.hardware.mavlink.readiness import state as readiness
from mav_robot_status.hardware.mavlink.readiness.state import BURST, LASTS, MOST, NOTHING, Readiness

START = Instant(1000.0, 1_800_000_000_000_000)


def burst(before: Readiness, seconds: float, *words: str, prefix: str = "PreArm") -> Readiness:
    """After these texts, 20 ms apart."""
    for number, word in enumerate(words):
        before = readiness.reported(before, f"{prefix}: {word}", word, later(START, seconds + 0.02 * number))
    return before


def held(value: Readiness, seconds: float) -> list[str]:
    return list(readiness.passed(value, START.mono + seconds).reasons)


def since(value: Readiness, words: str) -> float:
    return value.reasons[words].since.mono - START.mono


def test_a_burst_names_every_reason_in_its_order() -> None:
    assert held(burst(NOTHING, 0, "accels", "gyros", "GPS 1: Bad fix"), 0.1) == ["accels", "gyros", "GPS 1: Bad fix"]


def test_a_repeated_reason_keeps_its_beginning_and_shows_its_latest_text() -> None:
    seen = burst(NOTHING, 0, "accels", "home")
    seen = burst(seen, 30, "accels", "home", prefix="Arm")
    assert since(seen, "accels") == 0.0
    assert seen.reasons["accels"].text == "Arm: accels"


def test_a_burst_that_repeats_none_ends_all_older_reasons_when_it_is_over() -> None:
    seen = burst(burst(NOTHING, 0, "accels", "home"), 30, "position")
    assert held(seen, 30.5) == ["accels", "home", "position"]
    assert held(seen, 30 + BURST) == ["position"]


def test_a_reason_that_one_burst_lacks_may_have_got_lost() -> None:
    seen = burst(NOTHING, 0, "accels", "gyros", "home", "compass")
    seen = burst(seen, 30, "accels", "gyros", "compass")
    assert held(seen, 59) == ["accels", "gyros", "home", "compass"]
    seen = burst(seen, 60, "accels", "gyros", "home", "compass")
    seen = burst(seen, 90, "accels", "gyros", "compass")
    assert held(seen, 119) == ["accels", "gyros", "home", "compass"], "missing twice, but not in a row"
    assert since(seen, "home") < 1.0


def test_a_reason_that_two_bursts_in_a_row_lack_has_ended() -> None:
    seen = burst(NOTHING, 0, "accels", "home")
    seen = burst(burst(seen, 30, "accels"), 60, "accels")
    assert held(seen, 60.9) == ["accels", "home"]
    assert held(seen, 61) == ["accels"]


def test_a_reason_that_is_repeated_at_once_begins_another_burst() -> None:
    """An attempt to arm, and the checks on request: recorded 10 ms apart."""
    seen = burst(NOTHING, 0, "accels", "attitude", prefix="Arm")
    seen = burst(seen, 1.04, "accels", "home", prefix="Arm")
    seen = burst(seen, 1.08, "accels", "home")
    assert held(seen, 1.5) == ["accels", "attitude", "home"]
    assert held(seen, 2.2) == ["accels", "home"]


def test_a_text_that_differs_in_measured_values_alone_is_the_same_reason() -> None:
    seen = burst(NOTHING, 0, "Check mag field (xy diff:171>100)", "GPS HDOP 2.7 (needs 1.4)")
    seen = burst(seen, 30, "Check mag field (xy diff:168>100)", "GPS HDOP 1.9 (needs 1.4)")
    assert held(seen, 32) == ["Check mag field (xy diff:168>100)", "GPS HDOP 1.9 (needs 1.4)"]
    assert since(seen, "Check mag field (xy diff:168>100)") == 0.0


def test_two_parts_are_two_reasons() -> None:
    seen = burst(NOTHING, 0, "GPS 1: Bad fix", "GPS 2: Bad fix", "RC10 minimum is wrong", "RC11 minimum is wrong")
    assert len(held(seen, 0.5)) == 4


def test_reasons_that_are_no_longer_repeated_end_after_three_periods() -> None:
    seen = burst(NOTHING, 0, "accels")
    assert held(seen, LASTS) == ["accels"]
    assert readiness.passed(seen, START.mono + LASTS + 0.1) is NOTHING


def test_the_number_of_reasons_is_bounded_and_the_first_of_a_burst_are_kept() -> None:
    words = [f"check {letter}" for letter in "abcdefghijklmnopqrstuvwxyz"]
    assert held(burst(NOTHING, 0, *words), 1.2) == words[:MOST]
    seen = NOTHING
    for number, word in enumerate(words):
        seen = burst(seen, 0.9 * number, word)
        assert len(seen.reasons) <= MOST
    seen = burst(burst(NOTHING, 0, "old"), 30, *words)
    assert "old" not in seen.reasons
    assert words[0] in seen.reasons


def test_a_text_alone_replaces_all_before_and_lasts() -> None:
    first = readiness.alone(NOTHING, "Preflight Fail: a", START)
    again = readiness.alone(first, "Preflight Fail: a", later(START, 5))
    assert again.reasons["Preflight Fail: a"].since == START
    other = readiness.alone(again, "Preflight Fail: b", later(START, 6))
    assert held(other, 10_000) == ["Preflight Fail: b"]
    assert other.reasons["Preflight Fail: b"].until == math.inf


def test_nothing_is_the_same_after_any_time() -> None:
    assert readiness.passed(NOTHING, math.inf) is NOTHING
