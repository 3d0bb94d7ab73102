"""The table of PX4's events: the real command and a fake PX4 that serves it over MAVLink FTP."""

from __future__ import annotations

import itertools
import json
import lzma
import os
import socket
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from mav_robot_status.mavlink.definitions import ComponentMetadata, FileTransferProtocol, Heartbeat
from mav_robot_status.mavlink.encode import Encoder, encode
from mav_robot_status.mavlink.ftp.payload import ACK, BURST_READ_FILE, OPEN_FILE_RO, Payload, unpack
from mav_robot_status.testing import FakeAutopilot, Lossy, VehicleFiles, ardurover, decode, event_files, px4
from mav_robot_status.testing.event_table import PATH, TABLE

from ..deadline import wait_until
from ..ports import free_port
from .gateway_process import Gateway, run

FILES = event_files()
TABLE_FILE = FILES.files[PATH]


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the cache of the gateways."""
    monkeypatch.delenv("CACHE_DIRECTORY", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "mav-robot-status" / "events"


@pytest.fixture(name="free_port")
def fixture_free_port() -> int:
    return free_port()


# -- the command -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["table.json.xz", "table.json"])
def test_fetch_writes_the_table(
    name: str, autopilot: Callable[..., FakeAutopilot], free_port: int, cache: Path, tmp_path: Path
) -> None:
    autopilot(px4.READY, ("127.0.0.1", free_port), files=FILES)
    done = run("px4-events", "fetch", f"udpin:127.0.0.1:{free_port}", "-o", str(tmp_path / name))
    assert (done.returncode, done.stdout) == (0, f"{tmp_path / name}\n"), done.stderr
    data = (tmp_path / name).read_bytes()
    assert json.loads(data if name.endswith("json") else lzma.decompress(data)) == TABLE
    assert not cache.exists()


@pytest.mark.slow
def test_fetch_succeeds_over_a_link_that_loses_repeats_and_reorders(
    autopilot: Callable[..., FakeAutopilot], free_port: int, tmp_path: Path
) -> None:
    files = event_files(lzma.compress(json.dumps({**TABLE, "noise": os.urandom(6000).hex()}).encode()))
    autopilot(px4.READY, ("127.0.0.1", free_port), files=files, lossy=Lossy(0.1, 0.1, 0.1))
    done = run("px4-events", "fetch", f"udpin:127.0.0.1:{free_port}", "-o", str(tmp_path / "table.json.xz"))
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "table.json.xz").read_bytes() == files.files[PATH]


@pytest.mark.parametrize(
    ("scenario", "files", "reason"),
    [
        (ardurover.READY, None, "no PX4 was heard, and only PX4 has a table of its events: vehicle 1.1, ArduPilot"),
        (px4.READY, FILES._replace(files={}), "FileNotFound"),
        (px4.READY, event_files(address="https://a.b/events.json.xz"), "https://a.b/events.json.xz"),
        (px4.READY, event_files(b"no table"), "it cannot be read"),
        (px4.READY, FILES._replace(crc=1), "its checksum is wrong"),
    ],
    ids=["no PX4", "no file", "internet", "no table", "checksum"],
)
def test_fetch_says_in_one_line_why_there_is_no_table(
    scenario: Any,
    files: VehicleFiles | None,
    reason: str,
    autopilot: Callable[..., FakeAutopilot],
    free_port: int,
    tmp_path: Path,
) -> None:
    autopilot(scenario, ("127.0.0.1", free_port), files=files)
    done = run("px4-events", "fetch", "-q", f"udpin:127.0.0.1:{free_port}", "-o", str(tmp_path / "table"))
    assert (done.returncode, done.stdout) == (1, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith("mav-robot-status: ")
    assert reason in line
    assert not (tmp_path / "table").exists()


def test_fetch_says_when_its_time_is_over(
    autopilot: Callable[..., FakeAutopilot], free_port: int, tmp_path: Path
) -> None:
    autopilot(px4.READY, ("127.0.0.1", free_port))
    arguments = ("--seconds", "1", f"udpin:127.0.0.1:{free_port}", "-o", str(tmp_path / "table"))
    done = run("px4-events", "fetch", "-q", *arguments)
    assert done.returncode == 1
    assert "has not arrived in 1 s" in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("fetch",),
        ("fetch", "-o", "x"),
        ("fetch", "udpin:127.0.0.1:0"),
        ("fetch", "a.tlog", "-o", "x"),
        ("get",),
    ],
)
def test_fetch_with_wrong_arguments_is_a_usage_error_in_one_line(arguments: tuple[str, ...]) -> None:
    done = run("px4-events", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1


# -- the gateway -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_gateway_reads_the_table_once_and_the_next_one_finds_it_in_the_cache(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], cache: Path
) -> None:
    first = gateway("udpin:127.0.0.1:0", "--json", "none")
    autopilot(px4.READY, first.address, files=FILES)
    first.wait_for_log(rf"vehicle 1\.1: the table of its events is read, {len(TABLE_FILE)} bytes")
    assert first.stop() == 0
    (file,) = cache.iterdir()
    assert file.read_bytes() == TABLE_FILE
    second = gateway("udpin:127.0.0.1:0", "--json", "none")
    vehicle = autopilot(px4.READY, second.address, files=FILES)
    second.wait_for_log(r"vehicle 1\.1: the table of its events is in the cache")
    assert not vehicle.heard("FILE_TRANSFER_PROTOCOL")
    file.write_bytes(TABLE_FILE[:-9])
    third = gateway("udpin:127.0.0.1:0", "--json", "none")
    autopilot(px4.READY, third.address, files=FILES)
    third.wait_for_log(r"the table of its events is read")
    assert third.stop() == 0
    assert file.read_bytes() == TABLE_FILE


def test_a_fleet_on_one_link_reads_the_table_once(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], cache: Path
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    vehicles = [autopilot(px4.READY, gate.address, files=FILES, system=number) for number in (1, 2, 3)]
    gate.wait_for_log(r"the table of its events is read")
    # one that offers its table late, on a busy machine, finds it in the cache
    others = ("it uses the table of events of another vehicle", "the table of its events is in the cache")
    wait_until(lambda: sum(other in line for line in gate.log for other in others) == 2)
    assert sum(bool(vehicle.heard("FILE_TRANSFER_PROTOCOL")) for vehicle in vehicles) == 1
    assert gate.stop() == 0


def test_nothing_is_asked_on_a_passive_link(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], cache: Path
) -> None:
    gate = gateway("udpin:127.0.0.1:0", "--passive")
    vehicle = autopilot(px4.READY, gate.address, files=FILES)
    seen = gate.wait_for(lambda s: s["system"] == 1)
    gate.wait_for(lambda s: s["system"] == 1, after=seen.at + 6, seconds=20)
    assert vehicle.heard() == []
    assert not cache.exists()


def test_a_cache_that_cannot_be_written_is_one_line(
    gateway: Callable[..., Gateway],
    autopilot: Callable[..., FakeAutopilot],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    autopilot(px4.READY, gate.address, files=FILES)
    gate.wait_for_log("no cache for the tables of PX4's events")
    assert gate.stop() == 0
    assert sum("cache" in line for line in gate.log) == 1


@pytest.mark.slow
def test_a_link_that_is_silent_for_a_while_does_not_end_the_transfer(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], cache: Path
) -> None:
    files = event_files(json.dumps({**TABLE, "noise": "x" * 100_000}).encode())
    gate = gateway("udpin:127.0.0.1:0", "--json", "none")
    vehicle = autopilot(px4.READY, gate.address, files=files)
    wait_until(lambda: any(m.payload[3] == BURST_READ_FILE for m in vehicle.heard("FILE_TRANSFER_PROTOCOL")))
    vehicle.silence()
    gate.wait_for_log("lost vehicle 1.1")
    vehicle.resume()
    # after two bursts without an answer it reads piece by piece
    gate.wait_for_log(r"the table of its events is read, 10\d{4} bytes", seconds=60)


# -- a hostile file server -------------------------------------------------------------------------------------------


class HostileServer:
    """A PX4 that floods: endless bursts of the same bytes and of nonsense, without a pause."""

    def __init__(self, to: tuple[str, int]) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(to)
        self.socket.setblocking(False)
        self.requests: list[Payload] = []
        self.sent = 0
        self._encoder = Encoder(1, 1)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.socket.close()

    def _run(self) -> None:
        beat_at = 0.0
        last = Payload(0, 0, OPEN_FILE_RO)
        for number in itertools.count():
            if self._stop.wait(0.005):
                return
            if time.monotonic() >= beat_at:
                beat_at = time.monotonic() + 0.5
                self._send(Heartbeat(0, 2, 12, 81, 3, 3))
                self._send(ComponentMetadata(0, FILES.crc + number, b"mftp://etc/general"))
            last = self._hear() or last
            for ahead in range(10):
                self._send(FileTransferProtocol(0, 1, 192, self._answer(last, number, ahead).pack()))

    def _hear(self) -> Payload | None:
        heard = []
        try:
            while True:
                heard += [unpack(bytes(m.payload)) for m in decode(self.socket.recv(300)) if hasattr(m, "payload")]
        except OSError:
            pass
        self.requests += [one for one in heard if one is not None]
        return heard[-1] if heard else None

    def _answer(self, asked: Payload, number: int, ahead: int) -> Payload:
        if asked.opcode == OPEN_FILE_RO:
            return Payload(asked.sequence + 1 & 0xFFFF, 0, ACK, (9000).to_bytes(4, "little"), 0, 4, asked.opcode)
        offset = (number * 7) % 12_000 if ahead else asked.offset
        size = min(1 + ahead, 239)
        return Payload(asked.sequence + 1 + ahead & 0xFFFF, 0, ACK, bytes(size), offset, size, asked.opcode, ahead % 2)

    def _send(self, message: Any) -> None:
        try:
            self.socket.send(self._encoder.frame(message))
            self.sent += 1
        except OSError:
            pass


@pytest.mark.slow
def test_a_flood_of_a_file_server_delays_no_status_and_takes_no_memory(
    gateway: Callable[..., Gateway], autopilot: Callable[..., FakeAutopilot], cache: Path
) -> None:
    gate = gateway("udpin:127.0.0.1:0")
    rover = autopilot(ardurover.READY, gate.address, system=7)
    gate.wait_for(lambda s: s["system"] == 7)
    before = gate.memory()
    hostile = HostileServer(gate.address)
    try:
        gate.wait_for(lambda s: s["system"] == 1)
        seen = gate.wait_for(lambda s: s["system"] == 7, after=time.monotonic() + 8, seconds=30)
        rover.arm()
        gate.wait_for(lambda s: s["system"] == 7 and s["drives_powered"] is True, after=seen.at)
    finally:
        hostile.close()
    assert any(one.opcode == OPEN_FILE_RO for one in hostile.requests)
    assert hostile.sent > 3000
    stamps = [line.stamp for line in gate.lines if line.status["system"] == 7]
    assert max(b - a for a, b in itertools.pairwise(stamps)) < 0.5  # the period is 0.1 s
    assert gate.memory() - before < 15
    assert not any("Traceback" in line for line in gate.log)
    assert sum("no table of its events" in line for line in gate.log) <= 2
    assert gate.stop() == 0


def test_files_of_other_programs_are_not_decoded(gateway: Callable[..., Gateway], cache: Path) -> None:
    """A ground station that reads files through the same link costs nothing but the check of its frames."""
    gate = gateway("udpin:127.0.0.1:0")
    foreign = encode(FileTransferProtocol(0, 255, 190, bytes(251)), system=1, component=1, sequence=0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for frame in (heartbeat(65), *(foreign,) * 200, heartbeat(65 | 128)):
            sender.sendto(frame, gate.address)
        gate.wait_for(lambda s: s["drives_powered"] is True)
    assert gate.stop() == 0
    assert any("202 frames" in line for line in gate.log)


def heartbeat(base_mode: int) -> bytes:
    return encode(Heartbeat(0, 10, 3, base_mode, 4, 3), system=1, component=1, sequence=0)
