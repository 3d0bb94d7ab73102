"""The simple_message server of the installed command, seen by an independent client."""

from __future__ import annotations

import contextlib
import random
import re
import signal
import socket
import struct
import time
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ..deadline import SOON, allow, in_time, wait_until
from .gateway_process import Gateway, run
from .robot_state import PING, REQUEST, STATUS, TOPIC, UNKNOWN, RobotState, Status
from .wire import Wire

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]
Connect = Callable[..., RobotState]

PORT = ("udpin:127.0.0.1:0", "--simple-message", "127.0.0.1:0")
MANUAL, AUTO = 1, 2
MISSION = 10  # custom_mode of a rover in AUTO
GROWTH = 5.0  # MB
MODES = {"MANUAL": MANUAL, "AUTO": AUTO, "UNKNOWN": -1}


def where(gate: Gateway) -> tuple[str, int]:
    """Where the server listens."""
    found = gate.wait_for_log(r"simple_message: listening on \[?([^\]]+)\]?:(\d+)/tcp")
    return found[1], int(found[2])


@pytest.fixture
def connect(ended: contextlib.ExitStack) -> Connect:
    """A client of a gateway, or of an address."""

    def connected(to: Gateway | tuple[str, int], **options: Any) -> RobotState:
        address = where(to) if isinstance(to, Gateway) else to
        return ended.enter_context(contextlib.closing(RobotState(address, **options)))

    return connected


def shown(line: dict[str, Any]) -> Status:
    """A JSON line as the client should see it."""
    values = {name: -1 if line[name] is None else int(line[name]) for name in Status._fields if name != "mode"}
    return Status(**values, mode=MODES[line["mode"]])


def pace(client: RobotState, seconds: float = 1.0) -> float:
    """Statuses a second."""
    client.status()
    began = time.monotonic()
    count = 0
    while time.monotonic() - began < seconds:
        client.status()
        count += 1
    return count / (time.monotonic() - began)


def test_a_client_sees_the_status_of_the_json_lines_and_unknown_stays_unknown(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT)
    rover = wire(gate.address).beating()
    client = connect(gate)
    rover.beat(armed=True, custom_mode=MISSION)
    client.wait_for(drives_powered=1, mode=AUTO)
    line = gate.wait_for(lambda s: s["drives_powered"] is True and s["mode"] == "AUTO").status
    assert line["in_motion"] is None
    client.wait_for(**shown(line)._asdict())
    rover.beat(armed=False, custom_mode=0)
    client.wait_for(drives_powered=0, motion_possible=0, mode=MANUAL)


def test_statuses_come_at_the_rate_of_the_controller_and_a_change_at_once(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT, "--rate", "2")
    rover = wire(gate.address).beating()
    client = connect(gate)
    client.wait_for(drives_powered=0)
    assert 1 < pace(client, 3) < 4
    armed = rover.beat(armed=True)
    client.wait_for(drives_powered=1)
    assert in_time(time.monotonic() - armed, 0.3)


def test_a_new_client_gets_the_present_status_without_a_periodic_one(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT, "--rate", "0")
    rover = wire(gate.address).beating()
    rover.beat(armed=True)
    gate.wait_for(lambda s: s["drives_powered"] is True)
    for _ in range(3):
        assert connect(gate).status().drives_powered == 1


def test_a_lost_vehicle_is_unknown_and_keeps_coming(
    gateway: StartGateway, wire: OpenWire, connect: Connect, tmp_path: Path
) -> None:
    config = tmp_path / "config.yaml"
    config.write_text("hardware: {heartbeat_timeout: 1}\n")
    gate = gateway(*PORT, "--config", str(config))
    rover = wire(gate.address).beating()
    client = connect(gate)
    rover.beat(armed=True)
    client.wait_for(drives_powered=1)
    rover.beating(False)
    client.wait_for(**UNKNOWN._asdict())
    for _ in range(10):
        assert client.status() == UNKNOWN
    assert 8 < pace(client, 2) < 12
    assert connect(gate).status() == UNKNOWN
    rover.beat(armed=True)
    client.wait_for(drives_powered=1)


def test_before_a_vehicle_is_heard_a_named_one_is_unknown_and_no_other_has_a_status(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    assert connect(gateway(*PORT, "--system", "7")).status() == UNKNOWN
    gate = gateway(*PORT)
    client = connect(gate)
    gate.wait_for_log("has connected")
    client.socket.settimeout(0.5)
    with pytest.raises(TimeoutError):
        client.status()


def test_a_ping_split_at_every_byte_is_answered_between_statuses_read_byte_by_byte(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT, "--rate", "50")
    wire(gate.address).beating()
    client = connect(gate)
    client.read_at_once = 1
    client.wait_for(drives_powered=0)
    ping = client.frame(PING, REQUEST)
    for number, cut in enumerate(range(1, len(ping)), 1):
        client.send(ping[:cut])
        for _ in range(8):  # the server looks at its clients every 0.1 s
            client.status()
        assert client.replies == number - 1
        client.send(ping[cut:])
        while client.replies < number:
            client.status()


def test_whatever_else_a_client_sends_is_ignored(gateway: StartGateway, wire: OpenWire, connect: Connect) -> None:
    gate = gateway(*PORT)
    rover = wire(gate.address).beating()
    other = connect(gate)
    other.wait_for(drives_powered=0)
    before = gate.memory()
    rng = random.Random(5)
    for sent in (
        struct.pack("<4i", 2**31 - 1, STATUS, TOPIC, 0) + bytes(100_000),
        struct.pack("<4i", -(2**31), 1, 2, 0),
        b"GET / HTTP/1.1\r\nHost: robot\r\n\r\n",
        rng.randbytes(100_000),
        other.frame(12, REQUEST, *range(20)) * 2000,
        other.frame(PING, REQUEST)[:7],
    ):
        client = connect(gate)
        client.socket.settimeout(allow(60))  # the server reads at its own pace
        client.send(sent)
        client.wait_for(drives_powered=0)
        assert client.replies == 0
        client.close()
    rover.beat(armed=True)
    other.wait_for(drives_powered=1)
    assert gate.memory() - before < GROWTH
    assert gate.stop() == 0
    assert not any("Traceback" in line for line in gate.log)


def test_half_a_frame_and_silence_takes_no_status_from_anybody(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT)
    rover = wire(gate.address).beating()
    silent, other = connect(gate), connect(gate)
    silent.send(silent.frame(PING, REQUEST)[:9])
    for client in (silent, other):
        client.wait_for(drives_powered=0)
    rover.beat(armed=True)
    for client in (silent, other):
        client.wait_for(drives_powered=1)


@pytest.mark.slow
def test_of_eight_clients_the_one_that_never_reads_is_disconnected_and_counted(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT, "--rate", "1000", "--json", "none", "--http", "127.0.0.1:0")
    rover = wire(gate.address).beating()
    silent = connect(gate, receive_buffer=1)
    reading = [connect(gate) for _ in range(7)]
    page = gate.wait_for_log(r"the page is at (http://\S+)/")[1]
    counted = re.compile(r'publisher_dropped_messages_total\{publisher="simple_message",number="1"\} 1$', re.MULTILINE)

    def dropped() -> bool:
        for client in reading:
            for _ in range(100):
                client.status()
        with urllib.request.urlopen(f"{page}/metrics", timeout=allow(SOON)) as answer:
            return bool(counted.search(answer.read().decode()))

    wait_until(dropped, 30)
    gate.wait_for_log(rf"simple_message on \S+: 127.0.0.1:{silent.socket.getsockname()[1]} does not read")
    assert sum("does not read" in line for line in gate.log) == 1
    with pytest.raises(ConnectionResetError):
        silent.wait_for_end()
    rover.beat(armed=True)
    for client in reading:
        client.wait_for(drives_powered=1)
    connect(gate).wait_for(drives_powered=1)


def test_a_ninth_client_is_refused_with_one_line_and_gets_the_place_of_one_that_leaves(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT)
    wire(gate.address).beating()
    clients = [connect(gate) for _ in range(8)]
    for client in clients:
        client.wait_for(drives_powered=0)
    for _ in range(3):
        connect(gate).wait_for_end()
    assert sum("refused: already 8 clients" in line for line in gate.log) == 1
    clients[0].close()

    def admitted() -> bool:
        with contextlib.suppress(AssertionError, ConnectionError):
            return connect(gate).status().drives_powered == 0
        return False

    wait_until(admitted)


def test_a_client_finds_a_restarted_gateway_on_the_same_port(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT)
    wire(gate.address).beating()
    client, address = connect(gate), where(gate)
    client.wait_for(drives_powered=0)
    assert gate.stop() == 0
    client.wait_for_end()
    again = gateway("udpin:127.0.0.1:0", "--simple-message", f"127.0.0.1:{address[1]}")
    wire(again.address).beating()
    assert where(again) == address
    connect(again).wait_for(drives_powered=0)


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGINT])
def test_the_last_status_of_a_gateway_that_ends_is_that_nothing_is_known(
    gateway: StartGateway, wire: OpenWire, connect: Connect, end: signal.Signals
) -> None:
    gate = gateway(*PORT)
    wire(gate.address).beating()
    client = connect(gate)
    client.wait_for(drives_powered=0)
    assert gate.stop(end) == 0
    assert struct.unpack("<11i", client.wait_for_end()) == (40, 13, 1, 0, *UNKNOWN)


def test_after_a_reload_no_client_keeps_a_status_of_before(
    gateway: StartGateway, wire: OpenWire, connect: Connect, tmp_path: Path
) -> None:
    file = tmp_path / "robot.yaml"
    text = "links: ['udpin:127.0.0.1:0']\nvehicles: [{{system: {}, handle: rover}}]\n"
    file.write_text(text.format(1))
    gate = gateway("--config", str(file), "--simple-message", "127.0.0.1:0")
    wire(gate.address).beating()
    client = connect(gate)
    client.wait_for(drives_powered=0)
    file.write_text(text.format(2))
    gate.process.send_signal(signal.SIGHUP)
    client.wait_for(drives_powered=-1)


def test_a_killed_gateway_frees_its_port(gateway: StartGateway, wire: OpenWire, connect: Connect) -> None:
    gate = gateway(*PORT)
    client, address = connect(gate), where(gate)
    gate.wait_for_log("has connected")
    assert gate.stop(signal.SIGKILL) == -signal.SIGKILL
    client.wait_for_end()
    assert where(gateway("udpin:127.0.0.1:0", "--simple-message", f"127.0.0.1:{address[1]}")) == address


def test_a_port_in_use_is_one_line_with_the_port_and_exit_code_1() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        place = f"127.0.0.1:{other.getsockname()[1]}"
        done = run("udpin:127.0.0.1:0", "--simple-message", place)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].endswith(
        f"simple_message: cannot listen on {place}/tcp: Address already in use"
    )
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("udpin:127.0.0.1:0", "--simple-message", "::1:11002"), "simple_message: '::1:11002' is not an address"),
        (("{log}", "--simple-message", ":0"), "a recorded log is not a live status: replay it without --simple-mess"),
        (("udpin:127.0.0.1:0", "--config", "{yaml}"), "c.yaml:3:16: simple_message: unknown option 'byteorder'; did"),
    ],
)
def test_a_wrong_option_is_one_line_and_exit_code_2(
    arguments: tuple[str, ...], told: str, demo_log: Path, tmp_path: Path
) -> None:
    (tmp_path / "c.yaml").write_text(
        "robot_status_controller:\n"
        "  type: mav_robot_status/IndustrialRobotStatusController\n"
        "  publishers: [{type: simple_message, byteorder: big}]\n"
    )
    done = run(*(one.format(log=demo_log, yaml=tmp_path / "c.yaml") for one in arguments))
    assert (done.returncode, done.stdout) == (2, "")
    assert told in done.stderr.splitlines()[-1]


def test_the_byte_order_of_the_other_controllers(
    gateway: StartGateway, wire: OpenWire, connect: Connect, tmp_path: Path
) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(
        "robot_status_controller:\n"
        "  type: mav_robot_status/IndustrialRobotStatusController\n"
        "  publishers: [{type: simple_message, host: 127.0.0.1, port: 0, byte_order: big}]\n"
    )
    gate = gateway("udpin:127.0.0.1:0", "--config", str(config))
    wire(gate.address).beating()
    client = connect(gate, order=">")
    client.wait_for(drives_powered=0, mode=MANUAL)
    client.send(client.frame(PING, REQUEST))
    while not client.replies:
        client.status()


def test_a_port_serves_one_vehicle_and_one_line_says_how_to_choose_another(
    gateway: StartGateway, wire: OpenWire, connect: Connect
) -> None:
    gate = gateway(*PORT)
    first, second = wire(gate.address), wire(gate.address, system=2)
    first.beating()
    client = connect(gate)
    client.wait_for(drives_powered=0)
    second.beat(armed=True)
    second.beating()
    gate.wait_for(lambda s: s["system"] == 2 and s["drives_powered"] is True)
    gate.wait_for_log(r"simple_message serves one handle, '\w+', and not '\w+/2\.1': choose another with --system N")
    for _ in range(20):
        assert client.status().drives_powered == 0
    chosen = gateway(*PORT, "--system", "2")
    wire(chosen.address).beating()
    wire(chosen.address, system=2).beating().beat(armed=True)
    connect(chosen).wait_for(drives_powered=1)


def both(places: list[tuple[str, str]]) -> list[tuple[str, str]]:
    """Two addresses, or none."""
    return places if len(places) == 2 else []


def test_each_controller_can_have_a_port_of_its_own(
    gateway: StartGateway, wire: OpenWire, connect: Connect, tmp_path: Path
) -> None:
    config = tmp_path / "config.yaml"
    config.write_text(
        "vehicles: [{system: 1, handle: rover}, {system: 2, handle: boat}]\n"
        + "".join(
            f"{name}_status:\n"
            "  type: mav_robot_status/IndustrialRobotStatusController\n"
            f"  handle_name: {name}\n"
            f"  publishers: [{{type: simple_message, port: 0, host: {host}}}]\n"
            for name, host in (("rover", "127.0.0.1"), ("boat", "localhost"))
        )
    )
    gate = gateway("udpin:127.0.0.1:0", "--config", str(config))
    wire(gate.address).beating()
    wire(gate.address, system=2).beating().beat(armed=True)
    listening = r"simple_message: listening on (\S+):(\d+)/tcp"
    places = wait_until(lambda: both(re.findall(listening, "\n".join(gate.log))))
    rover, boat = (connect((host.strip("[]"), int(port))) for host, port in places)
    rover.wait_for(drives_powered=0)
    boat.wait_for(drives_powered=1)
    assert rover.status().drives_powered == 0


def test_a_replay_opens_no_port(demo_log: Path, tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:  # in use: opening it would be an error
        config = tmp_path / "config.yaml"
        config.write_text(
            "robot_status_controller:\n"
            "  type: mav_robot_status/IndustrialRobotStatusController\n"
            f"  publishers: [json, {{type: simple_message, port: {other.getsockname()[1]}}}]\n"
        )
        done = run(str(demo_log), "--config", str(config))
    assert done.returncode == 0
    assert done.stdout


def test_the_demo_can_be_read_by_a_client(gateway: StartGateway, connect: Connect) -> None:
    demo = gateway("demo", "--simple-message", "127.0.0.1:0")
    client = connect(demo)
    client.wait_for(mode=MANUAL, drives_powered=0)
    assert demo.stop() == 0
    client.wait_for_end()


def test_it_listens_on_ipv6(gateway: StartGateway, wire: OpenWire, connect: Connect) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--simple-message", "[::1]:0")
    wire(gate.address).beating()
    assert where(gate)[0] == "::1"
    connect(gate).wait_for(drives_powered=0)
