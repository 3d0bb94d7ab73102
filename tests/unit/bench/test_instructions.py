"""Instructions are counted exactly."""

from __future__ import annotations

import pytest

from bench.instructions import count


def some_work(times: int) -> int:
    return sum(i * i for i in range(times))


def test_the_same_work_has_the_same_count() -> None:
    assert count(lambda: some_work(100)) == count(lambda: some_work(100)) > 100


def test_more_work_has_a_larger_count() -> None:
    more = count(lambda: some_work(110)) / count(lambda: some_work(100))
    assert more == pytest.approx(1.1, abs=0.05)


def test_the_instructions_of_one_file_can_be_excluded() -> None:
    assert count(lambda: some_work(100), without=__file__) == 0
