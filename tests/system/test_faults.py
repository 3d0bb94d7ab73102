"""Faults of links in the field: the status of the installed command continues, and its memory does not grow."""

from __future__ import annotations

import contextlib
import itertools
import os
import random
import signal
import socket
import textwrap
import threading
import time
from collections.abc import Callable
from datetime import datetime, timedelta, timezone
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.testing import FakeAutopilot, ardurover
from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message

from ..deadline import allow, in_time, wait_until
from ..ports import free_port
from .bridges import Bridge, PtyBridge, TcpClientBridge, TcpServerBridge
from .gateway_process import Gateway
from .wire import Wire

LOST, CONNECTED = "LOST", "CONNECTED"
GROWTH = 5.0  # MB
FLOOD = 200_000  # frames
RATE = 50_000  # frames/s on an idle machine
STOPPED = 5.0  # s, longer than heartbeat_timeout
HOUR = timedelta(hours=1)

StartGateway = Callable[..., Gateway]
StartAutopilot = Callable[..., FakeAutopilot]
OpenWire = Callable[..., Wire]


@pytest.fixture
def bridge(ended: contextlib.ExitStack) -> Callable[[Bridge], Bridge]:
    """Start a bridge that the end of the test closes."""

    def start(made: Bridge) -> Bridge:
        made.start()
        ended.callback(made.close)
        return made

    return start


def stamped_in(*hours: str) -> Callable[[dict[str, Any]], bool]:
    return lambda status: status["stamp"][:13] in hours


def about_system_1(armed: bool) -> Callable[[Any], bool]:
    return lambda message: bool(message.subject_system == 1 and message.drives_powered == armed)


def state(name: str) -> Callable[[dict[str, object]], bool]:
    return lambda status: status["link"]["state"] == name  # type: ignore[index]


def goes_on_after_a_cut(gate: Gateway, cable: Bridge, autopilot: StartAutopilot) -> None:
    """Connected, cut, LOST with UNKNOWN fields, restored, connected with the present state."""
    rover = autopilot(ardurover.READY, cable.address)
    gate.wait_for(lambda s: s["drives_powered"] is False, what="a status")
    cable.cut()
    cut = time.monotonic()
    lost = gate.wait_for(state(LOST), after=cut, what="the loss")
    assert lost.status["drives_powered"] is None
    rover.arm()
    cable.mend()
    back = gate.wait_for(state(CONNECTED), after=lost.at, what="the return", seconds=15)
    assert back.status["drives_powered"] is True
    assert gate.process.poll() is None


def test_a_serial_device_that_is_unplugged_and_plugged_in_again(
    gateway: StartGateway, autopilot: StartAutopilot, bridge: Callable[[Bridge], Bridge], tmp_path: Path
) -> None:
    device = tmp_path / "ttyACM0"
    cable = bridge(PtyBridge(device))
    gate = gateway(f"{device},115200")
    goes_on_after_a_cut(gate, cable, autopilot)
    assert gate.stop() == 0
    assert any("vehicle 1.1 was lost once" in line for line in gate.log)


def test_a_serial_device_that_appears_after_the_start(
    gateway: StartGateway, autopilot: StartAutopilot, bridge: Callable[[Bridge], Bridge], tmp_path: Path
) -> None:
    device = tmp_path / "ttyACM0"
    gate = gateway(f"serial://{device}:57600")
    gate.wait_for_log(str(device))
    cable = bridge(PtyBridge(device))
    autopilot(ardurover.READY, cable.address)
    gate.wait_for(lambda s: s["drives_powered"] is False)
    assert gate.stop() == 0


def test_a_tcp_server_that_is_killed_and_started_again(
    gateway: StartGateway, autopilot: StartAutopilot, bridge: Callable[[Bridge], Bridge]
) -> None:
    cable = TcpServerBridge()
    bridge(cable)
    gate = gateway(f"tcp:127.0.0.1:{cable.port}")
    goes_on_after_a_cut(gate, cable, autopilot)
    assert sum("connection refused" in line.lower() for line in gate.log) <= 2  # told once a change, not once a try
    assert gate.stop() == 0


def test_a_tcp_client_that_disconnects_and_reconnects(
    gateway: StartGateway, autopilot: StartAutopilot, bridge: Callable[[Bridge], Bridge]
) -> None:
    port = free_port()
    gate = gateway(f"tcpin:127.0.0.1:{port}")
    gate.wait_for_log("listening on")
    goes_on_after_a_cut(gate, bridge(TcpClientBridge(port)), autopilot)
    assert gate.stop() == 0


def test_a_udp_peer_that_changes_its_port(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    before = wire(gate.address).beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    before.close()
    moved = wire(gate.address)
    moved.armed = True
    moved.beating()
    line = gate.wait_for(lambda s: s["drives_powered"] is True)
    assert not any(one.status["link"]["state"] == LOST for one in gate.lines)
    moved.wait_for("ROBOT_STATUS", after=line.at)
    assert gate.stop() == 0


def test_datagrams_truncated_duplicated_and_out_of_order(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address)
    rng = random.Random(4)
    waiting: list[bytes] = []
    for number in range(2000):
        message = MAVLink_heartbeat_message(10, 3, 65, number % 5, 4, 3)
        waiting.append(message.pack(rover.mav))
        if len(waiting) == 4:
            rng.shuffle(waiting)
            for data in waiting:
                rover.send(data[: rng.randrange(len(data))])
                rover.send(data)
                rover.send(data)
            waiting.clear()
    sent = rover.beating().beat(armed=True)
    gate.wait_for(lambda s: s["drives_powered"] is True, after=sent)
    vehicles = {(line.status["system"], line.status["component"]) for line in gate.lines}
    assert vehicles == {(1, 1)}
    assert gate.stop() == 0


@pytest.mark.slow
def test_memory_does_not_grow_with_a_hundred_megabytes_of_random_bytes(gateway: StartGateway) -> None:
    noise = random.Random(5).randbytes(1 << 20)
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        gate = gateway(f"tcp:127.0.0.1:{server.getsockname()[1]}")
        client, _ = server.accept()
        with client:
            mav = MAVLink(None, srcSystem=1, srcComponent=1)
            heartbeat = MAVLink_heartbeat_message(10, 3, 65, 0, 4, 3)
            client.sendall(noise[:200_000] + bytes(300) + heartbeat.pack(mav))
            gate.wait_for(lambda s: s["drives_powered"] is False)
            before = gate.memory()
            for number in range(100):
                client.sendall(noise[number:] + noise[:number])
            armed = bytes(300) + MAVLink_heartbeat_message(10, 3, 65 | 128, 0, 4, 3).pack(mav)

            def is_seen_armed() -> bool:
                """One heartbeat does not do: bytes that waited behind a flood count as old."""
                client.sendall(armed)
                return gate.lines[-1].status["drives_powered"] is True

            wait_until(is_seen_armed, 30)
            assert gate.memory() - before < GROWTH
    assert gate.stop() == 0
    assert any("bytes of garbage" in line for line in gate.log)


def test_a_flood_from_a_stranger_neither_hides_the_vehicle_nor_makes_it_grow(
    gateway: StartGateway, wire: OpenWire
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    rover = wire(gate.address).beating()
    rover.wait_for("ROBOT_STATUS")
    stranger = MAVLink(None, srcSystem=77, srcComponent=1)
    frames = [MAVLink_heartbeat_message(10, 3, 65, 0, 4, 3).pack(stranger)]
    frames += [MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(stranger) for _ in range(30)]
    datagram = b"".join(frames)
    stop = threading.Event()
    count = 0
    each = allow(1 / RATE)  # a machine that cannot read as much loses the frames of the rover, too

    def flood() -> None:
        nonlocal count
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.connect(gate.address)
            start = time.monotonic()
            while not stop.wait(max(0.0, start + count * each - time.monotonic())):
                with contextlib.suppress(OSError):
                    sender.send(datagram)
                count += len(frames)

    thread = threading.Thread(target=flood)
    started = time.monotonic()
    thread.start()
    try:
        gate.wait_for_log("heard vehicle 77.1")  # it is a vehicle for all we know
        wait_until(lambda: count >= FLOOD / 2)
        before = gate.memory()
        for armed in (True, False, True):
            sent = rover.beat(armed=armed)
            rover.wait_for("ROBOT_STATUS", about_system_1(armed), after=sent)
        wait_until(lambda: count >= FLOOD)
        rover.wait_for("HEARTBEAT", after=time.monotonic())
        assert gate.memory() - before < allow(GROWTH)  # a starved gateway reads a full socket buffer at once
    finally:
        stop.set()
        thread.join()
    assert in_time(time.monotonic() - started, 1.25 * count / RATE)
    assert gate.stop() == 0


def test_255_systems_at_once_each_have_a_status(gateway: StartGateway, wire: OpenWire) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--changes-only")
    mav = MAVLink(None)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(2):
            for system in range(1, 256):
                mav.srcSystem, mav.srcComponent = system, 1
                sender.sendto(MAVLink_heartbeat_message(10, 3, 65, 0, 4, 3).pack(mav), gate.address)
        gate.wait_for(lambda s: len({line.status["system"] for line in gate.lines}) == 255, what="255 systems")
    assert gate.memory() < 60
    assert gate.stop() == 0


STEPPED = """
    import os, time
    offset, unstepped = os.environ["OFFSET_FILE"], time.time_ns
    def time_ns():
        try:
            return unstepped() + int(open(offset).read()) * 10**9
        except (OSError, ValueError):
            return unstepped()
    time.time_ns = time_ns
"""


@pytest.fixture
def offset_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The error of the command's wall clock in seconds. Its Python loads the file at its start."""
    (tmp_path / "sitecustomize.py").write_text(textwrap.dedent(STEPPED))
    offset = tmp_path / "offset"
    monkeypatch.setenv("OFFSET_FILE", str(offset))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return offset


def test_a_clock_that_is_stepped_by_hours_changes_stamps_and_nothing_else(
    gateway: StartGateway, wire: OpenWire, offset_file: Path
) -> None:
    offset_file.write_text("0")
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address).beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    for hours in (5, -7):
        offset_file.write_text(str(hours * 3600))
        shown = datetime.fromtimestamp(time.time() + hours * 3600, timezone.utc)
        stepped = gate.wait_for(stamped_in(f"{shown:%Y-%m-%dT%H}", f"{shown + HOUR:%Y-%m-%dT%H}"))
        gate.wait_for_lines(20, after=stepped.at)
    arrivals = [line.at for line in gate.lines]
    assert in_time(max(b - a for a, b in itertools.pairwise(arrivals)), 1.0)
    assert not any(line.status["link"]["state"] == LOST for line in gate.lines)
    sent = rover.beat(armed=True)
    gate.wait_for(lambda s: s["drives_powered"] is True, after=sent)
    assert gate.stop() == 0


def test_a_process_that_was_stopped_for_seconds_continues_with_the_present(
    gateway: StartGateway, wire: OpenWire
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = wire(gate.address).beating()
    gate.wait_for(lambda s: s["drives_powered"] is False)
    gate.process.send_signal(signal.SIGSTOP)
    stopped = time.monotonic()
    rover.armed = True
    wait_until(lambda: rover.beats[-1] > stopped + STOPPED)
    resumed, resumed_unix = time.monotonic(), time.time()
    os.kill(gate.process.pid, signal.SIGCONT)
    gate.wait_for(lambda s: s["drives_powered"] is True, after=resumed)
    gate.wait_for_lines(12, after=resumed)
    first_second = [line for line in gate.lines if line.at > resumed and line.stamp < resumed_unix + 1.0]
    assert len(first_second) < 30  # the gateway does not catch up on the lines of the pause, 10 a second
    assert gate.stop() == 0
