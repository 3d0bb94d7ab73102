"""An arm beside a vehicle in the installed command: one robot, and each fault of the arm's controller."""

from __future__ import annotations

import contextlib
import itertools
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from mav_robot_status.diagnosis.doctor.arm_diagnosis import ARM_CASES
from mav_robot_status.testing.fake_arm import FakeArm
from tests.docs.documents import table

from ..deadline import in_time, wait_until
from .gateway_process import Gateway, run
from .test_simple_message import where
from .wire import Wire

StartGateway = Callable[..., Gateway]
OpenWire = Callable[..., Wire]

VEHICLE = "industrial_robot_status_handle"
LINE_AFTER = 0.5
"""Seconds from a heartbeat to its line."""
PATIENCE = 3.0
"""Seconds for which no second line of the fault appears: five attempts to connect."""
SLOW = 0.1  # s for each byte


@pytest.fixture
def arm() -> Iterator[FakeArm]:
    with FakeArm() as arm:
        yield arm


@pytest.fixture
def server(ended: contextlib.ExitStack) -> Callable[[Callable[[socket.socket], object]], int]:
    """Serve each client with a function until the other end is gone; the port."""

    def serve(talk: Callable[[socket.socket], object]) -> int:
        listener = ended.enter_context(socket.create_server(("127.0.0.1", 0)))

        def talk_to(client: socket.socket) -> None:
            with client, contextlib.suppress(OSError):
                talk(client)

        def accept() -> None:
            with contextlib.suppress(OSError):
                while True:
                    threading.Thread(target=talk_to, args=(listener.accept()[0],), daemon=True).start()

        threading.Thread(target=accept, daemon=True).start()
        return int(listener.getsockname()[1])

    return serve


def of(handle: str, **members: Any) -> Callable[[dict[str, Any]], bool]:
    return lambda line: line["handle"] == handle and all(line[name] == value for name, value in members.items())


def ur(port: int) -> str:
    return f"ur:127.0.0.1:{port}"


def test_an_arm_and_a_vehicle_are_one_robot(
    gateway: StartGateway, wire: OpenWire, arm: FakeArm, validate: Callable[[Any], None]
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--arm", ur(arm.port))
    rover = wire(gate.address).beating()
    gate.wait_for(of("arm", drives_powered=True, motion_possible=True))
    gate.wait_for(of(VEHICLE, drives_powered=False))
    line = gate.wait_for(of("robot", drives_powered=True, motion_possible=True))  # one member is enough
    assert line.status["inhibits"] == []
    pressed = time.monotonic()
    arm.press_emergency_stop()
    gate.wait_for(of("arm", e_stopped=True), after=pressed)
    line = gate.wait_for(of("robot", e_stopped=None, motion_possible=False), after=pressed)  # nobody stopped the rover
    assert {one["handle"] for one in line.status["inhibits"]} == {VEHICLE, "arm"}
    assert "E_STOPPED" in {one["name"] for one in line.status["inhibits"] if one["handle"] == "arm"}
    armed = rover.beat(armed=True)
    line = gate.wait_for(of("robot", e_stopped=None, drives_powered=True, motion_possible=True), after=armed)
    validate(line.status)
    assert gate.stop() == 0


def test_an_arm_alone_needs_no_connection(gateway: StartGateway, arm: FakeArm) -> None:
    gate = gateway("--arm", ur(arm.port))
    gate.wait_for(of("robot", drives_powered=True, motion_possible=True))
    assert gate.stop() == 0


def test_a_group_stands_on_the_group_of_another_gateway(gateway: StartGateway, wire: OpenWire, arm: FakeArm) -> None:
    inner = gateway("udpin:127.0.0.1:0", "--simple-message", "127.0.0.1:0", "--system", "1")
    rover = wire(inner.address).beating()
    host, port = where(inner)
    outer = gateway("--arm", f"simple_message:{host}:{port}", "--arm", ur(arm.port))
    outer.wait_for(of("arm2", drives_powered=True))
    outer.wait_for(of("arm", drives_powered=False, motion_possible=False))
    outer.wait_for(of("robot", drives_powered=True, motion_possible=True))
    armed = rover.beat(armed=True, custom_mode=10)
    seen = outer.wait_for(of("arm", drives_powered=True, mode="AUTO"), after=armed)
    assert in_time(seen.at - armed, 1.0)
    inner.stop()
    lost = outer.wait_for(lambda line: line["handle"] == "arm" and line["link"]["state"] == "LOST")
    assert (lost.status["mode"], lost.status["drives_powered"]) == ("UNKNOWN", None)
    outer.wait_for(of("robot", drives_powered=True, motion_possible=True, e_stopped=None), after=lost.at)
    assert outer.stop() == 0


class Relay:
    """Passes the bytes of a controller on, one at a time."""

    def __init__(self, port: int) -> None:
        self._port = port

    def __call__(self, client: socket.socket) -> None:
        with socket.create_connection(("127.0.0.1", self._port)) as controller:
            threading.Thread(target=self._up, args=(client, controller), daemon=True).start()
            while data := controller.recv(1):
                client.sendall(data)
                time.sleep(SLOW)

    @staticmethod
    def _up(client: socket.socket, controller: socket.socket) -> None:
        with contextlib.suppress(OSError):
            while data := client.recv(100):
                controller.sendall(data)


def silent(client: socket.socket) -> None:
    while client.recv(1000):
        pass


def garbage(client: socket.socket) -> None:
    client.sendall(b"Connected: Universal Robots Dashboard Server\n")
    silent(client)


@pytest.mark.parametrize(
    ("talk", "logged"),
    [
        (silent, "arm: the protocol version did not arrive within 3 s"),
        (garbage, "arm: this is not RTDE; it begins with 43 6f 6e 6e 65 63 74 65 64 3a 20 55"),
        (None, "connecting to 127.0.0.1:{port}/tcp: connection refused, trying again"),
        ("slow", "arm: the types of the values did not arrive within 3 s"),
        ("old", "arm: the controller does not speak RTDE version 2: it is too old"),
    ],
    ids=["silent", "garbage", "away", "slow", "old"],
)
def test_a_fault_of_the_controller_is_one_line_and_the_vehicle_is_not_late(
    gateway: StartGateway,
    wire: OpenWire,
    arm: FakeArm,
    server: Callable[..., int],
    talk: Callable[[socket.socket], object] | str | None,
    logged: str,
) -> None:
    port = arm.port
    arm.speaks_version_2 = talk != "old"
    if talk is None:
        arm.close()
    elif talk != "old":
        port = server(Relay(arm.port) if talk == "slow" else talk)
    gate = gateway("udpin:127.0.0.1:0", "--arm", ur(port), "-v")
    rover = wire(gate.address).beating()
    gate.wait_for(of("robot", drives_powered=None))
    line = logged.format(port=port)
    gate.wait_for_log(line)
    until = time.monotonic() + PATIENCE
    modes = itertools.cycle(((10, "AUTO"), (0, "MANUAL")))
    while (left := until - time.monotonic()) > 0:
        armed = left < PATIENCE / 2
        custom_mode, mode = next(modes)
        sent = rover.beat(armed=armed, custom_mode=custom_mode)
        seen = gate.wait_for(of(VEHICLE, drives_powered=armed, mode=mode), after=sent)
        assert in_time(seen.at - sent, LINE_AFTER)
        # one member that is powered proves it; one that is not proves nothing of the arm
        gate.wait_for(of("robot", drives_powered=True if armed else None, e_stopped=None), after=sent)
        time.sleep(0.2)
    assert not [one for one in gate.lines if of("arm")(one.status) and one.status["link"]["state"] == "CONNECTED"]
    assert [text for text in gate.log if "arm: " in text or f":{port}/tcp: " in text] == [f"mav-robot-status: {line}"]
    assert gate.stop() == 0


def test_a_controller_that_reboots_is_one_line_and_comes_back(
    gateway: StartGateway, wire: OpenWire, arm: FakeArm
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--arm", ur(arm.port))
    wire(gate.address).beating()
    gate.wait_for(of("arm", drives_powered=True))
    time.sleep(2.2)  # the connection is stable
    arm.robot_mode, arm.robot_bits = 2, 0
    arm.drop_clients()
    line = gate.wait_for(of("arm", drives_powered=False))
    assert [one["name"] for one in line.status["inhibits"]] == ["BOOTING"]
    arm.run_program()
    gate.wait_for(of("arm", drives_powered=True, motion_possible=True), after=line.at)
    lost = f"mav-robot-status: lost 127.0.0.1:{arm.port}/tcp: closed by the other end, trying again"
    assert [text for text in gate.log if "arm: " in text or text == lost] == [lost]
    assert gate.stop() == 0


def test_values_that_a_controller_does_not_know_are_one_line_and_unknown(gateway: StartGateway, arm: FakeArm) -> None:
    arm.unknown = frozenset({"safety_status_bits", "actual_qd"})
    gate = gateway("--arm", ur(arm.port))
    gate.wait_for(of("robot", drives_powered=True, e_stopped=None, motion_possible=None, in_motion=None))
    arm.drop_clients()
    wait_until(lambda: sum(f"connected to 127.0.0.1:{arm.port}/tcp" in line for line in gate.log) > 0)
    gate.wait_for(of("robot", drives_powered=True), after=time.monotonic())
    logged = [line for line in gate.log if "arm: " in line]
    assert logged == ["mav-robot-status: arm: the controller does not know safety_status_bits, actual_qd"]
    assert gate.stop() == 0


def test_explain_names_the_member_that_decided(arm: FakeArm) -> None:
    done = run("explain", "--arm", ur(arm.port), "--as-json")
    assert done.returncode == 0, done.stderr
    found = {one["handle"]: one["fields"] for one in map(json.loads, done.stdout.splitlines())}
    assert found["robot"]["e_stopped"]["value"] is False
    assert found["robot"]["e_stopped"]["rule"] == "arm: emergency stop bits, and no other safety_status beside them"
    assert found["arm"]["e_stopped"]["source"] == "safety_status_bits 0x001"


@pytest.mark.parametrize("arguments", [("--arm", "kuka:10.0.0.1"), ("watch", "--arm", "ur:"), ("doctor", "--arm", "x")])
def test_a_wrong_arm_is_one_line(arguments: tuple[str, ...]) -> None:
    done = run(*arguments)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert "write for example --arm ur:192.168.1.30" in done.stderr


@pytest.mark.slow
def test_doctor_tells_why_an_arm_has_no_status(arm: FakeArm, server: Callable[..., int]) -> None:
    def half_a_frame(client: socket.socket) -> None:
        client.sendall(b"\0\4V\1\0")
        silent(client)

    half = server(half_a_frame)
    arms = [ur(arm.port), ur(arm.dashboard_port), ur(half), f"simple_message:127.0.0.1:{server(silent)}"]
    done = run("doctor", *(word for one in arms for word in ("--arm", one)), "--seconds", "1", "--as-json")
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert [one["connection"] for one in found] == arms
    assert [one["handle"] for one in found] == ["arm", "arm2", "arm3", "arm4"]
    assert [one["cause"] for one in found] == ["ok", "dashboard-port", "incomplete", "tcp-silent"]
    assert found[0]["status"]["drives_powered"] is True
    assert done.returncode == 1
    arm.close()
    done = run("doctor", "--arm", arms[0], "--seconds", "1")
    assert f"{arms[0]}: 127.0.0.1:{arm.port} refuses the connection" in done.stdout
    assert done.stdout.splitlines()[1].startswith("next: write the port of the controller, usually ur:127.0.0.1:30004;")
    assert done.returncode == 1


def test_doctor_lists_the_causes_of_the_reference() -> None:
    rows = table("docs/reference/doctor.md", "cause", "## Arms")
    assert rows == [[case.cause, case.meaning] for case in ARM_CASES]
