"""The truth table of the specification, row by row."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.hardware.derive import derive
from mav_robot_status.interface import Detail

from .truth_table import CASES, OPTIONS, memory_of


def test_the_table_has_all_its_rows() -> None:
    assert len(CASES) == 101
    assert len({case["id"] for case in CASES}) == 101


@pytest.mark.parametrize("case", CASES, ids=[case["id"] for case in CASES])
def test_a_row_of_the_truth_table_holds(case: dict[str, Any]) -> None:
    memory, now = memory_of(case["inputs"])
    status = derive(memory, (1, 1), Detail(), now, OPTIONS).status
    assert {name: int(value) for name, value in status._asdict().items()} == case["expect"], case["note"]
