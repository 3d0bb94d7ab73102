from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator

import pytest

from mav_robot_status.config import LinkConfig
from mav_robot_status.gateway.station import MOST_PEERS, MOST_SOURCES, PEER_SILENCE, Station
from mav_robot_status.mavlink.definitions import Heartbeat, NamedValueInt
from mav_robot_status.mavlink.encode import encode

HEARTBEAT = encode(Heartbeat(0, 10, 3, 65, 4, 3), system=1, component=1, sequence=0)


@pytest.fixture
def station() -> Iterator[Station]:
    made = Station(LinkConfig("udpin:127.0.0.1:0"), False)
    yield made
    made.link.close()


@pytest.fixture
def peer() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as made:
        made.bind(("127.0.0.1", 0))
        made.settimeout(5)
        yield made


def test_a_frame_cut_in_two_is_put_together_for_each_sender(station: Station) -> None:
    for source in ("a", "b"):
        assert station.channel(source).parser.feed(HEARTBEAT[:9]) == []
    for source in ("a", "b"):
        assert len(station.channel(source).parser.feed(HEARTBEAT[9:])) == 1
    assert station.totals().frames == 2


def test_a_flood_of_senders_leaves_a_bounded_number_of_parsers_and_are_all_counted(station: Station) -> None:
    station.channel("vehicle").parser.feed(HEARTBEAT[:9])
    for number in range(MOST_SOURCES * 5):
        station.channel(number).parser.feed(HEARTBEAT)
        station.channel("vehicle")  # heard now and then: it stays
    assert len(list(station.channels())) == MOST_SOURCES
    assert len(station.channel("vehicle").parser.feed(HEARTBEAT[9:])) == 1
    assert station.totals().frames == MOST_SOURCES * 5 + 1


def test_a_parser_that_is_used_again_knows_nothing_of_its_last_sender(station: Station) -> None:
    for number in range(MOST_SOURCES):
        station.channel(number).parser.feed(HEARTBEAT[:9])
    assert station.channel("new").parser.feed(HEARTBEAT[9:]) == []
    assert len(station.channel("new").parser.feed(HEARTBEAT)) == 1


def test_at_most_eight_peers_and_the_first_ones_stay(station: Station) -> None:
    for number in range(MOST_SOURCES):
        station.heard(station.channel(number), 0.0)
    assert [channel.source for channel in station.peers()] == list(range(MOST_PEERS))


def test_a_peer_is_forgotten_after_30_s_of_silence_and_so_is_its_wish(station: Station) -> None:
    old, young = station.channel("old"), station.channel("young")
    station.heard(old, 0.0)
    old.interval = 0.2
    station.heard(young, 1.0)
    station.forget_silent(PEER_SILENCE + 0.5)
    assert list(station.peers()) == [young]
    assert old.interval is None


def test_a_listening_station_sends_to_the_address_of_a_channel(station: Station, peer: socket.socket) -> None:
    channel = station.channel(peer.getsockname())
    assert not list(station.peers())
    station.heard(channel, 0.0)
    assert [c.send(b"one") for c in station.peers()] == [True]
    assert peer.recv(100) == b"one"
    assert str(channel).startswith("127.0.0.1:")


def test_a_station_that_speaks_first_has_one_end_whoever_answers(peer: socket.socket) -> None:
    out = Station(LinkConfig(f"udpout:127.0.0.1:{peer.getsockname()[1]}"), True)
    with contextlib.closing(out.link):
        answering = out.channel(("127.0.0.1", 9))
        assert list(out.peers()) == [answering] == [out.channel(("127.0.0.1", 10))]
        assert answering.send(b"one")
        assert peer.recv(100) == b"one"


def test_another_connection_does_not_go_on_where_the_last_one_was_cut(peer: socket.socket) -> None:
    out = Station(LinkConfig(f"udpout:127.0.0.1:{peer.getsockname()[1]}"))
    with contextlib.closing(out.link):
        assert out.channel(1).parser.feed(HEARTBEAT[:9]) == []
        assert out.channel(2).parser.feed(HEARTBEAT[9:]) == []
        assert len(out.channel(2).parser.feed(HEARTBEAT)) == 1


def test_a_passive_station_sends_nothing(peer: socket.socket) -> None:
    passive = Station(LinkConfig("udpin:127.0.0.1:0", passive=True), False)
    with contextlib.closing(passive.link):
        assert not passive.channel(peer.getsockname()).send(b"no")
        peer.setblocking(False)
        with pytest.raises(BlockingIOError):
            peer.recv(100)


def test_a_link_that_begins_to_pass_frames_on_keeps_its_counters_and_gives_every_frame(station: Station) -> None:
    unwanted = encode(NamedValueInt(0, 7, b"RS_STATE"), system=1, component=1, sequence=0)
    assert station.channel("a").parser.feed(HEARTBEAT + unwanted)[1:] == []
    station.adjust(LinkConfig(station.url), 3, keep_all=True)
    assert len(station.channel("a").parser.feed(HEARTBEAT + unwanted)) == 2
    assert station.totals().frames == 4
    assert station.number == 3


def test_a_link_becomes_passive_and_keeps_its_peers(station: Station, peer: socket.socket) -> None:
    channel = station.channel(peer.getsockname())
    station.heard(channel, 0.0)
    station.adjust(LinkConfig(station.url, passive=True), 0)
    assert not channel.send(HEARTBEAT)
    station.adjust(LinkConfig(station.url), 0)
    assert list(station.peers()) == [channel]
    assert channel.send(HEARTBEAT)
    assert peer.recv(300) == HEARTBEAT
