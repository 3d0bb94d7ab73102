from __future__ import annotations

import os
import select
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing, suppress
from pathlib import Path
from typing import Any, TextIO

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.config import Config, IdentityConfig, LinkConfig, PublisherConfig
from mav_robot_status.errors import LinkError
from mav_robot_status.gateway.controller_config import DEFAULT_CONTROLLER
from mav_robot_status.gateway.event_loop import EventLoop
from mav_robot_status.gateway.pace import BURST, MOST_AT_ONCE, RATE
from mav_robot_status.links.udp import UdpLink
from mav_robot_status.mavlink.definitions import Heartbeat, SystemTime
from mav_robot_status.mavlink.encode import encode
from mav_robot_status.mavlink.framing import Frame, Parser
from mav_robot_status.testing import ManualClock

from ...deadline import allow, in_time

HERE = LinkConfig("udpin:127.0.0.1:0")


class Turning(EventLoop):
    """An event loop that counts its turns and reads."""

    turns = reads = 0

    def _receive(self, *arguments: Any) -> None:
        self.reads += 1
        super()._receive(*arguments)

    def turn(self, now: Instant) -> None:
        self.turns += 1
        super().turn(now)


@pytest.fixture
def stdout(tmp_path: Path) -> Iterator[TextIO]:
    with open(tmp_path / "stdout", "w+", encoding="utf-8") as file:
        yield file


@pytest.fixture
def vehicle() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        made.settimeout(5)
        yield made


def autopilot(system: int = 1, sequence: int = 0) -> bytes:
    return encode(Heartbeat(0, 10, 3, 65, 4, 3), system=system, component=1, sequence=sequence)


def address(live: EventLoop) -> tuple[str, int]:
    link = live.endpoints[0].link
    assert isinstance(link, UdpLink)
    return "127.0.0.1", link.port


def receive(live: EventLoop, now: Instant) -> None:
    """Wait for the sent datagrams to arrive and read them."""
    sources = live.hardware.all.sources()
    arrived = select.poll()
    for source in sources:
        arrived.register(source.fileno(), select.POLLIN)
    arrived.poll(allow(5) * 1000)
    for source in sources:
        source.receive(now, MOST_AT_ONCE)


def heard(vehicle: socket.socket) -> list[Frame]:
    """The frames that wait in the socket of the vehicle."""
    frames: list[Frame] = []
    vehicle.setblocking(False)
    with suppress(BlockingIOError):
        while True:
            frames += Parser({0, 76, 59900}).feed(vehicle.recv(1000))
    return frames


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def run_for(live: EventLoop, seconds: float) -> float:
    """Run for at least this many seconds. Returns the seconds it ran."""
    began = time.monotonic()
    thread = threading.Thread(target=live.run)
    thread.start()
    time.sleep(seconds)
    live.stop()
    thread.join(allow(5))
    assert not thread.is_alive()
    return time.monotonic() - began


@pytest.mark.parametrize(("with_vehicle", "most"), [(False, 5), (True, 45)])
def test_an_idle_second_takes_only_the_turns_that_are_due(
    stdout: TextIO, vehicle: socket.socket, with_vehicle: bool, most: int
) -> None:
    live = Turning(Config(links=(HERE,)), stdout)
    if with_vehicle:  # 10 lines, 10 hardware reads, up to two turns each; requests and heartbeats
        vehicle.sendto(autopilot(), address(live))
    ran = run_for(live, 1.0)
    assert 1 <= live.turns < most * ran


def test_input_accumulates_while_coalescing(stdout: TextIO, vehicle: socket.socket) -> None:
    live = Turning(Config(links=(HERE,), coalesce=0.3), stdout)
    began = time.monotonic()
    thread = threading.Thread(target=live.run)
    thread.start()
    for _ in range(50):
        vehicle.sendto(b"\xfd", address(live))
        time.sleep(0.005)
    before = time.monotonic()
    live.stop()
    thread.join(allow(5))
    assert in_time(time.monotonic() - before, 1.0)
    assert live.turns < 2 + (time.monotonic() - began) / 0.1  # about one in 0.3 s


def test_rapid_wake_ups_are_spaced_out(stdout: TextIO, vehicle: socket.socket) -> None:
    live = Turning(Config(links=(HERE,)), stdout)
    thread = threading.Thread(target=live.run)
    thread.start()
    begun = time.monotonic()
    for _ in range(1000):
        vehicle.sendto(autopilot(), address(live))
        time.sleep(0.0001)
    live.stop()
    thread.join(allow(5))
    assert live.reads < BURST + 2 * RATE * (time.monotonic() - begun)  # due work wakes it up, too


def test_nothing_is_delayed_below_two_thousand_datagrams_a_second(stdout: TextIO, vehicle: socket.socket) -> None:
    with closing(EventLoop(Config(links=(HERE,)), stdout)) as live:
        for number in range(200):
            now = Instant(10 + number / 1900, 0)
            vehicle.sendto(autopilot(), address(live))
            receive(live, now)
            live._pace.count(1, now.mono)
            assert live._pace.rests_until <= now.mono


def test_frames_from_two_addresses_are_handled_in_arrival_order(stdout: TextIO, vehicle: socket.socket) -> None:
    live = EventLoop(Config(links=(HERE,)), stdout)
    with closing(live), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second:
        for sequence, sender in enumerate((vehicle, vehicle, second, vehicle, second, second)):
            sender.sendto(autopilot(1 + (sender is second), sequence), address(live))
        heard, _ = live.hardware.mavlink.hub.receiver.receive(live.endpoints[0], Instant(1.0, 0))
    assert [(frame.sequence, frame.ids[0]) for frame, _ in heard] == [(0, 1), (1, 1), (2, 2), (3, 1), (4, 2), (5, 2)]
    assert len({channel for _, channel in heard}) == 2


def test_a_failure_during_startup_leaves_nothing_open(stdout: TextIO, vehicle: socket.socket) -> None:
    before = descriptors()
    taken = LinkConfig(f"udpin:127.0.0.1:{vehicle.getsockname()[1]}")
    with pytest.raises(LinkError, match="taken"):
        EventLoop(Config(links=(HERE, HERE, taken)), stdout)
    nowhere = PublisherConfig("json", {"path": "/nowhere/x"})
    controller = DEFAULT_CONTROLLER.__class__("c", DEFAULT_CONTROLLER.type, {}, "f:1:1", (nowhere,))
    with pytest.raises(LinkError, match="nowhere"):
        EventLoop(Config(links=(HERE,), outs=(HERE,), controllers=(controller,)), stdout)
    assert descriptors() == before


def test_closing_releases_everything_and_a_later_stop_is_harmless(stdout: TextIO) -> None:
    before = descriptors()
    live = EventLoop(Config(links=(HERE,)), stdout)
    handlers = signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)
    live.stop_on_signals()
    live.close()
    live.stop()
    assert descriptors() == before
    assert (signal.getsignal(signal.SIGTERM), signal.getsignal(signal.SIGINT)) == handlers


def test_a_signal_stops_the_event_loop(stdout: TextIO) -> None:
    live = EventLoop(Config(links=(HERE,)), stdout)
    live.stop_on_signals()
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGTERM)).start()
    started = time.monotonic()
    live.run()
    assert in_time(time.monotonic() - started, 0.9)


def test_heartbeats_keep_their_phase(stdout: TextIO, vehicle: socket.socket) -> None:
    clock = ManualClock()
    live = EventLoop(Config(links=(HERE,), requests="none"), stdout, clock.now)
    with closing(live):
        start = clock.now()
        beats = []
        for late in (0.0, 1.04, 2.03, 3.02, 9.0, 10.0):
            vehicle.sendto(autopilot(), address(live))
            receive(live, later(start, late))
            live.turn(later(start, late))
            beats.append(sum(f.message_id == 0 for f in heard(vehicle)))
        assert beats == [1, 1, 1, 1, 1, 1]
        live.turn(later(start, 10.99))
        assert not [f for f in heard(vehicle) if f.message_id == 0]


def test_every_vehicle_gets_only_its_own_statuses_and_requests(stdout: TextIO, vehicle: socket.socket) -> None:
    live = EventLoop(Config(links=(HERE,)), stdout)
    with closing(live), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second:
        second.bind(("127.0.0.1", 0))
        start = Instant(50.0, 0)
        vehicle.sendto(autopilot(7), address(live))
        second.sendto(autopilot(9), address(live))
        receive(live, start)
        live.turn(start)
        assert ({f.ids[0] for f in heard(vehicle)}, {f.ids[0] for f in heard(second)}) == ({7}, {9})
        vehicle.sendto(autopilot(7), address(live))
        second.sendto(autopilot(9), address(live))
        receive(live, later(start, 1.0))
        live.turn(later(start, 3.01))
        assert [f.ids for f in heard(vehicle) if f.message_id == 76] == [(7, 192)]
        assert [f.ids for f in heard(second) if f.message_id == 76] == [(9, 192)]


def test_requests_follow_a_vehicle_to_its_new_address(stdout: TextIO, vehicle: socket.socket) -> None:
    live = EventLoop(Config(links=(HERE,)), stdout)
    with closing(live), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as new:
        new.bind(("127.0.0.1", 0))
        start = Instant(50.0, 0)
        for number in range(8):
            clock = SystemTime(0, 60_000 + 500 * number)
            sender, now = vehicle if number < 3 else new, later(start, number / 2)
            sender.sendto(autopilot(sequence=2 * number), address(live))
            sender.sendto(encode(clock, system=1, component=1, sequence=2 * number + 1), address(live))
            receive(live, now)
            live.turn(now)
        assert [f for f in heard(new) if f.message_id == 76]
        assert not [f for f in heard(vehicle) if f.message_id == 76]


def test_the_heartbeat_can_be_switched_off(stdout: TextIO, vehicle: socket.socket) -> None:
    live = EventLoop(Config(links=(HERE,), identity=IdentityConfig(heartbeat=False)), stdout)
    vehicle.sendto(autopilot(), address(live))
    run_for(live, 0.2)
    assert {f.message_id for f in heard(vehicle)} == {59900}


def test_silence_is_logged_after_3_5_s_and_then_every_30_s(stdout: TextIO, caplog: pytest.LogCaptureFixture) -> None:
    live = EventLoop(Config(links=(HERE,)), stdout)
    with closing(live):
        live.hardware.mavlink._silent_at = 3.5
        for at in (3.4, 3.5, 3.6, 20.0, 33.4, 33.6):
            live.turn(Instant(at, 0))
    logged = [r.message for r in caplog.records if "no autopilot heard yet" in r.message]
    assert len(logged) == 2
    assert "no MAVLink so far" in logged[0]


def test_the_silence_log_line_counts_bytes_that_are_not_mavlink(
    stdout: TextIO, vehicle: socket.socket, caplog: pytest.LogCaptureFixture
) -> None:
    live = EventLoop(Config(links=(HERE,)), stdout)
    vehicle.sendto(b"NMEA" * 5, address(live))
    with closing(live):
        live.hardware.mavlink._silent_at = 0.0
        receive(live, Instant(3.5, 0))
        live.turn(Instant(3.6, 0))
    logged = [r.message for r in caplog.records if "no autopilot heard yet" in r.message]
    assert "20 bytes that are not MAVLink so far" in logged[0]
