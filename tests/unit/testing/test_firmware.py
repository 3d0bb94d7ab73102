"""The messages of real firmware in the same situation, as rows of the project's truth table."""

from __future__ import annotations

from typing import Any

import pytest

from mav_robot_status.testing.firmware import Firmware, base_mode, not_armable, sensors, system_status
from mav_robot_status.testing.firmwares import ARDUCOPTER, ARDUROVER, PX4_QUAD

FLYING = {"armed": True, "landed_state": 2}
SEEN: list[tuple[str, Firmware, dict[str, Any], int, int, tuple[int, int, int]]] = [
    ("rover MANUAL disarmed", ARDUROVER, {}, 65, 4, (0x1361DC2F,) * 3),
    ("rover HOLD armed", ARDUROVER, {"custom_mode": 4, "armed": True}, 129, 3, (0x1361DC2F,) * 3),
    ("rover AUTO armed", ARDUROVER, {"custom_mode": 10, "armed": True}, 137, 4, (0x1361DC2F,) * 3),
    (
        "rover initialising",
        ARDUROVER,
        {"custom_mode": 16, "prearm": "x"},
        65,
        2,
        (0x1361DC2F, 0x1361DC2F, 0x0361DC2F),
    ),
    ("rover RC lost", ARDUROVER, {"custom_mode": 4, "armed": True, "failsafe": True}, 129, 5, (0x1361DC2F,) * 3),
    ("copter on the ground", ARDUCOPTER, {}, 81, 3, (0x5361FC2F,) * 3),
    ("copter armed on the ground", ARDUCOPTER, {"armed": True}, 209, 3, (0x5361FC2F,) * 3),
    ("copter not ready", ARDUCOPTER, {"prearm": "x"}, 81, 3, (0x5361FC2F, 0x5361FC2F, 0x4361FC2F)),
    ("copter LOITER in flight", ARDUCOPTER, FLYING | {"custom_mode": 5}, 217, 4, (0x5361FC2F,) * 3),
    ("copter safety switch, armed", ARDUCOPTER, {"safety_switch": True, "armed": True}, 209, 3,
     (0x5361FC2F, 0x53617C2F, 0x5361FC2F)),
    ("copter safety switch, disarmed", ARDUCOPTER, {"safety_switch": True}, 81, 3,
     (0x5361FC2F, 0x53617C2F, 0x4361FC2F)),
    ("copter boots", ARDUCOPTER, {"initialised": False}, 81, 4, (0x5361FC2F,) * 3),
    ("PX4 POSCTL ready", PX4_QUAD, {}, 81, 3, (0x0321882F, 0x0321882F, 0x1321882F)),
    ("PX4 not ready", PX4_QUAD, {"custom_mode": 65536, "prearm": "x"}, 81, 0, (0x0321882F,) * 3),
    ("PX4 mission", PX4_QUAD, FLYING | {"custom_mode": 67371008}, 157, 4, (0x0321882F, 0x0321882F, 0x1321882F)),
    ("PX4 offboard", PX4_QUAD, FLYING | {"custom_mode": 393216}, 145, 4, (0x0321882F, 0x0321882F, 0x1321882F)),
    ("PX4 RTL by a failsafe", PX4_QUAD, FLYING | {"custom_mode": 84148224, "failsafe": True}, 157, 5,
     (0x0321882F, 0x0321882F, 0x1321882F)),
    ("PX4 killed in flight", PX4_QUAD, FLYING | {"emergency_stop": True}, 209, 8, (0x0321882F,) * 3),
]  # fmt: skip


@pytest.mark.parametrize("row", SEEN, ids=[row[0] for row in SEEN])
def test_a_state_is_reported_as_by_real_firmware(row: tuple[str, Firmware, dict[str, Any], int, int, Any]) -> None:
    _, firmware, changes, expected_base_mode, expected_status, masks = row
    state = firmware.ready._replace(**changes)
    assert base_mode(firmware, state) == expected_base_mode
    assert system_status(firmware, state) == expected_status
    assert sensors(firmware, state, prearm_ok=not not_armable(state)) == masks


def test_a_field_that_a_test_sets_overrides_the_computed_value() -> None:
    state = ARDUROVER.ready._replace(base_mode=220, system_status=6, armed=True)
    assert base_mode(ARDUROVER, state) == 220
    assert system_status(ARDUROVER, state) == 6


@pytest.mark.parametrize(
    ("firmware", "changes", "outputs"),
    [
        (ARDUROVER, {"armed": True, "throttle": 31}, (1500, 0, 1655, 0)),
        (ARDUROVER, {"armed": True, "throttle": 81, "emergency_stop": True}, (1500, 0, 1500, 0)),
        (ARDUCOPTER, {}, (1000,) * 4),
        (ARDUCOPTER, {"armed": True}, (1128,) * 4),
        (ARDUCOPTER, {"armed": True, "throttle": 100, "emergency_stop": True}, (1000,) * 4),
        (PX4_QUAD, {}, (900,) * 4),
    ],
)
def test_motor_outputs_follow_throttle_and_stop(firmware: Firmware, changes: dict[str, Any], outputs: Any) -> None:
    assert firmware.outputs(firmware.ready._replace(**changes)) == outputs


@pytest.mark.parametrize("firmware", [ARDUROVER, ARDUCOPTER, PX4_QUAD], ids=lambda f: f.name)
def test_the_boot_leads_from_booting_to_ready(firmware: Firmware) -> None:
    state = firmware.booting
    assert not_armable(state)
    for s in firmware.boot:
        state = state._replace(**s.changes)
    assert state == firmware.ready
