"""`doctor` with the installed command: a real socket or pseudo-terminal has each of the causes."""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import json
import os
import re
import socket
import termios
import threading
import time
import tty
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.diagnosis.doctor.diagnosis import CASES
from mav_robot_status.mavlink.definitions import Heartbeat, SysStatus, SystemTime
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.signing import Signer
from mav_robot_status.testing import FakeAutopilot, Scenario, arducopter, ardurover, px4
from mav_robot_status.testing.scenario import by_satellite
from tests.docs.documents import table

from ..deadline import Deadline, allow, in_time
from ..ports import free_port
from .gateway_process import run

ROOT = Path(__file__).parents[2]
LOG = ROOT / "tests" / "recorded" / "logs" / "ardurover-4.5.6-auto.tlog"
PR_CAPBSET_DROP = 24
ABSENT = "198.51.100.7"
"""An address for documentation (RFC 5737), which no computer has."""
ROVER, COPTER = Heartbeat(0, 10, 3, 65, 4, 3), Heartbeat(0, 2, 3, 81, 3, 3)
GCS = Heartbeat(0, 6, 8, 192, 4, 3)
SYS_STATUS = SysStatus(*[1] * len(SysStatus._fields))
KEY = bytes(range(32))

Make = Callable[[int], list[bytes]]


class Source:
    """Calls `write` with what `make` says, ten times a second, until closed."""

    def __init__(self, write: Callable[[bytes], Any], make: Make) -> None:
        self._write, self._make = write, make
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        tick = 0
        while not self._stop.is_set():
            for data in self._make(tick):
                with contextlib.suppress(OSError):  # nobody is there yet, or any more
                    self._write(data)
            tick += 1
            self._stop.wait(0.1)


@pytest.fixture
def port() -> int:
    """A free UDP port."""
    return free_port(socket.SOCK_DGRAM)


@pytest.fixture
def send(ended: contextlib.ExitStack, port: int) -> Callable[..., None]:
    """Send by UDP from an address of its own."""

    def begin(make: Make, to: tuple[str, int] = ("127.0.0.1", port)) -> None:
        sender = ended.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
        ended.enter_context(contextlib.closing(Source(lambda data: sender.sendto(data, to), make)))

    return begin


class Terminal:
    """A pseudo-terminal: `device` is what the command opens."""

    def __init__(self) -> None:
        self.master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.device = os.ttyname(self._slave)

    def write(self, data: bytes) -> None:
        os.write(self.master, data)

    def baud(self) -> int:
        """The rate that the program with the open device has set."""
        return {getattr(termios, f"B{b}"): b for b in (38400, 57600, 115200)}.get(termios.tcgetattr(self.master)[5], 0)

    def close(self) -> None:
        os.close(self.master)
        os.close(self._slave)


@pytest.fixture
def terminal(ended: contextlib.ExitStack) -> Terminal:
    return ended.enter_context(contextlib.closing(Terminal()))


@pytest.fixture
def server(ended: contextlib.ExitStack) -> socket.socket:
    """A TCP server that does nothing by itself."""
    made = ended.enter_context(socket.socket())
    made.bind(("127.0.0.1", 0))
    made.listen(0)
    return made


def examined(cause: str, *arguments: str, seconds: float = 0.8, **options: Any) -> dict[str, Any]:
    """The report of the command. It names this cause, and the exit code agrees with `ok`.

    While it names another one, because a slow machine sends too little in that time, the command listens twice as long.
    """
    deadline = Deadline()
    report, code = reported(seconds, *arguments, **options)
    while report["cause"] != cause:
        assert deadline.left, report
        seconds *= 2
        report, code = reported(seconds, *arguments, **options)
    assert code == (0 if report["ok"] else 1)
    return report


def reported(seconds: float, *arguments: str, **options: Any) -> tuple[dict[str, Any], int]:
    """The report of the command and its exit code."""
    done = run("doctor", "-q", "--as-json", "--seconds", str(seconds), *arguments, **options)
    assert "Traceback" not in done.stderr, done.stderr
    return json.loads(done.stdout), done.returncode


def says(report: dict[str, Any], found: str, then: str) -> None:
    assert found in report["found"][0]
    assert then in report["next"]


def heed_permissions() -> None:
    """Even the superuser needs a permission then (capabilities 1 and 2, that override it, are dropped)."""
    if os.getuid() == 0:
        for capability in (1, 2):
            assert ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, capability, 0, 0, 0) == 0


def speaking(*messages: Any, version: int = 2, system: int = 1, component: int = 1, begin: int = 0) -> Make:
    """These messages again and again, numbered in sequence."""

    def make(tick: int) -> list[bytes]:
        first = begin + tick * len(messages)
        return [
            encode(m, system=system, component=component, sequence=(first + i) % 256, version=version)
            for i, m in enumerate(messages)
        ]

    return make


def spoilt(make: Make) -> Make:
    """The same frames, each with a CRC as of another definition."""
    return lambda tick: [frame[:-1] + bytes([frame[-1] ^ 0x55]) for frame in make(tick)]


# -- the link cannot be opened -----------------------------------------------------------------------------------------


def test_a_taken_port_and_its_owner(port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", port))
        report = examined("port-taken", f"udp:127.0.0.1:{port}")
    says(report, f"udp port {port} on 127.0.0.1 is taken by ", "stop it or listen on another port")
    assert f"(pid {os.getpid()})" in report["found"][0]


def test_a_device_without_permission(terminal: Terminal) -> None:
    os.chmod(terminal.device, 0)
    report = examined("no-permission", terminal.device, preexec_fn=heed_permissions)
    says(report, f"{terminal.device}: no permission", "its owner")


def test_a_file_that_is_not_a_serial_device() -> None:
    says(examined("cannot-open", "/dev/null"), "/dev/null: not a serial device", "write another connection")


# -- nothing comes -----------------------------------------------------------------------------------------------------


def test_a_missing_device(tmp_path: Path) -> None:
    report = examined("device-missing", f"serial://{tmp_path}/ttyACM7:57600")
    says(report, f"there is no {tmp_path}/ttyACM7; serial devices here: ", "")


def test_a_device_that_another_program_holds(terminal: Terminal) -> None:
    with open(terminal.device, "rb", buffering=0) as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        says(examined("device-held", terminal.device), f"{terminal.device} is held by ", "end that program")


@pytest.mark.parametrize("kind", ["udp", "tcpin"])
def test_an_address_that_this_computer_does_not_have(kind: str) -> None:
    report = examined("no-such-address", f"{kind}:{ABSENT}:14550")
    says(report, f"this computer has no address {ABSENT}", f"{kind}:0.0.0.0:14550")


@pytest.mark.parametrize("kind", ["udpout", "tcp"])
def test_an_unknown_host_name(kind: str) -> None:
    says(examined("unknown-name", f"{kind}:nowhere.invalid:14550"), "the name nowhere.invalid is unknown", "address")


def test_a_sender_that_sends_to_another_address_of_this_computer(send: Callable[..., None], port: int) -> None:
    send(speaking(ROVER))
    report = examined("elsewhere", f"udp:127.0.0.2:{port}")
    says(report, f"it does on udp:0.0.0.0:{port}", f"write udp:0.0.0.0:{port}")


def test_a_serial_device_at_another_rate(ended: contextlib.ExitStack, terminal: Terminal) -> None:
    good = speaking(ROVER)
    make: Make = lambda tick: good(tick) if terminal.baud() == 115200 else [b"\x8c\x03\x9e" * 9]  # noqa: E731
    ended.enter_context(contextlib.closing(Source(terminal.write, make)))
    report = examined("elsewhere", f"{terminal.device},57600")
    says(report, f"it does on {terminal.device},115200", f"write {terminal.device},115200")


def test_a_udp_port_without_a_sender(port: int) -> None:
    report = examined("udp-silent", f"udp:127.0.0.1:{port}")
    says(report, f"nothing was sent to UDP port {port}", f"udp:0.0.0.0:{port}")


def test_a_passive_sender_is_not_answered(port: int) -> None:
    says(examined("must-speak", f"udpout:127.0.0.1:{port}", "--passive"), "--passive", "remove --passive")


def test_a_udp_port_without_a_listener(port: int) -> None:
    report = examined("udp-refused", f"udpout:127.0.0.1:{port}")
    says(report, "nothing listens on that UDP port", f"udp:0.0.0.0:{port}")


def test_a_udp_peer_that_receives_and_does_not_answer() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.bind(("127.0.0.1", 0))
        peer.settimeout(allow(5))
        says(examined("no-answer", f"udpout:127.0.0.1:{peer.getsockname()[1]}"), "does not answer", "firewall")
        heartbeat = peer.recv(300)
    assert (heartbeat[5], heartbeat[6], int.from_bytes(heartbeat[7:10], "little")) == (245, 192, 0)


def test_a_tcp_port_without_a_listener() -> None:
    where = f"127.0.0.1:{free_port(socket.SOCK_STREAM)}"
    says(examined("tcp-refused", f"tcp:{where}"), f"{where} refuses the connection", "start the server")


def test_a_tcp_server_that_does_not_answer(ended: contextlib.ExitStack, server: socket.socket) -> None:
    """One whose queue is full drops what comes, as a firewall does."""
    for _ in range(3):
        waiting = ended.enter_context(socket.socket())
        waiting.setblocking(False)
        waiting.connect_ex(server.getsockname())
    says(examined("tcp-unreachable", f"tcp:127.0.0.1:{server.getsockname()[1]}"), "timeout", "ping 127.0.0.1")


def test_a_tcp_server_that_sends_nothing(server: socket.socket) -> None:
    server.listen(8)
    says(examined("tcp-silent", f"tcp:127.0.0.1:{server.getsockname()[1]}"), "accepts the connection", "MAVLink")


def test_our_tcp_server_without_a_client() -> None:
    where = f"127.0.0.1:{free_port(socket.SOCK_STREAM)}"
    says(examined("nobody-connects", f"tcpin:{where}"), "no client connected", f"connect to {where}")


def test_a_silent_serial_device(terminal: Terminal) -> None:
    report = examined("serial-silent", f"{terminal.device},115200")
    says(report, f"no byte arrived from {terminal.device}", "at 115200 baud")


# -- bytes come --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("data", "name", "then"),
    [
        (b"$M<\x00dd$M<\x00ee", "MSP", "telemetry MAVLINK"),
        (b"$GPGGA,123519,4807.038,N*47\r\n", "NMEA", "autopilot"),
        (b"\r\nnsh> \r\nNuttShell (NSH) NuttX-11.0\r\n", "a console's text", "MAVLink"),
    ],
)
def test_another_protocol(ended: contextlib.ExitStack, terminal: Terminal, data: bytes, name: str, then: str) -> None:
    ended.enter_context(contextlib.closing(Source(terminal.write, lambda _: [data])))
    says(examined("other-protocol", terminal.device), f"this is {name}", then)


def test_bytes_at_an_unusual_baud_rate(ended: contextlib.ExitStack, terminal: Terminal) -> None:
    ended.enter_context(contextlib.closing(Source(terminal.write, lambda _: [b"\x8c\x03\x9e" * 9])))
    report = examined("wrong-baud", terminal.device, seconds=0.3)
    says(report, "no MAVLink, nor at other usual rates", f"{terminal.device},RATE")


def test_bytes_of_an_unknown_protocol(send: Callable[..., None], port: int) -> None:
    send(lambda _: [b"\x01\x02\x03\x04" * 20])
    report = examined("not-mavlink", f"udp:127.0.0.1:{port}")
    says(report, "they begin with 01 02 03 04", "MAVLink")
    assert report["garbage_bytes"] == report["bytes"]


# -- MAVLink comes -----------------------------------------------------------------------------------------------------


def test_a_dialect_that_differs(send: Callable[..., None], port: int) -> None:
    send(speaking(ROVER))
    send(spoilt(speaking(SYS_STATUS)))
    report = examined("other-dialect", f"udp:127.0.0.1:{port}")
    says(report, "1 SYS_STATUS (", "definitions")
    assert report["bad_crc"]["1"] >= 3


def test_only_a_ground_station_and_a_gimbal(send: Callable[..., None], port: int) -> None:
    send(speaking(GCS, system=255, component=190))
    send(speaking(SystemTime(0, 0), component=154))
    report = examined("no-autopilot", f"udp:127.0.0.1:{port}")
    says(report, "only 1.154 without a heartbeat, 255.190 GCS", "HEARTBEAT")
    assert [s["type"] for s in report["speakers"]] == [None, "GCS"]


def test_a_vehicle_with_another_id_than_the_chosen_one(send: Callable[..., None], port: int) -> None:
    send(speaking(ROVER, SYS_STATUS))
    report = examined("other-system", f"udp:127.0.0.1:{port}", "--system", "7")
    says(report, "system 7 is not heard, but 1.1 GROUND_ROVER", "--system 1")


def test_two_vehicles_of_different_types_with_one_id(send: Callable[..., None], port: int) -> None:
    send(speaking(ROVER, SYS_STATUS))
    send(speaking(COPTER, SYS_STATUS, begin=100))
    report = examined("two-vehicles", f"udp:127.0.0.1:{port}")
    says(report, "two senders speak as vehicle 1.1: 127.0.0.1:", "SYSID_THISMAV")
    assert report["found"][0].endswith(" (HEARTBEAT.type and autopilot differ)")
    assert not report["ok"]


def test_two_vehicles_of_one_type_with_one_id_by_their_clocks(send: Callable[..., None], port: int) -> None:
    for begin, boot in ((0, 10.0), (100, 500.0)):
        send(partial(since_boot, time.monotonic() - boot, begin))
    report = examined("two-vehicles", f"udp:127.0.0.1:{port}")
    says(report, "(clocks of two autopilots)", "MAV_SYS_ID")
    assert len(report["sources"]) == 2
    (vehicle,) = report["speakers"]
    assert {sender["proof"] for sender in vehicle["status"]["senders"]} == {"first heard", "not proven"}


def since_boot(start: float, begin: int, tick: int) -> list[bytes]:
    """Messages of a vehicle that was started at this instant of the monotonic clock."""
    boot_ms = round((time.monotonic() - start) * 1000)
    return speaking(ROVER, SYS_STATUS, SystemTime(0, boot_ms), begin=begin)(tick)


def test_a_vehicle_whose_frames_were_stored_on_the_way(tmp_path: Path) -> None:
    log = tmp_path / "late.tlog"
    with open(log, "wb") as file:
        for at, said in (*((at, at) for at in range(5)), *((at, at - 7) for at in range(12, 16))):
            messages: list[Any] = [ROVER, SYS_STATUS, SystemTime(0, 60_000 + said * 1000)]
            for number, message in enumerate(messages):
                file.write(round((at + 1.8e9) * 1e6).to_bytes(8, "big"))
                file.write(encode(message, system=1, component=1, sequence=said * 3 + number))
    report = examined("late", str(log))
    says(report, "vehicle 1.1 is heard 7.0 s late", "look for a radio or a program that stores frames")
    assert not report["ok"]
    assert [sender["lag"] for sender in report["speakers"][0]["status"]["senders"]] == [7.0]


def test_signed_frames_without_a_key(send: Callable[..., None], port: int) -> None:
    send(signed(speaking(ROVER, SYS_STATUS)))
    report = examined("signed", f"udp:127.0.0.1:{port}")
    says(report, "are signed", "--signing-key FILE")
    assert report["ok"]
    assert report["signed"] == report["frames"]


@pytest.fixture
def key_file(tmp_path: Path) -> str:
    path = tmp_path / "key"
    path.write_text(KEY.hex())
    path.chmod(0o600)
    return str(path)


def test_a_vehicle_that_does_not_sign(send: Callable[..., None], port: int, key_file: str) -> None:
    send(speaking(ROVER, SYS_STATUS))
    report = examined("not-believed", f"udp:127.0.0.1:{port}", "--signing-key", key_file)
    says(report, "1.1 GROUND_ROVER is not accepted: its frames are not signed", "sign with this key")


def test_a_vehicle_that_signs_with_our_key(send: Callable[..., None], port: int, key_file: str) -> None:
    send(signed(speaking(ROVER, SYS_STATUS)))
    assert examined("ok", f"udp:127.0.0.1:{port}", "--signing-key", key_file)["ok"]


def signed(make: Make) -> Make:
    """The same frames, signed."""
    signer = Signer(KEY, 1)
    return lambda tick: [signer.sign(frame, time.time_ns() // 1000) for frame in make(tick)]


def test_too_few_heartbeats(tmp_path: Path) -> None:
    log = tmp_path / "short.tlog"
    frames = speaking(ROVER)(0) + speaking(SYS_STATUS)(1) + speaking(SYS_STATUS)(2)
    stamps = range(1_800_000_000_000_000, 1_800_000_009_000_000, 3_000_000)
    log.write_bytes(b"".join(at.to_bytes(8, "big") + frame for at, frame in zip(stamps, frames, strict=True)))
    says(examined("few-heartbeats", str(log)), "1 HEARTBEAT of 1.1 arrived within 6.0 s", "HEARTBEAT once a second")


def test_a_passive_link_to_a_vehicle_without_sys_status(send: Callable[..., None], port: int) -> None:
    send(speaking(ROVER))
    report = examined("no-sys-status", f"udp:127.0.0.1:{port}", "--passive")
    says(report, "sends no SYS_STATUS; it was not requested", "remove --passive")


def test_a_vehicle_that_ignores_the_request_for_sys_status(send: Callable[..., None], port: int) -> None:
    send(speaking(ROVER))
    report = examined("no-sys-status", f"udp:127.0.0.1:{port}", seconds=4.2)
    says(report, "sends no SYS_STATUS, although it was requested", "SRn_EXT_STAT")
    assert report["speakers"][0]["rates"]["SYS_STATUS"] == 0


# -- a status is available ---------------------------------------------------------------------------------------------


def test_mavlink_1(send: Callable[..., None], port: int) -> None:
    send(speaking(ROVER, SYS_STATUS, version=1))
    report = examined("mavlink-1", f"udp:127.0.0.1:{port}")
    says(report, "1.1 uses MAVLink 1", "SERIALn_PROTOCOL")
    assert report["ok"]


def test_a_wrong_clock(send: Callable[..., None], port: int) -> None:
    send(lambda tick: speaking(ROVER, SYS_STATUS, SystemTime(int((time.time() - 3600) * 1e6), tick * 100))(tick))
    report = examined("wrong-clock", f"udp:127.0.0.1:{port}")
    says(report, "differ by 36", "timedatectl")  # 3600 s, and some more where the frames wait
    assert report["ok"]


def test_without_a_problem_doctor_ends_early(port: int, autopilot: Callable[..., FakeAutopilot]) -> None:
    """A rover that sends nothing but heartbeats until it is asked, as `run` would ask it."""
    autopilot(ardurover.READY, ("127.0.0.1", port))
    report = examined("ok", f"udp:127.0.0.1:{port}", seconds=20)
    says(report, "a status is available", f"mav-robot-status udp:127.0.0.1:{port}")
    assert report["ok"]
    assert report["seconds"] >= 3
    assert in_time(report["seconds"], 15)
    (rover,) = report["speakers"]
    assert (rover["autopilot"], rover["type"]) == ("ARDUPILOTMEGA", "GROUND_ROVER")
    assert rover["status"]["in_error"] is False
    assert all(rate != 0 for rate in rover["rates"].values())
    assert report["loss_percent"] == 0


@pytest.mark.parametrize(("quad", "name"), [(px4.READY, "PX4"), (arducopter.READY, "ARDUPILOTMEGA")])
def test_a_vehicle_behind_a_satellite_has_a_status(
    port: int, autopilot: Callable[..., FakeAutopilot], quad: Scenario, name: str
) -> None:
    autopilot(by_satellite(quad, hz=2.0), ("127.0.0.1", port))
    report = examined("high-latency", f"udp:127.0.0.1:{port}", seconds=1)
    says(report, "1.1 is heard only through HIGH_LATENCY2", "let the autopilot send HEARTBEAT there")
    assert report["ok"]
    (vehicle,) = report["speakers"]
    assert (vehicle["autopilot"], list(vehicle["rates"])) == (name, ["HIGH_LATENCY2"])
    assert vehicle["status"]["e_stopped"] is None


def test_a_vehicle_is_found_by_speaking_first() -> None:
    with FakeAutopilot(ardurover.READY._replace(streams={1: 4.0})) as waiting:
        report = examined("ok", f"udpout:127.0.0.1:{waiting.address[1]}", seconds=2)
    assert report["ok"]


def test_a_serial_device_without_a_problem(ended: contextlib.ExitStack, terminal: Terminal) -> None:
    ended.enter_context(contextlib.closing(Source(terminal.write, speaking(ROVER, SYS_STATUS))))
    assert examined("ok", terminal.device)["garbage_bytes"] == 0


def test_a_tcp_server_without_a_problem(ended: contextlib.ExitStack, server: socket.socket) -> None:
    server.listen(8)
    server.settimeout(allow(10))
    clients: list[socket.socket] = []

    def write(data: bytes) -> None:
        if not clients:
            clients.append(ended.enter_context(server.accept()[0]))
        clients[0].sendall(data)

    ended.enter_context(contextlib.closing(Source(write, speaking(ROVER, SYS_STATUS))))
    assert examined("ok", f"tcp:127.0.0.1:{server.getsockname()[1]}", seconds=1)["ok"]


# -- the command -------------------------------------------------------------------------------------------------------


def test_a_recorded_log() -> None:
    report = examined("ok", str(LOG))
    assert (report["frames"], report["seconds"]) == (5031, 96.0)
    assert report["bytes"] == LOG.stat().st_size
    assert report["speakers"][0]["status"]["flight_mode"] == "AUTO"


def recorded(path: Path, *parts: tuple[float, float, Heartbeat, int]) -> Path:
    """A log with these senders: from second, to second, heartbeat, system. Autopilots send SYS_STATUS too."""
    frames: list[tuple[float, bytes]] = []
    for start, end, heartbeat, system in parts:
        messages: list[Any] = [heartbeat] if heartbeat is GCS else [heartbeat, SYS_STATUS]
        frames += [
            (at, encode(message, system=system, component=1, sequence=(2 * n + i) & 255))
            for n, at in enumerate(range(round(start), round(end) + 1))
            for i, message in enumerate(messages)
        ]
    frames.sort(key=lambda one: one[0])
    path.write_bytes(
        b"".join(round(1.8e15 + at * 1e6).to_bytes(8, "big") + frame for at, frame in frames),
    )
    return path


def test_a_log_that_ends_in_silence_says_what_was_heard_and_until_when(tmp_path: Path) -> None:
    log = recorded(tmp_path / "quiet.tlog", (0, 252, ROVER, 1), (0, 1812, GCS, 255))
    done = run("doctor", "-q", str(log))
    first, *lines, last = done.stdout.splitlines()
    assert done.returncode == 0, "a status can be had from it"
    assert first.endswith("the autopilot 1.1 was heard for 4 min 12 s; the log ends 26 min 0 s later in silence [ok]")
    assert "a status is available" not in done.stdout
    (status,) = (line for line in lines if line.startswith("  status"))
    assert status.startswith("  status when it was last heard: mode MANUAL, e_stopped ")
    assert "drives_powered FALSE" in status
    assert "  inhibits: DISARMED" in lines
    assert last == f"next: mav-robot-status explain {log} --at 2027-01-15T08:04:12.000000Z"
    assert run("explain", "-q", *last.split()[3:]).stdout.startswith(
        "vehicle 1.1 (ARDUPILOTMEGA, GROUND_ROVER, MANUAL)"
    )


def test_the_json_of_a_log_that_ends_in_silence_has_its_end_and_its_last_status(tmp_path: Path) -> None:
    log = recorded(tmp_path / "quiet.tlog", (0, 100, ROVER, 1), (200, 300, ROVER, 1), (0, 400, GCS, 255))
    rover, station = examined("ok", str(log))["speakers"]
    assert rover["status"]["drives_powered"] is None, "the status is that of the end of the log"
    heard = rover["heard"]
    assert (heard["seconds"], heard["times"], heard["silence"]) == (200, 2, 100)
    assert heard["until"] == "2027-01-15T08:05:00.000000Z"
    assert (heard["status"]["drives_powered"], heard["status"]["inhibits"]) == (False, ["DISARMED"])
    assert station["heard"] is None


def test_a_log_of_several_vehicles_says_how_long_each_was_heard(tmp_path: Path) -> None:
    log = recorded(tmp_path / "two.tlog", (0, 60, ROVER, 1), (0, 90, COPTER, 7))
    done = run("doctor", "-q", str(log))
    assert done.returncode == 0
    first, *lines, last = done.stdout.splitlines()
    assert "2 autopilots were heard: 1.1 for 1 min 0 s, then silent for 30 s until the log ends; 7.1 for" in first
    assert [line.split()[1] for line in lines if line.startswith("  vehicle")] == ["1.1:", "7.1:"]
    assert last.startswith(f"next: mav-robot-status {log}")


def test_a_log_without_an_autopilot_says_who_was_heard(tmp_path: Path) -> None:
    log = recorded(tmp_path / "none.tlog", (0, 9, GCS, 255))
    report = examined("no-autopilot", str(log))
    says(report, "the log has no heartbeat of an autopilot, only 255.1 GCS", "record where the autopilot is heard")
    assert not report["ok"]


def test_each_connection_has_a_report_and_one_problem_decides_the_exit_code(port: int) -> None:
    done = run("doctor", "-q", "--seconds", "0.2", "--as-json", str(LOG), f"udpout:127.0.0.1:{port}")
    assert [json.loads(line)["cause"] for line in done.stdout.splitlines()] == ["ok", "udp-refused"]
    assert done.returncode == 1


def test_the_text_starts_with_the_finding_and_ends_with_the_next_action() -> None:
    done = run("doctor", "-q", str(LOG))
    lines = done.stdout.splitlines()
    assert done.returncode == 0
    assert lines[0] == f"recorded log {LOG}: a status is available [ok]"
    assert all(line.startswith("  ") for line in lines[1:-1])
    assert lines[-1] == f"next: mav-robot-status {LOG}"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "no connection given"),
        (("nowhere.tlog",), "cannot read the log"),
        (("udp:127.0.0.1:14550", "udpp:127.0.0.1:1"), "did you mean udp"),
        (("udp:127.0.0.1:14550", "--seconds", "0"), "'0' is not a duration"),
    ],
)
def test_wrong_arguments_exit_with_2(arguments: tuple[str, ...], message: str) -> None:
    done = run("doctor", "-q", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert message in done.stderr


def test_every_cause_has_a_test_here() -> None:
    causes = set(re.findall(r'examined\("([\w-]+)"', Path(__file__).read_text("utf-8")))
    assert causes == {case.cause for case in CASES}


# -- the document ------------------------------------------------------------------------------------------------------


def test_the_example_of_the_document_is_the_output_of_the_command() -> None:
    text = (ROOT / "docs" / "how-to" / "no-status.md").read_text("utf-8")
    command, *shown = text.partition("```text\n$ mav-robot-status ")[2].partition("```")[0].splitlines()
    assert shown
    assert run(*command.split(), "-q", cwd=ROOT).stdout.splitlines() == shown


def test_the_causes_of_the_document_in_their_order() -> None:
    assert table("docs/reference/doctor.md", "cause") == [[case.cause, case.meaning.replace("`", "")] for case in CASES]


def test_the_members_of_the_document() -> None:
    listed = [name for row in table("docs/reference/doctor.md", "member") for name in row[0].split(", ")]
    assert listed == list(examined("ok", str(LOG)))
