from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator

import pytest

from mav_robot_status.config import LinkConfig
from mav_robot_status.gateway.endpoint import MOST_PEERS, MOST_SOURCES, PEER_SILENCE, Endpoint
from mav_robot_status.mavlink.definitions import Heartbeat, NamedValueInt
from mav_robot_status.mavlink.encode import encode

HEARTBEAT = encode(Heartbeat(0, 10, 3, 65, 4, 3), system=1, component=1, sequence=0)


@pytest.fixture
def endpoint() -> Iterator[Endpoint]:
    made = Endpoint(LinkConfig("udpin:127.0.0.1:0"), False)
    yield made
    made.link.close()


@pytest.fixture
def peer() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        made.settimeout(5)
        yield made


def test_a_split_frame_is_reassembled_for_each_sender(endpoint: Endpoint) -> None:
    for source in ("a", "b"):
        assert endpoint.channel(source).parser.feed(HEARTBEAT[:9]) == []
    for source in ("a", "b"):
        assert len(endpoint.channel(source).parser.feed(HEARTBEAT[9:])) == 1
    assert endpoint.totals().frames == 2


def test_a_flood_of_senders_uses_a_bounded_number_of_parsers_and_all_are_counted(endpoint: Endpoint) -> None:
    endpoint.channel("vehicle").parser.feed(HEARTBEAT[:9])
    for number in range(MOST_SOURCES * 5):
        endpoint.channel(number).parser.feed(HEARTBEAT)
        endpoint.channel("vehicle")  # active from time to time: it is kept
    assert len(list(endpoint.channels())) == MOST_SOURCES
    assert len(endpoint.channel("vehicle").parser.feed(HEARTBEAT[9:])) == 1
    assert endpoint.totals().frames == MOST_SOURCES * 5 + 1


def test_a_reused_parser_keeps_no_bytes_of_its_previous_sender(endpoint: Endpoint) -> None:
    for number in range(MOST_SOURCES):
        endpoint.channel(number).parser.feed(HEARTBEAT[:9])
    assert endpoint.channel("new").parser.feed(HEARTBEAT[9:]) == []
    assert len(endpoint.channel("new").parser.feed(HEARTBEAT)) == 1


def test_the_first_eight_peers_are_kept(endpoint: Endpoint) -> None:
    for number in range(MOST_SOURCES):
        endpoint.heard(endpoint.channel(number), 0.0)
    assert [channel.source for channel in endpoint.peers()] == list(range(MOST_PEERS))


def test_a_peer_and_its_requested_interval_are_forgotten_after_30_s_of_silence(endpoint: Endpoint) -> None:
    old, young = endpoint.channel("old"), endpoint.channel("young")
    endpoint.heard(old, 0.0)
    old.interval = 0.2
    endpoint.heard(young, 1.0)
    endpoint.forget_silent(PEER_SILENCE + 0.5)
    assert list(endpoint.peers()) == [young]
    assert old.interval is None


def test_a_listening_endpoint_sends_to_the_address_of_a_channel(endpoint: Endpoint, peer: socket.socket) -> None:
    channel = endpoint.channel(peer.getsockname())
    assert not list(endpoint.peers())
    endpoint.heard(channel, 0.0)
    assert [c.send(b"one") for c in endpoint.peers()] == [True]
    assert peer.recv(100) == b"one"
    assert str(channel).startswith("127.0.0.1:")


def test_an_endpoint_that_sends_first_has_one_channel_whoever_answers(peer: socket.socket) -> None:
    out = Endpoint(LinkConfig(f"udpout:127.0.0.1:{peer.getsockname()[1]}"), True)
    with contextlib.closing(out.link):
        answering = out.channel(("127.0.0.1", 9))
        assert list(out.peers()) == [answering] == [out.channel(("127.0.0.1", 10))]
        assert answering.send(b"one")
        assert peer.recv(100) == b"one"


def test_a_new_connection_does_not_continue_a_frame_of_the_previous_one(peer: socket.socket) -> None:
    out = Endpoint(LinkConfig(f"udpout:127.0.0.1:{peer.getsockname()[1]}"))
    with contextlib.closing(out.link):
        assert out.channel(1).parser.feed(HEARTBEAT[:9]) == []
        assert out.channel(2).parser.feed(HEARTBEAT[9:]) == []
        assert len(out.channel(2).parser.feed(HEARTBEAT)) == 1


def test_a_passive_endpoint_sends_nothing(peer: socket.socket) -> None:
    passive = Endpoint(LinkConfig("udpin:127.0.0.1:0", passive=True), False)
    with contextlib.closing(passive.link):
        assert not passive.channel(peer.getsockname()).send(b"no")
        peer.setblocking(False)
        with pytest.raises(BlockingIOError):
            peer.recv(100)


def test_a_link_that_starts_forwarding_keeps_its_counters_and_delivers_every_frame(endpoint: Endpoint) -> None:
    unwanted = encode(NamedValueInt(0, 7, b"RS_STATE"), system=1, component=1, sequence=0)
    assert endpoint.channel("a").parser.feed(HEARTBEAT + unwanted)[1:] == []
    endpoint.adjust(LinkConfig(endpoint.url), 3, keep_all=True)
    assert len(endpoint.channel("a").parser.feed(HEARTBEAT + unwanted)) == 2
    assert endpoint.totals().frames == 4
    assert endpoint.number == 3


def test_a_link_becomes_passive_and_keeps_its_peers(endpoint: Endpoint, peer: socket.socket) -> None:
    channel = endpoint.channel(peer.getsockname())
    endpoint.heard(channel, 0.0)
    endpoint.adjust(LinkConfig(endpoint.url, passive=True), 0)
    assert not channel.send(HEARTBEAT)
    endpoint.adjust(LinkConfig(endpoint.url), 0)
    assert list(endpoint.peers()) == [channel]
    assert channel.send(HEARTBEAT)
    assert peer.recv(300) == HEARTBEAT
