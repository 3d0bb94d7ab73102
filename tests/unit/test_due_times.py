from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from mav_robot_status.due_times import DueTimes


def test_nothing_is_due_at_first_and_after_the_last_key_has_gone() -> None:
    times: DueTimes[str] = DueTimes()
    assert times.first == math.inf
    times.set("a", 1.0)
    times.set("a", math.inf)
    assert (times.first, times.until(math.inf)) == (math.inf, [])


def test_a_key_has_its_latest_time_only() -> None:
    times: DueTimes[str] = DueTimes()
    for due in (5.0, 1.0, 3.0, 3.0):
        times.set("a", due)
    assert (times.first, times.first_key()) == (3.0, "a")
    assert (times.until(2.9), times.until(3.0)) == ([], ["a"])


@given(st.lists(st.tuples(st.integers(0, 9), st.sampled_from([-math.inf, 0.0, 1.0, 2.5, 7.0, math.inf]))))
def test_any_changes_leave_the_same_as_a_search_among_all(changes: list[tuple[int, float]]) -> None:
    times: DueTimes[int] = DueTimes()
    known: dict[int, float] = {}
    for key, due in changes:
        times.set(key, due)
        known[key] = due
    assert times.first == min(known.values(), default=math.inf)
    for now in (0.0, 1.0, 3.0):
        found = times.until(now)
        assert sorted(found) == sorted(key for key, due in known.items() if due <= now)
        assert [known[key] for key in found] == sorted(known[key] for key in found)
