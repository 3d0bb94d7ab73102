"""A ROS 2 network for the system tests: starts, stops and reads the programs of `ros2_programs`."""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..deadline import SOON, Deadline, allow, wait_until
from ..loopback import LOOPBACK

NO_ZENOH = next(
    (f"{name} is not installed: pip install -e '.[dev]'" for name in ("zenoh", "zenoh_ros2_sdk", "rosbags")
     if importlib.util.find_spec(name) is None), None)  # fmt: skip
NO_DDS = None if importlib.util.find_spec("cyclonedds") else "cyclonedds is not installed: no wheel for this Python"


OURS = (sys.executable, "-m", "tests.system.ros2_programs")
FAST_DDS_HEADERS = Path("/usr/include/fastdds/dds")
NO_FAST_DDS = NO_DDS or (
    None
    if shutil.which("g++") and FAST_DDS_HEADERS.exists()
    else "Fast DDS or g++ is not installed: apt-get install g++ libfastrtps-dev libfastcdr-dev"
)


class Program:
    """One program, from `ready` to the end of its standard input."""

    def __init__(
        self, *arguments: str, command: tuple[str, ...] = OURS, environment: dict[str, str] | None = None
    ) -> None:
        self.process = subprocess.Popen(
            [*command, *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "CYCLONEDDS_URI": LOOPBACK} if environment is None else environment,
        )
        assert self.process.stdout is not None
        self.heard: list[dict[str, Any]] = []
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()
        deadline = Deadline(SOON)
        while not self._ready.wait(0.1):
            assert deadline.left, f"{arguments} does not start"

    @property
    def statuses(self) -> list[dict[str, Any]]:
        return [one for one in list(self.heard) if "mode" in one]

    @property
    def diagnostics(self) -> list[dict[str, Any]]:
        return [one for one in list(self.heard) if "level" in one]

    def wait_for(self, wanted: Callable[[dict[str, Any]], bool], seconds: float = SOON) -> dict[str, Any]:
        found: dict[str, Any] = wait_until(lambda: next(filter(wanted, list(self.heard)), None), seconds, "not heard")
        return found

    def freeze(self) -> None:
        self.process.send_signal(signal.SIGSTOP)

    def kill(self) -> None:
        self.process.kill()
        self.close()

    def close(self) -> None:
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait(allow(SOON))
        self._thread.join(allow(SOON))
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            with contextlib.suppress(OSError):
                pipe.close()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line == "ready\n":
                self._ready.set()
            else:
                self.heard.append(json.loads(line))


def build_fast_dds_reader(folder: Path) -> str:
    """Compile the reader in C++; return its path."""
    reader, source = str(folder / "fastdds_reader"), str(Path(__file__).with_name("fastdds_reader.cpp"))
    command = ["g++", "-O0", "-o", reader, source, "-lfastrtps", "-lfastcdr"]
    subprocess.run(command, capture_output=True, check=True, timeout=allow(120))
    return reader


def tokens(port: int) -> list[str]:
    """The liveliness tokens of ROS nodes and topics that a router knows, seen by a client that comes and goes."""
    import zenoh

    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["tcp/127.0.0.1:{port}"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        return sorted(
            str(reply.ok.key_expr) for reply in session.liveliness().get("@ros2_lv/**", timeout=5) if reply.ok
        )
