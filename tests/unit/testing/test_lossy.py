from __future__ import annotations

from mav_robot_status.testing.lossy import Lossy, LossyLink


def test_a_good_link_carries_everything_in_order() -> None:
    assert LossyLink[int](Lossy()).carry(range(100)) == list(range(100))


def test_a_bad_link_loses_repeats_and_reorders_the_same_each_time() -> None:
    quality = Lossy(0.2, 0.2, 0.2, seed=5)
    one, other = LossyLink[int](quality), LossyLink[int](quality)
    passed = [one.carry(range(start, start + 10)) for start in range(0, 1000, 10)]
    assert passed == [other.carry(range(start, start + 10)) for start in range(0, 1000, 10)]
    flat = [number for group in passed for number in group]
    assert 700 < len(set(flat)) < 900
    assert len(flat) > len(set(flat))
    assert flat != sorted(flat)


def test_what_is_held_back_arrives_with_the_next_group() -> None:
    link = LossyLink[int](Lossy(reordering=1.0))
    assert link.carry([1, 2]) == []
    assert link.carry([]) == [1, 2]
    assert link.carry([]) == []
