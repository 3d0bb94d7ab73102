"""The group of a base and an arm through the installed command: is there any hazard, and can all of it work?"""

from __future__ import annotations

import contextlib
import json
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, Final

import pytest

from mav_robot_status.language import headline
from mav_robot_status.testing.fake_arm import FakeArm

from .gateway_process import Gateway, run

PERIOD: Final = 0.1  # s between two frames
FIELDS: Final = ("e_stopped", "drives_powered", "motion_possible", "in_motion", "in_error")
VALUES: Final = {"1": True, "0": False, "?": None}
BASE: Final = {"ready": (1, 0, 0, 0, 0, 2, 1), "off": (0, 0, 0, 0, 0, 2, 0), "stopped": (0, 1, 0, 0, 0, 2, 0)}
"""The bodies of STATUS: drives_powered, e_stopped, error_code, in_error, in_motion, mode, motion_possible."""
ARM: Final = {
    "ready": (7, 0b11, 1 << 0, 1),
    "stopped": (3, 0b00, 1 << 6 | 1 << 7, 7),
    "protective": (7, 0b11, 1 << 2, 3),
    "idle": (5, 0b11, 1 << 0, 1),
    "doubtful": (7, 0b11, 0, 1),
}
"""robot_mode, robot_status_bits, safety_status_bits, safety_status."""
ROWS: Final[tuple[tuple[str, str, str, dict[str, str]], ...]] = (
    ("ready", "ready", "01100", {}),
    ("ready", "stopped", "?1100", {"arm": "E_STOPPED"}),
    ("ready", "protective", "01101", {"arm": "PROTECTIVE_STOP"}),
    ("ready", "idle", "01100", {"arm": "BRAKES_ENGAGED"}),
    ("ready", "doubtful", "?110?", {"arm": "MOTION_UNKNOWN"}),
    ("off", "ready", "01100", {"base": "POWER_OFF"}),
    ("off", "stopped", "?0000", {"base": "POWER_OFF", "arm": "E_STOPPED"}),
    ("off", "protective", "01001", {"base": "POWER_OFF", "arm": "PROTECTIVE_STOP"}),
    ("off", "idle", "01000", {"base": "POWER_OFF", "arm": "BRAKES_ENGAGED"}),
    ("off", "doubtful", "?1?0?", {"base": "POWER_OFF", "arm": "MOTION_UNKNOWN"}),
    ("stopped", "ready", "?1100", {"base": "E_STOPPED"}),
    ("stopped", "stopped", "10000", {"base": "E_STOPPED", "arm": "E_STOPPED"}),
    ("stopped", "protective", "?1001", {"base": "E_STOPPED", "arm": "PROTECTIVE_STOP"}),
    ("stopped", "idle", "?1000", {"base": "E_STOPPED", "arm": "BRAKES_ENGAGED"}),
    ("stopped", "doubtful", "?1?0?", {"base": "E_STOPPED", "arm": "MOTION_UNKNOWN"}),
    ("lost", "ready", "?11??", {"base": "LINK_STALE"}),
    ("lost", "stopped", "?????", {"base": "LINK_STALE", "arm": "E_STOPPED"}),
    ("lost", "protective", "?1??1", {"base": "LINK_STALE", "arm": "PROTECTIVE_STOP"}),
    ("lost", "idle", "?1???", {"base": "LINK_STALE", "arm": "BRAKES_ENGAGED"}),
    ("lost", "doubtful", "?1???", {"base": "LINK_STALE", "arm": "MOTION_UNKNOWN"}),
    ("ready", "lost", "?11??", {"arm": "LINK_STALE"}),
    ("off", "lost", "?????", {"base": "POWER_OFF", "arm": "LINK_STALE"}),
    ("stopped", "lost", "?????", {"base": "E_STOPPED", "arm": "LINK_STALE"}),
)
"""Base, arm; the group's FIELDS; who is not ready, and why."""
SAFE: Final = ("EMERGENCY STOP", "CANNOT MOVE", "NOT READY")


class Base:
    """A robot that serves simple_message: the present body, ten times a second; None: it stays connected, silent."""

    def __init__(self) -> None:
        self.body: tuple[int, ...] | None = BASE["ready"]
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        threading.Thread(target=self._accept, daemon=True).start()

    def close(self) -> None:
        self._listener.close()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=self._serve, args=(self._listener.accept()[0],), daemon=True).start()

    def _serve(self, client: socket.socket) -> None:
        with client, contextlib.suppress(OSError):
            while True:
                if self.body is not None:
                    client.sendall(struct.pack("<11i", 40, 13, 1, 0, *self.body))
                time.sleep(PERIOD)


@pytest.fixture
def base() -> Iterator[Base]:
    with contextlib.closing(Base()) as base:
        yield base


@pytest.fixture
def arm() -> Iterator[FakeArm]:
    with FakeArm() as arm:
        yield arm


@pytest.fixture
def file(tmp_path: Path, base: Base, arm: FakeArm) -> Path:
    found = tmp_path / "robot.yaml"
    found.write_text(
        "hardware:\n"
        f"  - {{type: simple_message, name: base, host: 127.0.0.1, port: {base.port}}}\n"
        f"  - {{type: ur, name: arm, host: 127.0.0.1, port: {arm.port}, dashboard_port: {arm.dashboard_port}}}\n"
        "groups: {robot: {handles: [base, arm]}}\n"
        "robot_status_controller:\n"
        "  {type: mav_robot_status/IndustrialRobotStatusController, handle_name: robot}\n"
    )
    return found


def _is(expected: tuple[Any, ...], line: dict[str, Any]) -> bool:
    return shown(line) == expected


def shown(line: dict[str, Any]) -> tuple[Any, ...]:
    fields = tuple(line[name] for name in FIELDS)
    return fields, line["ready"], {one["handle"]: one["why"] for one in line["not_ready"]}


def test_every_combination_of_a_base_and_an_arm(
    gateway: Callable[..., Gateway], file: Path, base: Base, arm: FakeArm, validate: Callable[[Any], None]
) -> None:
    gate = gateway("--config", str(file))
    for of_base, of_arm, fields, not_ready in ROWS:
        base.body = BASE.get(of_base)
        arm.silent = of_arm == "lost"
        if not arm.silent:
            arm.robot_mode, arm.robot_bits, arm.safety_bits, arm.safety_status = ARM[of_arm]
        changed = time.monotonic()
        expected = (tuple(VALUES[sign] for sign in fields), not not_ready, not_ready)
        line = gate.wait_for(
            partial(_is, expected),
            after=changed,
            seconds=20,
            what=f"base {of_base}, arm {of_arm}",
        ).status
        validate(line)
        said = headline(line)
        assert all(name in " ".join(one.text for one in said.sentences) for name in not_ready), (said, not_ready)
        if line["motion_possible"] is not False:
            assert said.word not in SAFE
    assert gate.stop() == 0


def test_a_group_of_nobody_is_not_ready(gateway: Callable[..., Gateway], tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as nobody:
        port = nobody.getsockname()[1]
    gate = gateway("--arm", f"simple_message:127.0.0.1:{port}")
    line = gate.wait_for(lambda line: line["handle"] == "robot").status
    assert (line["ready"], line["not_ready"]) == (False, [{"handle": "arm", "why": "LINK_STALE"}])


def test_explain_says_who_is_not_ready(file: Path, base: Base, arm: FakeArm) -> None:
    arm.press_emergency_stop()
    done = run("explain", "--config", str(file), "--as-json")
    found = {one["handle"]: one for one in map(json.loads, done.stdout.splitlines())}
    assert (found["robot"]["ready"], found["robot"]["not_ready"]) == (False, [{"handle": "arm", "why": "E_STOPPED"}])
    assert "ready" not in found["arm"]
