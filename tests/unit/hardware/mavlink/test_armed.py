from __future__ import annotations

import pytest

from mav_robot_status.hardware.mavlink.armed import NOT_MOVING_STATES, is_armed, may_move
from mav_robot_status.mavlink.definitions import Heartbeat

ARMED, HIL = 128, 32
ACTIVE, EMERGENCY = 4, 6


@pytest.mark.parametrize(
    ("base_mode", "state", "armed", "moves"),
    [
        (ARMED, ACTIVE, True, True),
        (0, ACTIVE, False, False),
        (ARMED | HIL, ACTIVE, True, False),
        (ARMED, EMERGENCY, True, False),
    ],
)
def test_a_heartbeat_says_armed_and_whether_the_vehicle_may_move(
    base_mode: int, state: int, armed: bool, moves: bool
) -> None:
    heartbeat = Heartbeat(0, 2, 3, base_mode, state, 3)
    assert (is_armed(heartbeat), may_move(heartbeat)) == (armed, moves)


def test_no_command_moves_a_vehicle_that_starts_calibrates_fails_shuts_down_or_is_terminated() -> None:
    assert sorted(NOT_MOVING_STATES) == [1, 2, 6, 7, 8]
