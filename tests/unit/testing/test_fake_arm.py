"""The fake controller, judged by `ur_rtde`, the usual client of Universal Robots' controllers."""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
from collections.abc import Iterator

import pytest

from mav_robot_status.testing.fake_arm import FakeArm
from tests.deadline import allow

RTDE_PORT = 30004
"""`ur_rtde` has no other one."""
SPEEDS = (0.1, -0.2, 0.3, -0.4, 0.5, -0.6)
READ = """\
import json, sys, time
from rtde_receive import RTDEReceiveInterface

names = ["timestamp", "robot_mode", "robot_status_bits", "safety_status_bits", "actual_qd"]
arm = RTDEReceiveInterface(sys.argv[1], 50.0, names)
wanted = json.loads(sys.argv[2])
for _ in range(int(float(sys.argv[3]) / 0.02)):
    read = [arm.getRobotMode(), arm.getRobotStatus(), arm.getSafetyStatusBits(), arm.getActualQd()]
    if read == wanted:
        break
    time.sleep(0.02)
print(json.dumps(read))
arm.disconnect()
"""

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("rtde_receive") is None, reason="ur_rtde is not installed: it has no wheel for this Python"
)


@pytest.fixture
def host() -> str:
    """An address of the loopback for this process, where the fixed port is free."""
    number = os.getpid()
    return f"127.{100 + number // 65025 % 100}.{number // 255 % 255}.{number % 255 or 1}"


@pytest.fixture
def arm(host: str) -> Iterator[FakeArm]:
    with FakeArm(RTDE_PORT, host=host) as arm:
        yield arm


def read(host: str, *wanted: object) -> list[object]:
    """What `ur_rtde` reads, once it is as wanted, or after some seconds."""
    command = [sys.executable, "-c", READ, host, json.dumps(wanted), str(allow(5))]
    done = subprocess.run(command, capture_output=True, text=True, timeout=allow(30), check=False)
    assert done.returncode == 0, done.stderr
    found: list[object] = json.loads(done.stdout.splitlines()[-1])
    return found


def test_ur_rtde_reads_what_was_set(arm: FakeArm, host: str) -> None:
    arm.joint_speeds = SPEEDS
    assert read(host, 7, 0b11, 0b1, list(SPEEDS)) == [7, 0b11, 0b1, list(SPEEDS)]


def test_ur_rtde_reads_an_emergency_stop(arm: FakeArm, host: str) -> None:
    arm.press_emergency_stop()
    stopped = [3, 0, 1 << 6 | 1 << 7 | 1 << 10, [0.0] * 6]
    assert read(host, *stopped) == stopped
