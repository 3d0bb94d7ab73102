"""The folder in which the documents' commands run: a recorded log and the example configurations."""

from __future__ import annotations

import os
import pathlib
import shutil
import socket
import sys

import pytest

from mav_robot_status.testing import FakeAutopilot, ManualClock, ardurover

from ..loopback import LOOPBACK
from .documents import ROOT


@pytest.fixture(scope="session")
def flight_log(tmp_path_factory: pytest.TempPathFactory) -> pathlib.Path:
    """Twelve seconds of a rover, recorded as a ground station does."""
    path = tmp_path_factory.mktemp("recorded") / "flight.tlog"
    clock = ManualClock()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as here, path.open("wb") as log:
        here.bind(("127.0.0.1", 0))
        here.setblocking(False)
        rover = FakeAutopilot(ardurover.AUTO, to=here.getsockname())
        for _ in range(120):
            now = clock.advance(0.1)
            rover.poll(now)
            try:
                while True:
                    log.write(now.unix_us.to_bytes(8, "big") + here.recv(300))
            except BlockingIOError:
                pass
        rover.close()
    return path


@pytest.fixture
def place(tmp_path: pathlib.Path, flight_log: pathlib.Path, monkeypatch: pytest.MonkeyPatch) -> pathlib.Path:
    """The folder, as the current one, with the commands of this Python's environment on the path."""
    shutil.copy(flight_log, tmp_path)
    shutil.copytree(ROOT / "config", tmp_path / "config")
    for log in (ROOT / "tests" / "recorded" / "onboard").glob("rover-*"):
        shutil.copy(log, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CYCLONEDDS_URI", LOOPBACK)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", str(pathlib.Path(sys.executable).parent), prepend=os.pathsep)
    return tmp_path
