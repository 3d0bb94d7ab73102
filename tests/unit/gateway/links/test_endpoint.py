from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Iterator
from typing import Any

import pytest

from mav_robot_status.config import LinkConfig
from mav_robot_status.gateway.links.channel import PEER_SILENCE, Channel
from mav_robot_status.gateway.links.endpoint import MOST_PEERS, MOST_SOURCES, Endpoint
from mav_robot_status.links.base import IDLE, SPEAKS, STAYS
from mav_robot_status.mavlink.definitions import Heartbeat, NamedValueInt
from mav_robot_status.mavlink.encode import enclose, encode

HEARTBEAT = encode(Heartbeat(0, 10, 3, 65, 4, 3), system=1, component=1, sequence=0)


def admitted(endpoint: Endpoint, source: Any, now: float = 0.0) -> Channel:
    """The channel of an address that has sent a valid frame."""
    channel = endpoint.channel(source, now) or endpoint.hear_stranger(HEARTBEAT, source, now)[0]
    assert channel is not None
    return channel


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
    channels = [admitted(endpoint, source) for source in ("a", "b")]
    for channel in channels:
        assert channel.parser.feed(HEARTBEAT[:9]) == []
    for channel in channels:
        assert len(channel.parser.feed(HEARTBEAT[9:])) == 1
    assert endpoint.totals().frames == 4


def test_a_lone_sender_that_splits_its_first_frame_gets_a_channel(endpoint: Endpoint) -> None:
    for byte in HEARTBEAT[:-1]:
        assert endpoint.hear_stranger(bytes((byte,)), "bytewise", 0.0) == (None, [])
    channel, frames = endpoint.hear_stranger(HEARTBEAT[-1:], "bytewise", 0.0)
    assert channel is not None
    assert endpoint.channel("bytewise", 0.0) is channel
    assert len(frames) == 1


def test_bytes_of_two_strangers_make_no_frame(endpoint: Endpoint) -> None:
    assert endpoint.hear_stranger(HEARTBEAT[:9], "a", 0.0) == (None, [])
    assert endpoint.hear_stranger(HEARTBEAT[9:], "b", 0.0) == (None, [])


def test_datagrams_without_a_valid_frame_make_no_channel_and_are_counted(endpoint: Endpoint) -> None:
    for number in range(100):
        assert endpoint.hear_stranger(b"x", number, 0.0) == (None, [])
    assert list(endpoint.channels()) == []
    assert endpoint.totals().garbage_bytes == 100


def test_a_flood_of_senders_uses_a_bounded_number_of_parsers_and_all_are_counted(endpoint: Endpoint) -> None:
    for number in range(MOST_SOURCES * 5):
        admitted(endpoint, number)
    assert len(list(endpoint.channels())) == MOST_SOURCES
    assert endpoint.totals().frames == MOST_SOURCES * 5


def test_a_flood_of_senders_does_not_end_the_channel_of_a_vehicle_that_speaks(endpoint: Endpoint) -> None:
    vehicle = admitted(endpoint, "vehicle")
    endpoint.heard(vehicle, 0.0)
    for number in range(MOST_SOURCES * 5):
        admitted(endpoint, number, 2.0)
    assert endpoint.channel("vehicle", 2.0) is vehicle


def test_vehicles_that_speak_keep_all_places_and_a_silent_newcomer_loses_its_place(endpoint: Endpoint) -> None:
    for number in range(MOST_SOURCES):
        endpoint.heard(admitted(endpoint, number), 0.0)
    for second in range(1, 8):
        for number in range(1, MOST_SOURCES):
            endpoint.heard(admitted(endpoint, number, second), float(second))
        assert endpoint.hear_stranger(HEARTBEAT, "new", second)[0] is None or second > 5
    assert endpoint.channel("new", 7.0) is not None
    assert endpoint.channel(0, 7.0) is None


def test_a_reused_parser_keeps_no_bytes_of_its_previous_sender(endpoint: Endpoint) -> None:
    for number in range(MOST_SOURCES):
        admitted(endpoint, number).parser.feed(HEARTBEAT[:9])
    admitted(endpoint, "new")  # the next stranger gets the parser of the first sender
    assert endpoint.hear_stranger(HEARTBEAT[9:], "newer", 0.0) == (None, [])


def test_a_silent_peer_gives_its_place_to_a_vehicle_that_speaks(endpoint: Endpoint) -> None:
    for number in range(MOST_PEERS):
        endpoint.heard(admitted(endpoint, number), 0.0)
    vehicle = admitted(endpoint, "vehicle")
    became = [second for second in range(20) if endpoint.heard(vehicle, float(second))]
    assert len(became) == 1
    assert became[0] < 15


def test_a_peer_that_has_spoken_for_long_keeps_its_place_for_as_long(endpoint: Endpoint) -> None:
    for second in range(21):
        for number in range(MOST_PEERS):
            endpoint.heard(admitted(endpoint, number), float(second))
    vehicle = admitted(endpoint, "vehicle")
    assert not endpoint.heard(vehicle, 39.0)
    assert endpoint.heard(vehicle, 41.0)


def test_the_first_peers_are_kept_and_one_line_says_how_many_get_nothing(
    endpoint: Endpoint, caplog: pytest.LogCaptureFixture
) -> None:
    for number in range(MOST_PEERS + 10):
        endpoint.heard(admitted(endpoint, number), 0.0)
    assert [channel.source for channel in endpoint.peers()] == list(range(MOST_PEERS))
    for second in range(1, 8):
        endpoint.forget_silent(float(second))
    [line] = caplog.messages
    assert line.startswith(f"{endpoint.link.text}: 10 senders are neither answered nor forwarded, ")
    assert line.endswith(" for one: there is room for 64, and for 16 at one address")


def test_the_vehicles_of_a_fleet_have_a_channel_each_at_one_address_or_at_many(endpoint: Endpoint) -> None:
    for number in range(254):
        for source in (("10.0.0.1", number), (f"10.0.1.{number}", 14550)):
            admitted(endpoint, source).hear(0.0)
    assert len(list(endpoint.channels())) == 2 * 254


def test_one_address_holds_at_most_a_quarter_of_the_channels_and_one_line_counts_the_rest(
    endpoint: Endpoint, caplog: pytest.LogCaptureFixture
) -> None:
    for port in range(300):
        channel, _ = endpoint.hear_stranger(HEARTBEAT, ("10.0.0.1", port), 0.0)
        if channel is not None:
            channel.hear(0.0)
    assert len(list(endpoint.channels())) == MOST_SOURCES // 4
    endpoint.forget_silent(1.0)
    assert endpoint.hear_stranger(HEARTBEAT, ("10.0.0.1", 300), 2.0)[0] is None
    endpoint.forget_silent(2.0)
    endpoint.forget_silent(31.0)
    first, second = caplog.messages
    assert first.startswith(f"{endpoint.link.text}: 44 senders are not heard, 10.0.0.1:")
    where = "10.0.0.1:300 for one: there is room for 1024, and for 256 at one address"
    assert second == f"{endpoint.link.text}: 1 sender is not heard, {where}"
    assert admitted(endpoint, ("10.0.0.2", 14550))


def test_one_address_holds_at_most_a_quarter_of_the_places_of_peers(endpoint: Endpoint) -> None:
    became = [endpoint.heard(admitted(endpoint, ("10.0.0.1", port)), 0.0) for port in range(20)]
    assert became == [True] * 16 + [False] * 4
    assert endpoint.heard(admitted(endpoint, ("10.0.0.2", 14550)), 0.0)


def test_a_client_on_which_an_autopilot_speaks_stays_and_idle_ones_matter_least(endpoint: Endpoint) -> None:
    vehicle, station = admitted(endpoint, "vehicle"), admitted(endpoint, "station")
    vehicle.hear(0.0)
    endpoint.forget_silent(1.0)
    assert [endpoint.priority(source) for source in ("vehicle", "station", "idle")] == [STAYS, SPEAKS, IDLE]
    endpoint.forget_silent(20.0)
    assert [endpoint.priority(source) for source in ("vehicle", "station")] == [STAYS, IDLE]
    station.parser.feed(HEARTBEAT)
    endpoint.forget_silent(PEER_SILENCE + 1)
    assert [endpoint.priority(source) for source in ("vehicle", "station")] == [IDLE, SPEAKS]


def test_a_peer_and_its_requested_interval_are_forgotten_after_30_s_of_silence(endpoint: Endpoint) -> None:
    old, young = admitted(endpoint, "old"), admitted(endpoint, "young")
    endpoint.heard(old, 0.0)
    old.interval = 0.2
    endpoint.heard(young, 1.0)
    endpoint.forget_silent(PEER_SILENCE + 0.5)
    assert list(endpoint.peers()) == [young]
    assert old.interval is None


def test_a_listening_endpoint_sends_to_the_address_of_a_channel(endpoint: Endpoint, peer: socket.socket) -> None:
    channel = admitted(endpoint, peer.getsockname())
    assert not list(endpoint.peers())
    endpoint.heard(channel, 0.0)
    assert [c.send(b"one") for c in endpoint.peers()] == [True]
    assert peer.recv(100) == b"one"
    assert str(channel).startswith("127.0.0.1:")


def test_an_endpoint_that_sends_first_has_one_channel_whoever_answers(peer: socket.socket) -> None:
    port = peer.getsockname()[1]
    out = Endpoint(LinkConfig(f"udpout:127.0.0.1:{port}"), True)
    with contextlib.closing(out.link):
        answering = admitted(out, ("127.0.0.1", port))
        assert list(out.peers()) == [answering] == [out.channel(("127.0.0.1", port), 0.0)]
        assert answering.send(b"one")
        assert peer.recv(100) == b"one"


def test_after_an_answer_only_its_address_counts_until_it_is_silent(peer: socket.socket) -> None:
    port = peer.getsockname()[1]
    out = Endpoint(LinkConfig(f"udpout:127.0.0.1:{port}"))
    stranger, router, target = ("10.9.9.9", 5), ("127.0.0.1", 5), ("127.0.0.1", port)
    with contextlib.closing(out.link):
        only = admitted(out, stranger)
        for source in (router, target):  # each is nearer to the target than the one before
            assert out.hear_stranger(b"no MAVLink", source, 1.0) == (None, [])
            assert out.hear_stranger(HEARTBEAT, source, 1.0)[0] is only
        for source in (router, stranger):
            assert out.hear_stranger(HEARTBEAT, source, 4.0) == (None, [])
        assert out.hear_stranger(HEARTBEAT, router, 5.0)[0] is only


def test_the_address_that_answers_keeps_its_place_while_it_sends_anything(peer: socket.socket) -> None:
    port = peer.getsockname()[1]
    out = Endpoint(LinkConfig(f"udpout:127.0.0.1:{port}"))
    with contextlib.closing(out.link):
        only = admitted(out, ("127.0.0.1", port))
        assert out.channel(("127.0.0.1", port), 5.0) is only
        assert out.hear_stranger(HEARTBEAT, ("10.9.9.9", 5), 6.0) == (None, [])


def sends_to(link: Endpoint, peers: list[socket.socket]) -> list[socket.socket]:
    """Those who get what the link sends, of these."""
    assert [channel.send(b"x") for channel in link.peers()] == [True]
    ready, _, _ = select.select(peers, [], [], 5)
    for peer in ready:
        peer.recv(100)
    return ready


def test_a_broadcast_link_hears_every_address_and_sends_to_the_one_that_answers() -> None:
    with contextlib.ExitStack() as opened:
        first, second = (opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(2))
        for peer in (first, second):
            peer.bind(("127.0.0.1", 0))
        link = Endpoint(LinkConfig("udpbcast:127.255.255.255:9"))
        opened.callback(link.link.close)
        one, two = admitted(link, first.getsockname()), admitted(link, second.getsockname(), 1.0)
        assert one is not two
        assert sends_to(link, [first, second]) == [first]
        assert not two.send(b"x")
        assert link.heard(one, 1.0)  # the peers have changed, told once
        assert not link.heard(one, 1.0)

        for now in (1.5, 3.4):
            assert link.channel(second.getsockname(), now) is two
        assert sends_to(link, [first, second]) == [first]
        assert link.channel(second.getsockname(), 4.1) is two  # the first one is silent for more than 3.5 s
        assert sends_to(link, [first, second]) == [second]

        assert link.channel(first.getsockname(), 4.2) is one
        assert sends_to(link, [first, second]) == [second]
        assert {channel.source for channel in link.channels()} == {first.getsockname(), second.getsockname()}


def test_a_flood_on_a_broadcast_link_does_not_end_the_channel_that_it_sends_to() -> None:
    link = Endpoint(LinkConfig("udpbcast:127.255.255.255:9"))
    with contextlib.closing(link.link):
        answering = admitted(link, ("127.0.0.1", 5))
        for number in range(MOST_SOURCES * 2):
            admitted(link, (f"10.0.{number // 250}.{number % 250}", 5), 1.0)
        assert len(list(link.channels())) == MOST_SOURCES
        assert list(link.peers()) == [answering]
        assert link.channel(("127.0.0.1", 5), 1.0) is answering


def test_a_new_connection_does_not_continue_a_frame_of_the_previous_one() -> None:
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as server:
        out = Endpoint(LinkConfig(f"tcp:127.0.0.1:{server.getsockname()[1]}"))
        with contextlib.closing(out.link):
            fed = []
            for source, data in ((1, HEARTBEAT[:9]), (2, HEARTBEAT[9:]), (2, HEARTBEAT)):
                channel = out.channel(source, 0.0)
                assert channel is not None
                fed.append(len(channel.parser.feed(data)))
            assert fed == [0, 0, 1]


def test_a_passive_endpoint_sends_nothing(peer: socket.socket) -> None:
    passive = Endpoint(LinkConfig("udpin:127.0.0.1:0", passive=True), False)
    with contextlib.closing(passive.link):
        assert not admitted(passive, peer.getsockname()).send(b"no")
        peer.setblocking(False)
        with pytest.raises(BlockingIOError):
            peer.recv(100)


def test_frames_that_are_lost_between_unneeded_ones_are_counted(
    endpoint: Endpoint, caplog: pytest.LogCaptureFixture
) -> None:
    unneeded = [enclose(27, b"imu", system=1, component=1, sequence=number) for number in (1, 2, 5)]
    admitted(endpoint, "a").parser.feed(b"".join(unneeded))
    with caplog.at_level("INFO"):
        endpoint.log_counters()
    assert ": 4 frames, 2 lost, " in caplog.text
    assert ", 0 datagrams dropped; " in caplog.text


def test_a_link_that_starts_forwarding_keeps_its_counters_and_delivers_every_frame(endpoint: Endpoint) -> None:
    unwanted = encode(NamedValueInt(0, 7, b"RS_STATE"), system=1, component=1, sequence=0)
    for keeps in (False, True):
        endpoint.adjust(LinkConfig(endpoint.url), 3, keep_all=keeps)
        frames = admitted(endpoint, "a").parser.feed(HEARTBEAT + unwanted)
        assert [frame.raw for frame in frames] == [HEARTBEAT, unwanted]
    assert endpoint.totals().frames == 5
    assert endpoint.number == 3


def test_a_link_becomes_passive_and_keeps_its_peers(endpoint: Endpoint, peer: socket.socket) -> None:
    channel = admitted(endpoint, peer.getsockname())
    endpoint.heard(channel, 0.0)
    endpoint.adjust(LinkConfig(endpoint.url, passive=True), 0)
    assert not channel.send(HEARTBEAT)
    endpoint.adjust(LinkConfig(endpoint.url), 0)
    assert list(endpoint.peers()) == [channel]
    assert channel.send(HEARTBEAT)
    assert peer.recv(300) == HEARTBEAT
