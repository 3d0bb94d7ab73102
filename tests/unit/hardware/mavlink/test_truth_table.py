"""The truth table of the specification (docs/semantics), row by row."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.interface import Detail

from .driver import derived
from .truth_table import CASES, OPTIONS, state_of


def test_the_table_has_all_its_rows() -> None:
    assert len(CASES) == 101
    assert len({case["id"] for case in CASES}) == 101


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_a_row_of_the_truth_table_holds(case: dict[str, Any]) -> None:
    state, now = state_of(case["inputs"])
    status = derived(state, Detail(), now, OPTIONS).status
    assert {name: int(getattr(status, name)) for name in case["expect"]} == case["expect"], case["note"]
