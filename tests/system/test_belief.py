"""Who may speak as a vehicle: no second sender makes the gateway call a live one safe."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.pymavlink_dialect import MAVLink, MAVLink_heartbeat_message, MAVLink_statustext_message

from ..deadline import SOON, Deadline
from .gateway_process import Gateway

ARMED, ROVER, COPTER, ARDUPILOT, STANDBY, ACTIVE = 128, 10, 2, 3, 3, 4
EMERGENCY, TERMINATION = 6, 8
HEARTBEAT = 0
HERE = "udpin:127.0.0.1:0"
SAFE = {"drives_powered": False, "motion_possible": False, "e_stopped": True}

StartGateway = Callable[..., Gateway]


class Vehicle:
    """A sender of heartbeats on one socket, with its own count of sequence numbers."""

    def __init__(
        self, *, armed: bool, component: int = 1, count: int = 0, kind: int = ROVER, state: int | None = None
    ) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.mav = MAVLink(None, srcSystem=1, srcComponent=component)
        self.mav.seq = count
        self.armed, self.kind, self.state = armed, kind, state
        self.to: Any = None
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def packed(self, message: Any) -> bytes:
        data: bytes = message.pack(self.mav)
        self.mav.seq = (self.mav.seq + 1) % 256
        return data

    def heartbeat(self) -> bytes:
        base_mode, state = (65 | ARMED, ACTIVE) if self.armed else (65, STANDBY)
        said = state if self.state is None else self.state
        return self.packed(MAVLink_heartbeat_message(self.kind, ARDUPILOT, base_mode, 0, said, 3))

    def send(self, data: bytes | None = None, via: Vehicle | None = None) -> float:
        """Send a heartbeat or these bytes, from the socket of another vehicle if it is given."""
        at = time.monotonic()
        with contextlib.suppress(OSError):
            (via or self).socket.sendto(self.heartbeat() if data is None else data, self.to)
        return at

    def beating(self, to: Any, period: float = 0.25) -> Vehicle:
        """Send heartbeats from a thread."""
        self.to = to
        self._stop.clear()

        def beat() -> None:
            while not self._stop.wait(period):
                self.send()

        self.send()
        self._thread = threading.Thread(target=beat, daemon=True)
        self._thread.start()
        return self

    def silence(self) -> None:
        self._stop.set()
        if self._thread is not None:
            self._thread.join()

    def close(self) -> None:
        self.silence()
        self.socket.close()


@pytest.fixture
def vehicle() -> Iterator[Callable[..., Vehicle]]:
    """Makes senders."""
    with contextlib.ExitStack() as stack:

        def make(**how: Any) -> Vehicle:
            made = Vehicle(**how)
            stack.callback(made.close)
            return made

        yield make


def unsafe(gate: Gateway, since: float) -> list[dict[str, Any]]:
    """The lines after this instant that call the robot safe."""
    return [
        line.status
        for line in gate.lines
        if line.at > since
        and line.status["link"]["state"] == "CONNECTED"
        and any(line.status[name] is value for name, value in SAFE.items())
    ]


def lines_for(gate: Gateway, seconds: float) -> None:
    """Wait until lines of so many seconds have arrived."""
    start, deadline = time.monotonic(), Deadline()
    while not gate.lines or gate.lines[-1].at < start + seconds:
        assert deadline.left + seconds
        time.sleep(0.05)


def conflict(status: dict[str, Any]) -> bool:
    return any(error["code"] == 9002 for error in status["errors"])


def test_datagrams_from_many_ports_do_not_push_the_vehicle_out_of_its_way(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE)
    real = vehicle(armed=True).beating(gate.address)
    start = gate.wait_for(lambda s: s["drives_powered"] is True).at
    for data in (b"x", b"\xfd\x09"):
        for _ in range(80):
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flooder:
                flooder.sendto(data, gate.address)
    forger = vehicle(armed=False, count=128).beating(gate.address, 0.05)
    lines_for(gate, 4)
    assert unsafe(gate, start) == []
    sent = time.monotonic()
    forger.silence()
    gate.wait_for(lambda s: s["drives_powered"] is True and not conflict(s), after=sent, seconds=SOON + 15)
    assert real.armed


def test_the_first_speaker_is_not_believed_against_an_armed_vehicle_elsewhere(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE)
    forger = vehicle(armed=False, count=128).beating(gate.address)
    gate.wait_for(lambda s: s["drives_powered"] is False)
    vehicle(armed=True).beating(gate.address)
    told = gate.wait_for(lambda s: s["drives_powered"] is True).at
    gate.wait_for(conflict, after=told, seconds=SOON + 6)
    assert gate.wait_for_log(r"two autopilots use the ids 1\.1: \S+, .* and \S+")
    assert gate.wait_for_log(r"Two senders speak as vehicle 1\.1: \S+ and \S+ \(armed and disarmed at the same time\)")
    lines_for(gate, 2)
    assert unsafe(gate, told) == []
    assert forger.to == gate.address


@pytest.mark.parametrize("state", [EMERGENCY, TERMINATION])
def test_a_first_speaker_that_is_armed_and_cannot_move_is_not_believed_against_one_that_can(
    state: int, gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE)
    vehicle(armed=True, state=state, count=128).beating(gate.address)
    gate.wait_for(lambda s: s["motion_possible"] is False)
    real = vehicle(armed=True).beating(gate.address)
    told = gate.wait_for(lambda s: s["motion_possible"] is True).at
    lines_for(gate, 2)
    real.silence()
    lines_for(gate, 1.0)
    real.beating(gate.address)
    lines_for(gate, 2)
    assert unsafe(gate, told) == []


def test_a_dropout_of_the_vehicle_does_not_make_a_disarmed_sender_the_vehicle(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE)
    real = vehicle(armed=True).beating(gate.address)
    start = gate.wait_for(lambda s: s["drives_powered"] is True).at
    vehicle(armed=False, count=128).beating(gate.address)
    real.silence()
    lines_for(gate, 2.2)
    real.beating(gate.address)
    lines_for(gate, 2)
    assert unsafe(gate, start) == []


def test_during_a_conflict_one_sender_that_says_live_is_believed_and_none_that_says_safe(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE)
    vehicle(armed=False, kind=COPTER).beating(gate.address)
    gate.wait_for(lambda s: s["drives_powered"] is False)
    vehicle(armed=True, count=128).beating(gate.address)
    found = gate.wait_for(conflict)
    lines_for(gate, 2)
    told = [line.status for line in gate.lines if line.at >= found.at]
    for name, value in (("drives_powered", True), ("motion_possible", True), ("in_motion", None), ("e_stopped", None)):
        assert {status[name] for status in told} == {value}
    assert {status["vehicle"]["flight_mode"] for status in told} == {None}
    assert all(conflict(status) for status in told)


def test_another_vehicle_with_the_ids_of_a_lost_one_inherits_nothing_of_it(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE)
    old = vehicle(armed=False, kind=COPTER).beating(gate.address)
    gate.wait_for(lambda s: s["drives_powered"] is False)
    old.send(old.packed(MAVLink_statustext_message(0, b"Crash: Disarming: AngErr=42")))
    gate.wait_for(lambda s: s["error_code"] == 4001)
    old.silence()
    lost = gate.wait_for(lambda s: s["link"]["state"] == "LOST").at
    vehicle(armed=False, kind=ROVER, count=77).beating(gate.address)
    back = gate.wait_for(lambda s: s["link"]["state"] == "CONNECTED", after=lost)
    assert back.status["vehicle"]["type"] == "GROUND_ROVER"
    assert gate.wait_for_log("another vehicle has these ids now")
    lines_for(gate, 1)
    assert not any(line.status["error_code"] == 4001 for line in gate.lines if line.at >= back.at)


def test_a_forged_datagram_to_the_port_of_a_sending_link_changes_nothing(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    real = vehicle(armed=True)
    real.socket.settimeout(SOON)
    gate = gateway(f"udpout:127.0.0.1:{real.socket.getsockname()[1]}")
    _, ours = real.socket.recvfrom(1000)
    real.beating(ours)
    start = gate.wait_for(lambda s: s["drives_powered"] is True).at
    vehicle(armed=False, count=10).beating(ours, 0.05)
    lines_for(gate, 3)
    told = [line.status for line in gate.lines if line.at >= start]
    assert {status["drives_powered"] for status in told} == {True}
    assert not any(conflict(status) for status in told)


def test_a_forged_datagram_to_the_port_of_a_broadcasting_link_makes_nothing_safe(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    real = vehicle(armed=True)
    real.socket.close()
    real.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    real.socket.bind(("0.0.0.0", 0))
    real.socket.settimeout(SOON)
    gate = gateway(f"udpbcast:127.255.255.255:{real.socket.getsockname()[1]}")
    ours = "127.0.0.1", real.socket.recvfrom(1000)[1][1]
    real.beating(ours)
    start = gate.wait_for(lambda s: s["drives_powered"] is True).at
    vehicle(armed=False, count=10).beating(ours, 0.05)
    lines_for(gate, 3)
    assert unsafe(gate, start) == []


def test_two_autopilots_that_alternate_on_one_channel_are_a_conflict_and_never_safe(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE)
    armed, disarmed = vehicle(armed=True), vehicle(armed=False, count=128)
    armed.to = disarmed.to = gate.address
    start = time.monotonic()
    for _ in range(20):
        armed.send()
        time.sleep(0.1)
        disarmed.send(via=armed)
        time.sleep(0.1)
    gate.wait_for(conflict)
    assert unsafe(gate, start) == []


def test_the_autopilot_component_gets_the_handle_of_its_system_from_a_forger(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE, "--system", "1")
    vehicle(armed=False, component=77).beating(gate.address)
    gate.wait_for(lambda s: s["component"] == 77 and s["drives_powered"] is False)
    sent = time.monotonic()
    vehicle(armed=True, count=128).beating(gate.address)
    gate.wait_for(lambda s: s["component"] == 1 and s["drives_powered"] is True, after=sent)


def test_forged_peers_do_not_keep_the_vehicle_from_being_a_peer(
    gateway: StartGateway, vehicle: Callable[..., Vehicle]
) -> None:
    gate = gateway(HERE)
    mav = MAVLink(None, srcSystem=1, srcComponent=1)
    for system in range(101, 165):
        mav.srcSystem = system
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as forger:
            forger.bind((f"127.2.0.{system}", 0))
            forger.sendto(MAVLink_heartbeat_message(ROVER, ARDUPILOT, 65, 0, STANDBY, 3).pack(mav), gate.address)
    gate.wait_for(lambda s: s["system"] == 164)
    real = vehicle(armed=True).beating(gate.address)
    ours: list[int] = []
    start = time.monotonic()
    while len(ours) < 5:  # the first may be requests: to them no peer is needed
        real.socket.settimeout(SOON + 10)
        message = MAVLink(None).parse_char(real.socket.recv(1000))
        ours += [message.get_msgId()] if message is not None and message.get_msgId() == HEARTBEAT else []
    assert time.monotonic() - start < 15 + SOON


def test_without_the_key_nobody_speaks_for_a_vehicle_that_signs(
    gateway: StartGateway, vehicle: Callable[..., Vehicle], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.delenv("STATE_DIRECTORY", raising=False)
    key = tmp_path / "key"
    key.write_text(bytes(range(1, 33)).hex())
    key.chmod(0o600)
    gate = gateway(HERE, "--signing-key", str(key))
    true = vehicle(armed=True)
    true.mav.signing.secret_key = bytes(range(1, 33))
    true.mav.signing.sign_outgoing = True
    true.mav.signing.timestamp = int((time.time() - 1_420_070_400) * 1e5)
    true.beating(gate.address)
    begun = gate.wait_for(lambda s: s["drives_powered"] is True).at
    forgers = [vehicle(armed=False, count=128).beating(gate.address, 0.05) for _ in range(3)]
    forgers += [vehicle(armed=False, component=component).beating(gate.address) for component in (2, 77)]
    stop = vehicle(armed=False)
    stop.to = gate.address
    for _ in range(20):
        stop.send(stop.packed(MAVLink_statustext_message(2, b"RC6: MotorEStop HIGH")))
        stop.send(stop.packed(MAVLink_statustext_message(2, b"RC6: MotorEStop HIGH")), via=true)
    lines_for(gate, 6)
    said = [line.status for line in gate.lines if line.at > begun]
    assert {status["drives_powered"] for status in said} == {True}
    assert {status["component"] for status in said} == {1}
    assert not any(status["e_stopped"] is True or status["errors"] for status in said)
    assert len(forgers) == 5
    assert gate.stop() == 0
