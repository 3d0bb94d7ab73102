"""No counted call needs more instructions than its baseline."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from bench.guard import COUNTED, THIS_PYTHON, Verdict, baselines, compare

from ...deadline import allow
from ...docs.documents import ROOT


def test_no_call_needs_more_instructions_than_its_baseline() -> None:
    if THIS_PYTHON not in baselines():
        pytest.skip(f"no baseline for Python {THIS_PYTHON}; python -m bench.guard --update writes one")
    # in a separate process: the caches of other tests do not change the count
    done = subprocess.run(
        [sys.executable, "-m", "bench.guard"], cwd=ROOT, capture_output=True, text=True, timeout=allow(120),
        check=False, env={**os.environ, "PYTHONHASHSEED": "0"},
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout}{done.stderr}\nintended? python -m bench.guard --update"
    assert all(name in done.stdout for name in COUNTED)


def test_the_baseline_has_every_counted_call() -> None:
    assert all(list(numbers) == list(COUNTED) for numbers in baselines().values())


@pytest.mark.parametrize(("counted", "worse"), [(100.0, False), (104.0, False), (106.0, True), (50.0, False)])
def test_more_than_the_tolerance_is_worse(counted: float, worse: bool) -> None:
    assert Verdict("work", counted, 100.0).worse is worse


def test_a_new_call_is_worse_until_it_is_in_the_baseline() -> None:
    assert [verdict.worse for verdict in compare({"new": 10.0}, {})] == [True]
