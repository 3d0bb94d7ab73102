"""Requests for the parameters that assign outputs to motors."""

from __future__ import annotations

import math
from itertools import pairwise

from mav_robot_status.hardware.mavlink.requests.parameters import APART, FIRST, NAMES, PATIENCE, Parameters


def play(parameters: Parameters, start: float, seconds: float) -> list[tuple[float, str]]:
    """The requests and their times, in steps of 50 ms."""
    asked = []
    for step in range(round(seconds / 0.05) + 1):
        now = start + step * 0.05
        request = parameters.due(now)
        if request is not None:
            assert (request.param_index, request.target_system, request.target_component) == (-1, 1, 2)
            asked.append((now, request.param_id.decode()))
    return asked


def test_no_parameter_is_requested_before_the_streams() -> None:
    assert play(Parameters(1, 2, 100.0), 100.0, FIRST - 0.1) == []


def test_each_parameter_is_requested_once_and_separately() -> None:
    parameters = Parameters(1, 2, 100.0)
    asked = play(parameters, 105.0, len(NAMES) * (APART + 0.05))
    assert tuple(name for _, name in asked) == NAMES
    assert all(b - a >= APART - 1e-9 for (a, _), (b, _) in pairwise(asked))


def test_a_missing_parameter_is_requested_once_more_and_never_again() -> None:
    parameters = Parameters(1, 2, 100.0)
    for name in NAMES[2:]:
        parameters.heard(name)
    asked = play(parameters, 105.0, 120.0)
    assert [name for _, name in asked] == [*NAMES[:2], *NAMES[:2]]
    assert asked[2][0] - asked[1][0] >= PATIENCE
    assert parameters.next_due() == math.inf


def test_a_parameter_read_by_another_component_is_not_requested() -> None:
    parameters = Parameters(1, 2, 100.0)
    for name in NAMES:
        parameters.heard(name)
    assert play(parameters, 105.0, 60.0) == []
