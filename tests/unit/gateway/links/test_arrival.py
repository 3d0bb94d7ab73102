"""When input arrived that was not read at once, with injected times."""

from __future__ import annotations

import socket
import time
from typing import Any

import pytest

from mav_robot_status.clock import Instant, later
from mav_robot_status.config import Config, LinkConfig, VehicleConfig
from mav_robot_status.gateway.links.arrival import BATCH, Arrivals, Pause, arrived
from mav_robot_status.gateway.mavlink_hardware import LinkSource, MavlinkHardware
from mav_robot_status.interface import LinkState
from mav_robot_status.links.base import Dated, Received
from mav_robot_status.links.stream import CHUNK
from mav_robot_status.links.udp import UdpListener
from mav_robot_status.links.url import parse
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import encode

SINCE = Instant(1000.0, 1_800_000_000_000_000)
NOW = later(SINCE, 20.0)
FULL = bytes(CHUNK)
HOUR = 3_600_000_000


def stamp(seconds: float) -> int:
    """The kernel's stamp, seconds after SINCE."""
    return later(SINCE, seconds).unix_us


class FakeLink:
    """A link with prepared pieces."""

    def __init__(self, *reads: list[Any], stream: bool = True) -> None:
        self.stream = stream
        self._reads = list(reads)

    def receive(self, limit: int = 64) -> list[Any]:
        return self._reads.pop(0) if self._reads else []


class FakeDatedLink(FakeLink):
    """A link whose pieces have stamps."""

    receive_dated = FakeLink.receive


class FakeEndpoint:
    """What `Arrivals` uses of an endpoint."""

    def __init__(self, link: FakeLink) -> None:
        self.link = link


def ages(arrivals: Arrivals, endpoint: Any, now: Instant = NOW, limit: int = 1024) -> tuple[list[float], bool]:
    found, more = arrivals.receive(endpoint, now, limit)
    return [round(now.mono - at.mono, 3) for at, _ in found], more


@pytest.mark.parametrize("seconds", [0.0, 0.5, 19.0, 20.0])
def test_a_datagram_has_the_time_of_its_stamp(seconds: float) -> None:
    at = arrived(stamp(seconds), SINCE, NOW)
    assert at.mono == pytest.approx(SINCE.mono + seconds)
    assert at.unix_us == stamp(seconds)


def test_a_stamp_is_never_after_the_read_and_never_before_the_link_was_empty() -> None:
    assert arrived(stamp(20.01), SINCE, NOW) == NOW
    assert arrived(stamp(-0.05), SINCE, NOW) == SINCE


@pytest.mark.parametrize("wrong", [None, 0, stamp(25.0), stamp(-1.0), stamp(7200.0)])
def test_a_datagram_with_an_impossible_stamp_is_as_old_as_it_can_be(wrong: int | None) -> None:
    assert arrived(wrong, SINCE, NOW) == SINCE


@pytest.mark.parametrize("step", [-HOUR, -5_000_000, -200_000, 200_000, HOUR])
def test_stamps_prove_nothing_if_the_wall_clock_was_set_meanwhile(step: int) -> None:
    now = Instant(NOW.mono, NOW.unix_us + step)
    for seconds in (1.0, 10.0, 19.9):
        assert arrived(stamp(seconds), SINCE, now) == SINCE
        assert arrived(stamp(seconds) + step, SINCE, now) == SINCE


def test_the_bytes_of_a_stream_are_as_old_as_they_can_be_after_a_stall_until_it_is_empty() -> None:
    arrivals = Arrivals()
    endpoint = FakeEndpoint(
        FakeLink(
            [Received(FULL, "a"), Received(b"x", "b")],
            [Received(FULL, "a")],
            [Received(b"x", "a")],
            [Received(b"x", "a")],
        )
    )
    arrivals.pause = Pause(SINCE, NOW, True)
    assert ages(arrivals, endpoint) == ([20.0, 20.0], True)
    following = later(NOW, 0.0)._replace()
    assert ages(arrivals, endpoint, following) == ([20.0], True)
    assert ages(arrivals, endpoint, following) == ([20.0], False)
    assert ages(arrivals, endpoint, following) == ([0.0], False)


def test_the_bytes_of_a_stream_are_new_if_the_loop_only_waited_for_them() -> None:
    arrivals = Arrivals()
    arrivals.pause = Pause(SINCE, NOW, False)
    assert ages(arrivals, FakeEndpoint(FakeLink([Received(b"x", "a")])))[0] == [0.0]


def test_datagrams_that_a_limited_read_leaves_keep_their_times() -> None:
    arrivals = Arrivals()
    first = [Dated(b"x", "a", stamp(1.0 + n)) for n in range(BATCH)]
    endpoint = FakeEndpoint(FakeDatedLink(first, [Dated(b"x", "a", stamp(10.0))], stream=False))
    arrivals.pause = Pause(SINCE, NOW, True)
    found, more = ages(arrivals, endpoint, limit=BATCH)
    assert found == [19.0 - n for n in range(BATCH)]
    assert more
    assert ages(arrivals, endpoint, later(NOW, 1.0)) == ([11.0], False)


def test_what_a_flood_leaves_counts_as_old() -> None:
    arrivals = Arrivals()
    endpoint: Any = FakeEndpoint(FakeLink([Received(FULL, "a")]))
    assert not arrivals.left(endpoint, [(b"x", "a")], SINCE)
    assert arrivals.left(endpoint, [(FULL, "a")], SINCE)
    assert ages(arrivals, endpoint) == ([20.0], True)
    arrivals.forget(endpoint)
    assert arrivals.receive(endpoint, NOW, 1) == ([], False)


def test_the_kernel_stamps_a_datagram_when_it_arrives() -> None:
    link = UdpListener(parse("udpin:127.0.0.1:0"))
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            before = time.time_ns() // 1000
            out.sendto(b"x", ("127.0.0.1", link.port))
            after = time.time_ns() // 1000
            (piece,) = link.receive_dated()
        assert piece.data == b"x"
        assert piece.stamp is not None
        assert before - 50_000 <= piece.stamp <= after + 50_000
    finally:
        link.close()


def beat(armed: bool, system: int = 1) -> bytes:
    return encode(Heartbeat(0, 10, 3, 193 if armed else 65, 4, 3), system=system, component=1, sequence=0)


class Gateway:
    """MAVLink hardware whose link is replaced by prepared pieces."""

    def __init__(self, *links: FakeLink) -> None:
        config = Config(
            links=tuple(LinkConfig("udpin:127.0.0.1:0") for _ in links),
            requests="none",
            vehicles=(VehicleConfig(1, 1),),
        )
        self.hardware = MavlinkHardware(config, lambda: SINCE)
        for endpoint, link in zip(self.hardware.hub.endpoints, links, strict=True):
            endpoint.link.close()
            link.text, link.dropped, link.due = "a link", 0, lambda: float("inf")  # type: ignore[attr-defined]
            link.close = link.fileno = lambda: None  # type: ignore[attr-defined]
            endpoint.link = link  # type: ignore[assignment]

    def look(self, now: Instant) -> None:
        for endpoint in self.hardware.hub.endpoints:
            LinkSource(endpoint, self.hardware).receive(now, 1024)
        self.hardware.read(now)

    def look_late(self, since: Instant, now: Instant) -> None:
        self.hardware.hub.receiver.pause(since, now, stalled=True)
        self.look(now)

    @property
    def state(self) -> tuple[LinkState, int]:
        handle = next(iter(self.hardware.handles))
        return handle.detail.link, int(handle.status.drives_powered)


def test_a_suspend_of_the_system_loses_the_vehicle_until_a_new_heartbeat() -> None:
    stream = FakeLink([Received(beat(False), "a")], [Received(beat(False), "a")], [], [Received(beat(True), "a")])
    gate = Gateway(stream)
    gate.look(SINCE)
    assert gate.state == (LinkState.CONNECTED, 0)
    gate.look_late(SINCE, NOW)  # CLOCK_BOOTTIME has gone on during the suspend
    assert gate.state == (LinkState.LOST, -1)
    gate.look(later(NOW, 0.1))
    gate.look(later(NOW, 0.2))
    assert gate.state == (LinkState.CONNECTED, 1)


def test_datagrams_of_all_links_are_taken_in_the_order_of_their_arrival() -> None:
    first = FakeDatedLink([Received(beat(False), "a")], [Dated(beat(True), "a", stamp(19.5))], stream=False)
    first.receive_dated = lambda limit=64: first.receive(limit)  # type: ignore[method-assign]
    gate = Gateway(first)
    gate.look(SINCE)
    gate.look_late(SINCE, NOW)
    assert gate.state == (LinkState.CONNECTED, 1)
    (vehicle,) = gate.hardware.vehicles.vehicles
    assert vehicle.losses == 1  # it was silent for 19.5 s, and is back
    assert vehicle.handle.heard_at == pytest.approx(SINCE.mono + 19.5)


def test_time_does_not_go_back_for_a_datagram_that_was_left_for_a_later_read() -> None:
    old = [Dated(beat(True), "a", stamp(n / 10)) for n in range(BATCH)]
    link = FakeDatedLink([Received(beat(True), "a")], old, [Dated(beat(False), "a", stamp(1.0))], stream=False)
    gate = Gateway(link)
    gate.look(SINCE)
    gate.hardware.hub.receiver.pause(SINCE, NOW, stalled=True)
    for endpoint in gate.hardware.hub.endpoints:
        LinkSource(endpoint, gate.hardware).receive(NOW, BATCH)
    gate.hardware.read(NOW)
    assert gate.state == (LinkState.LOST, -1)
    gate.look(later(NOW, 0.1))
    assert gate.state == (LinkState.LOST, -1)


def test_a_frame_that_waits_does_not_bring_back_a_vehicle_whose_link_is_closed() -> None:
    beats = [Received(beat(False), "a")], [Dated(beat(False), "a", stamp(19.9))]
    kept, closed = FakeDatedLink(stream=False), FakeDatedLink(*beats, stream=False)
    gate = Gateway(kept, closed)
    gate.look(SINCE)
    assert gate.state == (LinkState.CONNECTED, 0)
    gate.hardware.hub.receiver.pause(SINCE, NOW, stalled=True)
    LinkSource(gate.hardware.hub.endpoints[1], gate.hardware).receive(NOW, 1024)
    one = Config(links=(LinkConfig("udpin:127.0.0.1:0"),), requests="none", vehicles=(VehicleConfig(1, 1),))
    gate.hardware.change(one)
    gate.hardware.read(NOW)
    assert gate.state == (LinkState.NEVER_SEEN, -1)
