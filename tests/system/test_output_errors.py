"""An output that fails: it is told once, tried again, and everything else goes on."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ..deadline import SOON, allow, wait_until
from ..ports import free_port
from .gateway_process import COMMAND, Gateway
from .wire import Wire

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]

GROWS_AGAIN = 20.0
"""Seconds after which a file grows when there is room again."""


def whole_lines(path: Path) -> list[int]:
    """The `seq` of each line of a file. Fails for half a line."""
    text = path.read_text("utf-8")
    assert text.endswith("\n")
    return [json.loads(line)["seq"] for line in text.splitlines()]


def powered(armed: bool) -> Callable[[Any], bool]:
    """Whether a ROBOT_STATUS says so."""
    return lambda message: bool(message.drives_powered == armed)


def room(gate: Gateway, size: int) -> None:
    """From now on no file of the gateway grows beyond `size` bytes (EFBIG)."""
    resource.prlimit(gate.process.pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))


def test_a_file_without_room_grows_again_and_everything_else_goes_on(
    gateway: StartGateway, wire: OpenWire, tmp_path: Path
) -> None:
    path, recording = tmp_path / "lines", tmp_path / "flight.tlog"
    gate = gateway(
        "udpin:127.0.0.1:0", "--out", "udpin:127.0.0.1:0", "--forward", "--json", str(path), "--record", str(recording)
    )
    rover = wire(gate.address).beating()
    ground = wire(("127.0.0.1", gate.ports(2)[1]), system=255, component=190).beating()
    wait_until(lambda: path.exists() and path.stat().st_size > 5000)
    room(gate, path.stat().st_size + 100)
    gate.wait_for_log("cannot write JSON lines to .*: File too large")
    full = whole_lines(path)
    for armed in (True, False, True):
        since = rover.beat(armed=armed)
        rover.wait_for("ROBOT_STATUS", powered(armed), after=since)
        ground.wait_for("HEARTBEAT", lambda m: m.get_srcSystem() == 1 and m.get_srcComponent() == 1, after=since)
    assert whole_lines(path) == full
    recorded = recording.stat().st_size
    room(gate, resource.RLIM_INFINITY)
    wait_until(lambda: path.stat().st_size > 10_000 and recording.stat().st_size > recorded, GROWS_AGAIN)
    assert gate.stop() == 0
    numbers = whole_lines(path)
    assert numbers == sorted(set(numbers))
    assert numbers[: len(full)] == full
    assert len([line for line in gate.log if "cannot write JSON lines" in line]) == 1
    assert any("lines again" in line or ("writing" in line and "again" in line) for line in gate.log)


def test_a_full_disk_does_not_end_the_gateway(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "/dev/full")
    rover = wire(gate.address).beating()
    gate.wait_for_log("cannot write JSON lines to /dev/full: No space left on device")
    rover.wait_for("ROBOT_STATUS", after=time.monotonic())
    assert gate.stop() == 0
    assert any(line.endswith("lines are not in it") for line in gate.log)


def test_standard_output_on_a_full_disk_does_not_end_the_gateway(wire: OpenWire) -> None:
    port = free_port()
    with (
        Path("/dev/full").open("wb") as full,
        subprocess.Popen([*COMMAND, f"udp:127.0.0.1:{port}"], stdout=full, stderr=subprocess.PIPE) as process,
    ):
        try:
            rover = wire(("127.0.0.1", port)).beating()
            rover.wait_for("ROBOT_STATUS", count=3)
            process.send_signal(signal.SIGTERM)
            _, log = process.communicate(timeout=allow(SOON))
        finally:
            process.kill()
    assert process.returncode == 0
    assert b"cannot write JSON lines to standard output: No space left on device" in log


def test_a_pipe_that_nobody_reads_yet_gets_lines_when_somebody_does(
    gateway: StartGateway, wire: OpenWire, tmp_path: Path
) -> None:
    path = tmp_path / "lines"
    os.mkfifo(path)
    gate = gateway("udpin:127.0.0.1:0", "--json", str(path))
    gate.wait_for_log("cannot write JSON lines to .*: nobody reads this pipe yet; trying again")
    wire(gate.address).beating()
    for _ in range(2):  # the second reader comes after the first has left
        reader = subprocess.Popen(["head", "-n", "3", str(path)], stdout=subprocess.PIPE, text=True)
        text, _ = reader.communicate(timeout=allow(GROWS_AGAIN))
        assert [json.loads(line)["link"]["state"] for line in text.splitlines()] == ["CONNECTED"] * 3
    assert gate.stop() == 0
