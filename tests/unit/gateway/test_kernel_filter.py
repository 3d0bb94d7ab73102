"""When the kernel filters a link, what it then passes, and what is not counted any more."""

from __future__ import annotations

import dataclasses
import logging
import random
import socket
import struct
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import rule

from fuzz.belief import Air, World
from mav_robot_status.clock import Instant
from mav_robot_status.config import Config, ControllerConfig, LinkConfig, PublisherConfig, SigningConfig
from mav_robot_status.gateway.endpoint import Channel, Endpoint
from mav_robot_status.gateway.kernel_filter import DRAINED, LIFTED, KernelFilter, why_not, words
from mav_robot_status.gateway.link_hub import LinkHub
from mav_robot_status.gateway.observer import Observer
from mav_robot_status.hardware.mavlink.message_table import IDS_WITH_FILES, WANTED_IDS
from mav_robot_status.hardware.mavlink.state.claims import Claims
from mav_robot_status.links.base import Received
from mav_robot_status.links.udp import OTHER_SILENCE
from mav_robot_status.mavlink.bpf import packed, program
from mav_robot_status.mavlink.definitions import Heartbeat
from mav_robot_status.mavlink.encode import enclose, encode
from tests.bpf_machine import passes

from .test_belief_properties import SENDERS, TwoSenders

UDP = LinkConfig("udpin:127.0.0.1:0")
RAW_IMU, FILE_TRANSFER, SYSTEM_TIME = 27, 110, 2


def unwanted(sequence: int = 0) -> bytes:
    return enclose(RAW_IMU, b"imu", system=1, component=1, sequence=sequence & 255)


def heartbeat(sequence: int = 0, *, armed: bool = True) -> bytes:
    said = Heartbeat(0, 10, 3, 193 if armed else 65, 4, 3)
    return encode(said, system=1, component=1, sequence=sequence & 255)


def publishing(*types: str) -> Config:
    publishers = tuple(PublisherConfig(kind) for kind in types)
    return Config(controllers=(ControllerConfig("mine", "theirs/Controller", {}, "here", publishers),))


# -- which configurations ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("config", "reason"),
    [
        (Config(), None),
        (Config(kernel_filter=True), None),
        (Config(kernel_filter=False), "kernel_filter is false"),
        (Config(forward=True), "forward needs every frame"),
        (Config(record="all.tlog"), "record needs every frame"),
        (Config(signing=SigningConfig("key")), "signing needs every frame"),
        (Config(kernel_filter=True, forward=True), "forward needs every frame"),
        (publishing("json", "mqtt"), None),
        (publishing("json", "http"), "the publisher http can show how many frames were lost"),
        (publishing("theirs"), "the publisher theirs can show how many frames were lost"),
        (dataclasses.replace(publishing("http"), kernel_filter=True), None),
    ],
)
def test_there_is_a_filter_where_nobody_needs_all_frames(config: Config, reason: str | None) -> None:
    assert why_not(config) == reason


def test_an_observer_gets_every_frame() -> None:
    assert why_not(Config(kernel_filter=True), observed=True) == "an observer needs every frame"


def test_a_configuration_says_whether_it_filters_if_it_has_udp_links() -> None:
    assert words(Config()) == words(Config(links=(UDP, LinkConfig("tcp:127.0.0.1:1"))))
    assert words(Config())[0].startswith("kernel_filter: on UDP, ")
    assert words(Config(record="all.tlog")) == ["kernel_filter: off, record needs every frame"]
    assert words(Config(links=(LinkConfig("tcp:127.0.0.1:1"),))) == []


# -- when it is on -----------------------------------------------------------------------------------------------------


class FakeLink:
    """Notes the ids of the programs; `can` is what the system answers."""

    text, stream, dropped = "a link", False, 0

    def __init__(self) -> None:
        self.can = True
        self.program: bytes | None = None

    def filter(self, program: bytes | None) -> bool:
        if self.can:
            self.program = program
        return self.can

    def passes(self, message_id: int) -> bool:
        datagram = enclose(message_id, b"x", system=1, component=1, sequence=0)
        return self.program is None or passes(self.program, datagram)


Filtered = tuple[FakeLink, KernelFilter]


@pytest.fixture
def filtered() -> Filtered:
    link = FakeLink()
    made = KernelFilter(link)  # type: ignore[arg-type]
    made.allow(True)
    assert not made.review(0.0, WANTED_IDS, heard=True, cut=False)
    assert made.is_on
    return link, made


def test_it_begins_when_a_vehicle_is_heard_and_says_so_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    link = FakeLink()
    made = KernelFilter(link)  # type: ignore[arg-type]
    made.allow(True)
    made.review(0.0, WANTED_IDS, heard=False, cut=False)
    assert not made.is_on
    for second in range(1, 4):
        made.review(second, WANTED_IDS, heard=True, cut=False)
    assert made.is_on
    assert not link.passes(RAW_IMU)
    assert link.passes(0)
    assert [record.message for record in caplog.records] == [
        "a link: filters in the kernel what no status needs; lost frames are not counted"
    ]


def test_it_ends_when_no_heartbeat_arrives_and_begins_again(filtered: Filtered) -> None:
    link, made = filtered
    made.review(1.0, WANTED_IDS, heard=False, cut=False)
    assert link.passes(RAW_IMU)
    made.review(2.0, WANTED_IDS, heard=True, cut=False)
    assert not link.passes(RAW_IMU)


def test_a_frame_cut_in_two_lifts_it_for_a_minute(filtered: Filtered) -> None:
    link, made = filtered
    made.review(1.0, WANTED_IDS, heard=True, cut=True)
    assert link.passes(RAW_IMU)
    made.review(LIFTED, WANTED_IDS, heard=True, cut=False)
    assert link.passes(RAW_IMU)
    made.review(1.0 + LIFTED, WANTED_IDS, heard=True, cut=False)
    assert not link.passes(RAW_IMU)


def test_new_ids_pass_at_once_and_old_ones_end_with_the_next_review(filtered: Filtered) -> None:
    link, made = filtered
    assert not link.passes(FILE_TRANSFER)
    made.widen(IDS_WITH_FILES)
    assert link.passes(FILE_TRANSFER)
    made.review(1.0, WANTED_IDS, heard=True, cut=False)
    assert not link.passes(FILE_TRANSFER)


def test_a_peer_counts_as_silent_only_while_every_datagram_arrives(filtered: Filtered) -> None:
    link, made = filtered
    assert made.silence(since=0.0, now=100.0) == 0.0
    assert link.passes(RAW_IMU)
    assert made.silence(since=0.0, now=103.0) == 3.0
    assert made.silence(since=102.0, now=103.0) == 1.0
    made.review(102.0 + LIFTED, WANTED_IDS, heard=True, cut=False)
    assert link.passes(RAW_IMU)


def test_without_a_filter_silence_is_what_it_always_was() -> None:
    made = KernelFilter(FakeLink())  # type: ignore[arg-type]
    assert made.silence(since=1.0, now=100.0) == 99.0


def test_nothing_is_counted_until_the_old_datagrams_are_read(filtered: Filtered) -> None:
    link, made = filtered
    assert not made.counts
    made.allow(False)
    assert link.program is None
    assert made.silence(since=0.0, now=7.0) < 0  # when it ended is not noted yet
    assert not made.review(10.0, WANTED_IDS, heard=True, cut=False)
    assert not made.counts
    assert made.review(10.0 + DRAINED, WANTED_IDS, heard=True, cut=False)
    assert made.counts
    assert not made.review(12.0, WANTED_IDS, heard=True, cut=False)


def test_a_system_without_such_a_filter_works_without_it() -> None:
    link = FakeLink()
    link.can = False
    made = KernelFilter(link)  # type: ignore[arg-type]
    made.allow(True)
    made.review(0.0, WANTED_IDS, heard=True, cut=False)
    assert not made.is_on
    assert made.counts


# -- on links ----------------------------------------------------------------------------------------------------------


class Gateway:
    """A hub on a manual clock, with one UDP link and a vehicle that sends to it."""

    def __init__(self, config: Config, observers: tuple[Observer, ...] = ()) -> None:
        self.config = config
        self.now = Instant(1000.0, 1_800_000_000_000_000)
        self.hub = LinkHub(config, lambda: self.now, observers)
        self.vehicle = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.vehicle.bind(("127.0.0.1", 0))

    def close(self) -> None:
        self.hub.close()
        self.vehicle.close()

    @property
    def endpoint(self) -> Endpoint:
        return self.hub.endpoints[0]

    def hear(self, *datagrams: bytes, by: socket.socket | None = None) -> list[int]:
        """Send datagrams, read them; the ids that the hardware interface gets."""
        link: Any = self.endpoint.link
        for datagram in datagrams:
            (by or self.vehicle).sendto(datagram, ("127.0.0.1", link.port))
        heard = self.hub.receive(self.endpoint, self.now)
        for frame, channel in heard:
            if frame.message_id == 0:
                self.hub.heard_vehicle(frame.ids, channel, self.now.mono)
        return [frame.message_id for frame, _ in heard]

    def second(self, *, heard: bool = True) -> None:
        """One second passes."""
        self.now = self.now._replace(mono=self.now.mono + 1.0)
        self.endpoint.review_filter(self.now.mono, heard=heard)


StartGateway = Callable[..., Gateway]


@pytest.fixture
def gateway() -> Iterator[StartGateway]:
    started: list[Gateway] = []

    def start(**options: Any) -> Gateway:
        observers = options.pop("observers", ())
        started.append(Gateway(Config(**{"links": (UDP,), **options}), observers))
        return started[-1]

    yield start
    for one in started:
        one.close()


def test_what_no_status_needs_does_not_arrive_and_everything_else_does(gateway: StartGateway) -> None:
    gate = gateway()
    assert gate.hear(heartbeat(0), unwanted(1), heartbeat(2)) == [0, 0]
    assert gate.endpoint.totals().frames == 3
    gate.second()
    assert gate.hear(heartbeat(3), unwanted(4), heartbeat(5) + unwanted(6), b"garbage", heartbeat(7)) == [0, 0, 0]
    assert gate.endpoint.totals().frames == 7
    assert gate.endpoint.totals().garbage_bytes == len(b"garbage")


def test_lost_and_dropped_are_unknown_while_it_filters(gateway: StartGateway, caplog: pytest.LogCaptureFixture) -> None:
    gate = gateway()
    gate.hear(heartbeat(0), heartbeat(3))
    assert (gate.endpoint.lost, gate.endpoint.dropped) == (2, 0)
    gate.second()
    gate.hear(heartbeat(4), unwanted(5), heartbeat(6))
    assert (gate.endpoint.lost, gate.endpoint.dropped) == (None, None)
    with caplog.at_level(logging.INFO):
        gate.endpoint.log_counters()
    assert ": 4 frames, lost ones not counted, " in caplog.text
    assert ", dropped datagrams not counted; " in caplog.text


@pytest.mark.parametrize("needs", ["record", "kernel_filter", "forward"])
def test_a_reload_takes_it_off_and_puts_it_on_again(gateway: StartGateway, needs: str, tmp_path: Path) -> None:
    values: dict[str, Any] = {"record": str(tmp_path / "all.tlog"), "kernel_filter": False, "forward": True}
    gate = gateway()
    gate.hear(heartbeat(0))
    gate.second()
    gate.hear(unwanted(1))
    assert gate.endpoint.totals().frames == 1
    gate.hub.change(dataclasses.replace(gate.config, **{needs: values[needs]}))
    gate.hear(unwanted(2), heartbeat(3))
    assert gate.endpoint.totals().frames == 3
    for _ in range(2):
        gate.second()
    gate.hear(heartbeat(4), heartbeat(6))
    assert (gate.endpoint.lost, gate.endpoint.dropped) == (1, 0)
    gate.hub.change(gate.config)
    gate.second()
    gate.hear(unwanted(7))
    assert gate.endpoint.totals().frames == 5


def test_what_waits_already_is_read_when_it_begins(gateway: StartGateway) -> None:
    gate = gateway()
    gate.hear(heartbeat(0))
    link: Any = gate.endpoint.link
    gate.vehicle.sendto(unwanted(1), ("127.0.0.1", link.port))
    gate.second()
    gate.hear(unwanted(2))
    assert gate.endpoint.totals().frames == 2


def test_files_arrive_as_soon_as_they_are_wanted(gateway: StartGateway) -> None:
    gate = gateway()
    gate.hear(heartbeat(0))
    gate.second()
    file = enclose(FILE_TRANSFER, b"file", system=1, component=1, sequence=1)
    assert gate.hear(file) == []
    (channel,) = gate.endpoint.channels()
    channel.hear_files(True)
    assert gate.hear(file) == [FILE_TRANSFER]
    gate.second()
    assert gate.hear(file) == [FILE_TRANSFER]
    channel.hear_files(False)
    gate.second()
    assert gate.hear(file) == []
    assert gate.endpoint.totals().frames == 3


def test_an_observer_keeps_it_off(gateway: StartGateway) -> None:
    gate = gateway(observers=(Observer(),))
    gate.hear(heartbeat(0))
    gate.second()
    gate.hear(unwanted(1))
    assert gate.endpoint.totals().frames == 2


def test_a_claim_on_a_second_link_counts_as_heard(gateway: StartGateway) -> None:
    """A copy of all streams on a second link costs as much as the first."""
    gate = gateway(links=(UDP, UDP))
    hub = gate.hub
    (first,), (second,) = ([e for e in hub.endpoints if e.number == n] for n in (0, 1))
    said, ways = Heartbeat(0, 10, 3, 65, 4, 3), []
    for endpoint in (first, second):
        way, _ = endpoint.hear_stranger(heartbeat(0), ("127.0.0.1", 9), gate.now.mono)
        assert way is not None
        ways.append(way)
    claims: Claims[Channel] = Claims()
    hub.claims[1, 1] = claims
    claims.heard(said, 0, ways[0], gate.now)
    claims.elsewhere(said, 0, ways[1], gate.now, None, 3.5)
    hub.speak([], gate.now.mono)
    assert first.filter.is_on
    assert second.filter.is_on
    hub.speak([], gate.now.mono + 11.0)
    assert not first.filter.is_on


def test_a_link_that_sends_keeps_its_peer_while_that_sends_anything(gateway: StartGateway) -> None:
    """Unneeded frames show that the peer is there, so another sender does not take its place."""
    with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as target:
        target.bind(("127.0.0.1", 0))
        target.settimeout(5)
        gate = gateway(links=(LinkConfig(f"udpout:127.0.0.1:{target.getsockname()[1]}"),))
        gate.endpoint.link.send(b"hello")
        assert target.recv(100) == b"hello"
        assert gate.hear(heartbeat(0), by=gate.vehicle) == [0]  # from another port than the target's
        gate.second()
        assert gate.endpoint.filter.is_on
        with closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as forger:
            for second in range(10):
                gate.second()
                gate.hear(unwanted(second + 1), by=gate.vehicle)
                assert gate.hear(heartbeat(100, armed=False), by=forger) == []
            for _ in range(round(OTHER_SILENCE) + 1):
                gate.second()
                found = gate.hear(heartbeat(100, armed=False), by=forger)
            assert found == [0]


# -- the kernel --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("host", ["127.0.0.1", "::1"])
def test_the_kernel_passes_what_the_machine_of_the_tests_passes(host: str) -> None:
    rng = random.Random(8)
    code = packed(program(WANTED_IDS))
    made = [heartbeat(), unwanted(), b"", b"\xfd", b"\xfe" * 8, unwanted() + b"x", unwanted()[:-1]]
    for _ in range(300):
        version = rng.choice((1, 2))
        message_id = rng.choice((RAW_IMU, SYSTEM_TIME, rng.randrange(256 if version == 1 else 2**24)))
        one = bytearray(_any_frame(message_id, version, rng))
        if rng.random() < 0.3:
            one[rng.randrange(len(one))] = rng.randrange(256)
        made.append(bytes(one[: rng.choice((None, None, -1, 9))]))
    config = LinkConfig(f"udpin:{'[::1]' if ':' in host else host}:0")
    endpoint = Endpoint(config)
    link: Any = endpoint.link
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with closing(link), closing(socket.socket(family, socket.SOCK_DGRAM)) as sender:
        assert link.filter(code)
        for datagram in made:
            sender.sendto(datagram, (host, link.port))
        got = []
        while pieces := link.receive():
            got += [piece.data for piece in pieces]
    expected = [datagram for datagram in made if passes(code, datagram)]
    assert got == expected
    assert 20 < len(got) < len(made) - 20


def _any_frame(message_id: int, version: int, rng: random.Random) -> bytes:
    payload = bytes(rng.randrange(256) for _ in range(rng.randrange(30)))
    if version == 1:
        header = struct.pack("BBBBBB", 0xFE, len(payload), 0, 1, 1, message_id)
    else:
        header = struct.pack("BBBBBBB", 0xFD, len(payload), 0, 0, 0, 1, 1) + message_id.to_bytes(3, "little")
    return header + payload + b"\0\0"


# -- who may speak -----------------------------------------------------------------------------------------------------


class FilteredAir(Air):
    """The air with the filter in front of the gateway."""

    code = packed(program(WANTED_IDS))

    def receive(self, limit: int = 64) -> list[Received]:
        return [piece for piece in super().receive(limit) if passes(self.code, piece.data)]


class FilteredWorld(World):
    """The senders also send frames that no status needs, which count in the sequence."""

    air = FilteredAir

    def chatter(self, who: int, count: int) -> None:
        sender = self.senders[who]
        for _ in range(count):
            for way in sender.ways[:1] if sender.forked else sender.ways:
                self._air.waiting.append(Received(unwanted(self._count(sender, way)), way))
        self._source.receive(self.now, 64)


class TwoSendersBehindAFilter(TwoSenders):
    """The steps of `TwoSenders`, with unneeded frames between them."""

    world_type = FilteredWorld

    @rule(who=SENDERS, count=st.integers(1, 60))
    def chatter(self, who: int, count: int) -> None:
        assert isinstance(self.world, FilteredWorld)
        self.world.chatter(who, count)


TwoSendersBehindAFilter.TestCase.settings = settings(max_examples=40, stateful_step_count=40, deadline=None)
test_a_live_robot_is_never_called_safe_behind_the_filter = TwoSendersBehindAFilter.TestCase
