"""The events of PX4 in the recordings of the repository; with the real table and the large set, if they are there."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from mav_robot_status.gateway.logs.recorded_log import Recording
from mav_robot_status.hardware.mavlink.interface import MavlinkRobotHW
from mav_robot_status.hardware.mavlink.px4_events import EventTable
from mav_robot_status.hardware.mavlink.px4_events.parsing import parse
from mav_robot_status.hardware.mavlink.readiness.rule import can_arm
from mav_robot_status.mavlink.definitions import Event, SysStatus

from .replays import HERE, SHARED

TABLE = SHARED.parent / "data" / "px4_events" / "all_events.json.xz"
NO_TABLE = f"PX4's table of events is not in {TABLE.parent}"
OURS = sorted((HERE / "logs").glob("px4-*.tlog"))
LARGE = sorted((SHARED / "sitl").glob("px4-*.tlog"))
PREARM = 1 << 28


def counted(path: Path, table: EventTable | None) -> Counter[str]:
    """What a recording shows: its events, its reasons for not being ready, and can_arm against SYS_STATUS."""
    hw, found = MavlinkRobotHW(), Counter[str]()
    hw.use_event_table(None, table)
    for now, frame, _ in Recording(str(path)):
        if frame is None:
            continue
        hw.on_frame(frame, now)
        hw.read(now)
        vehicle = hw.find(1, 1)
        if vehicle is None or not vehicle.facts or frame[1] != (1, 1):
            continue
        message = frame[3]
        if type(message) is Event:
            found["events"] += 1
            found["unknown events"] += table is not None and message.id not in table.events
        elif type(message) is SysStatus and message.onboard_control_sensors_present and not vehicle.facts.armed:
            ready = bool(message.onboard_control_sensors_health & PREARM)
            found[f"ready {ready}, can arm {can_arm(vehicle.facts).name}"] += 1
        for inhibit in vehicle.handle.detail.inhibits:
            if inhibit.name == "PREARM_FAILING":
                found["no reason" if inhibit.text is None else "reason"] += 1
    return found


def test_the_recordings_are_there() -> None:
    assert len(OURS) >= 3


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.stem)
def test_a_recorded_px4_that_is_not_ready_has_reasons_without_a_table(path: Path) -> None:
    found = counted(path, None)
    assert found["events"] > 30
    assert found["reason"] > 100
    assert found["no reason"] < 0.01 * found["reason"]


@pytest.mark.skipif(not (TABLE.exists() and LARGE), reason=NO_TABLE)
def test_the_real_table_knows_every_event_and_agrees_with_sys_status() -> None:
    table = parse(TABLE.read_bytes())
    found = sum((counted(path, table) for path in LARGE), Counter[str]())
    assert found["events"] > 900
    assert found["unknown events"] == 0
    assert found["ready True, can arm FALSE"] == found["ready False, can arm TRUE"] == 0
    assert found["ready True, can arm TRUE"] > 200
    assert found["ready False, can arm FALSE"] > 30
    assert found["no reason"] < 0.01 * found["reason"]
