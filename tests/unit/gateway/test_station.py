from __future__ import annotations

import contextlib
import socket
from collections.abc import Iterator

import pytest

from mav_robot_status.config import LinkConfig
from mav_robot_status.gateway.station import MOST_PEERS, MOST_SOURCES, PEER_SILENCE, Station
from mav_robot_status.mavlink.definitions import Heartbeat
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
        assert station.parser(source).feed(HEARTBEAT[:9]) == []
    for source in ("a", "b"):
        assert len(station.parser(source).feed(HEARTBEAT[9:])) == 1
    assert station.totals().frames == 2


def test_a_flood_of_senders_leaves_a_bounded_number_of_parsers_and_are_all_counted(station: Station) -> None:
    station.parser("vehicle").feed(HEARTBEAT[:9])
    for number in range(MOST_SOURCES * 5):
        station.parser(number).feed(HEARTBEAT)
        station.parser("vehicle")  # heard now and then: it stays
    assert len(station._parsers) == MOST_SOURCES
    assert len(station.parser("vehicle").feed(HEARTBEAT[9:])) == 1
    assert station.totals().frames == MOST_SOURCES * 5 + 1


def test_a_parser_that_is_used_again_knows_nothing_of_its_last_sender(station: Station) -> None:
    for number in range(MOST_SOURCES):
        station.parser(number).feed(HEARTBEAT[:9])
    assert station.parser("new").feed(HEARTBEAT[9:]) == []
    assert len(station.parser("new").feed(HEARTBEAT)) == 1


def test_at_most_eight_peers_and_the_first_ones_stay(station: Station) -> None:
    for number in range(10_000):
        station.heard_autopilot(number, 0.0)
    assert list(station.peers) == list(range(MOST_PEERS))


def test_a_peer_is_forgotten_after_30_s_of_silence(station: Station) -> None:
    station.heard_autopilot("old", 0.0)
    station.heard_autopilot("young", 1.0)
    station.forget_silent(PEER_SILENCE + 0.5)
    assert list(station.peers) == ["young"]


def test_a_listening_station_sends_to_its_peers(station: Station, peer: socket.socket) -> None:
    station.send(b"nobody hears this")
    station.heard_autopilot(peer.getsockname(), 0.0)
    station.send(b"one")
    station.answer(b"two", peer.getsockname())
    assert [peer.recv(100), peer.recv(100)] == [b"one", b"two"]


def test_a_station_that_speaks_first_sends_to_its_address(peer: socket.socket) -> None:
    out = Station(LinkConfig(f"udpout:127.0.0.1:{peer.getsockname()[1]}"), True)
    with contextlib.closing(out.link):
        out.send(b"one")
        out.answer(b"two", ("127.0.0.1", 9))
        assert [peer.recv(100), peer.recv(100)] == [b"one", b"two"]


def test_a_passive_station_sends_nothing(peer: socket.socket) -> None:
    passive = Station(LinkConfig("udpin:127.0.0.1:0", passive=True), False)
    with contextlib.closing(passive.link):
        passive.heard_autopilot(peer.getsockname(), 0.0)
        passive.send(b"no")
        passive.answer(b"no", peer.getsockname())
        peer.setblocking(False)
        with pytest.raises(BlockingIOError):
            peer.recv(100)
