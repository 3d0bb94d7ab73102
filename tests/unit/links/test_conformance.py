"""The conformance tests on every kind of link, on real sockets and real terminals."""

import math
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

import pytest

from mav_robot_status.links import Received, Url
from mav_robot_status.links.kinds import KINDS
from mav_robot_status.testing.conformance.links import LinkConformance, LinkDriver, Pair, Peer, StreamLinkConformance

from .custom_link import UnixPeer
from .peers import TcpClient, TcpServer, Terminal, UdpClient, UdpServer
from .unix_link import UNIX, UnixLink

DATAGRAMS: dict[str, Callable[[Path], Peer]] = {
    "udpin": lambda _: UdpClient(),
    "udpout": lambda _: UdpServer(),
    "udpbcast": lambda _: UdpServer("udpbcast", "127.255.255.255", "0.0.0.0"),
    "a custom link": UnixPeer,
}
STREAMS: dict[str, Callable[[Path], Peer]] = {
    "tcp": lambda _: TcpServer(),
    "tcp over IPv6": lambda _: TcpServer("::1"),
    "tcpin": lambda _: TcpClient(),
    "serial": Terminal,
}


@pytest.mark.usefixtures("unix_kind")
class TestDatagramLinks(LinkConformance):
    @pytest.fixture(params=DATAGRAMS)
    def peer(self, request: pytest.FixtureRequest, tmp_path: Path) -> Peer:
        return DATAGRAMS[request.param](tmp_path)


class TestStreamLinks(StreamLinkConformance):
    @pytest.fixture(params=STREAMS)
    def peer(self, request: pytest.FixtureRequest, tmp_path: Path) -> Peer:
        return STREAMS[request.param](tmp_path)


def test_every_live_kind_is_tested() -> None:
    assert {kind.name for kind in KINDS if not kind.is_log} <= {*DATAGRAMS, *STREAMS}


class Unlimited(UnixLink):
    def receive(self, limit: int = 64) -> list[Received]:
        return super().receive(64)


class Cut(UnixLink):
    def receive(self, limit: int = 64) -> list[Received]:
        return [Received(piece.data[:500], piece.source) for piece in super().receive(limit)]


class Open(UnixLink):
    def close(self) -> None: ...


class Restless(UnixLink):
    at = math.inf

    def due(self) -> float:
        return self.at

    def service(self, now: float) -> None:
        self.at = now + 60.0


@pytest.mark.parametrize(
    ("broken", "test"),
    [
        (Unlimited, LinkConformance.test_it_receives_no_more_pieces_than_the_limit),
        (Cut, LinkConformance.test_data_arrives_whole_in_both_directions),
        (Open, LinkConformance.test_it_may_be_closed_before_a_peer_connects),
        (Restless, LinkConformance.test_service_does_nothing_before_it_is_due),
    ],
)
def test_a_link_that_breaks_the_contract_fails_its_test(
    broken: type[UnixLink],
    test: Callable[[LinkConformance, Pair], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("mav_robot_status.testing.conformance.links.PATIENCE", 0.2)
    peer = UnixPeer(tmp_path)
    link = broken(Url(UNIX, "", 0, str(tmp_path / "link"), 0, peer.url))
    with ExitStack() as stack:
        stack.callback(peer.disconnect)
        stack.callback(link._socket.close)
        with pytest.raises(AssertionError):
            test(LinkConformance(), Pair(link, peer, LinkDriver(link)))
