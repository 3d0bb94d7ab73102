"""Conformance tests for links: the behaviour of `mav_robot_status.links.Link` that the gateway relies on.

Subclass `LinkConformance` in a test module of your package (`StreamLinkConformance` for a link whose `stream` is true)
and provide the other end in a fixture::

    class TestMyLink(LinkConformance):
        @pytest.fixture
        def peer(self) -> MyPeer:
            return MyPeer()

pytest then runs the tests on your link. They use real time only to wait for input, at most PATIENCE seconds.
"""

from __future__ import annotations

import logging
import math
import select
import threading
from collections.abc import Callable, Iterator
from typing import NamedTuple, Protocol

import pytest

from ...links import Link, Received, open_link
from ...links.url import parse

PATIENCE = 5.0
"""Seconds that a test waits for input. Only a test that fails waits so long."""
FRAME = 280
"""Bytes of the longest MAVLink 2 frame."""


class Peer(Protocol):
    """The other end of the link under test. It can disconnect and connect again."""

    url: str
    """The connection string of the link under test."""

    def connect(self, link: Link) -> None:
        """Connect, also after `disconnect`, so that `send` reaches the link. May turn the link with a `LinkDriver`."""

    def disconnect(self) -> None:
        """Disconnect without a message. May be called again."""

    def send(self, data: bytes) -> None:
        """Send to the link."""

    def receive(self) -> bytes:
        """The data that the link has sent. Waits up to PATIENCE for it; empty if none arrives."""


class LinkDriver:
    """Turns a link as the gateway does. Time jumps to the next due time."""

    def __init__(self, link: Link) -> None:
        self.link = link
        self.now = 0.0
        self.turns = 0
        self.pieces: list[Received] = []
        """The pieces that have arrived."""

    def turn(self, seconds: float = 0.01) -> None:
        """Do the work that is due, then wait up to `seconds` for input and receive it."""
        self.turns += 1
        due = self.link.due()
        if due < math.inf:
            self.now = max(self.now, due)
            self.link.service(self.now)
        descriptor = self.link.fileno()
        if descriptor >= 0 and readable(descriptor, seconds):
            self.pieces += self.link.receive()

    def until(self, condition: Callable[[], bool]) -> bool:
        """Turn until a condition is true; False if it is not within PATIENCE."""
        for _ in range(round(PATIENCE / 0.01)):
            if condition():
                return True
            self.turn()
        return False

    def received(self, size: int = 1) -> bytes:
        """Turn until at least `size` bytes have arrived since the last call."""
        assert self.until(lambda: sum(len(piece.data) for piece in self.pieces) >= size)
        data = b"".join(piece.data for piece in self.pieces)
        self.pieces.clear()
        return data


def readable(descriptor: int, seconds: float = PATIENCE) -> bool:
    """Wait until the descriptor is readable; False on timeout."""
    poll = select.poll()
    poll.register(descriptor, select.POLLIN)
    return bool(poll.poll(seconds * 1000))


class Pair(NamedTuple):
    """A link, its peer, and the driver that turns the link."""

    link: Link
    peer: Peer
    driver: LinkDriver

    def meet(self) -> Received:
        """Let the peer connect and send. Return the piece that the link receives."""
        self.peer.connect(self.link)
        self.peer.send(b"hello, link")
        assert self.driver.until(lambda: bool(self.driver.pieces))
        return self.driver.pieces.pop()


class LinkConformance:
    """The tests for every link."""

    @pytest.fixture
    def peer(self) -> Peer:
        """The other end of the link under test; its `url` names the link."""
        raise NotImplementedError(f"{type(self).__name__} needs a fixture `peer`")

    @pytest.fixture
    def pair(self, peer: Peer) -> Iterator[Pair]:
        """The open link, and its peer, which has not connected yet."""
        link = open_link(parse(peer.url))
        yield Pair(link, peer, LinkDriver(link))
        link.close()
        peer.disconnect()

    def test_data_arrives_whole_in_both_directions(self, pair: Pair) -> None:
        hello = pair.meet()
        assert hello.data == b"hello, link"
        assert pair.link.send(b"hello, peer", hello.source)
        assert pair.peer.receive() == b"hello, peer"
        pair.peer.send(bytes(range(256)) * 4)
        assert pair.driver.received(1024) == bytes(range(256)) * 4
        assert pair.link.dropped == 0

    def test_its_text_is_one_line_and_its_sources_are_hashable(self, pair: Pair) -> None:
        assert len(pair.link.text.splitlines()) == 1
        assert isinstance(hash(pair.meet().source), int)

    def test_it_works_before_a_peer_connects(self, pair: Pair) -> None:
        assert pair.link.receive() == []
        pair.driver.turn()
        assert pair.link.receive() == []
        assert pair.link.send(b"x") in (True, False)
        assert pair.meet().data == b"hello, link"

    def test_receive_and_send_return_at_once_without_input(self, pair: Pair) -> None:
        hello = pair.meet()
        calls = threading.Thread(target=lambda: (pair.link.receive(), pair.link.send(b"x", hello.source)), daemon=True)
        calls.start()
        calls.join(PATIENCE)
        assert not calls.is_alive(), "receive or send blocks"

    def test_its_descriptor_is_readable_only_when_data_waits(self, pair: Pair) -> None:
        pair.meet()
        assert pair.driver.until(lambda: pair.link.due() > pair.driver.now + 1.0)
        descriptor = pair.link.fileno()
        assert not readable(descriptor, 0)
        pair.peer.send(b"x")
        assert readable(descriptor)
        assert [piece.data for piece in pair.link.receive()] == [b"x"]
        assert not readable(descriptor, 0)

    def test_it_receives_no_more_pieces_than_the_limit(self, pair: Pair) -> None:
        pair.meet()
        for _ in range(3):
            pair.peer.send(b"x")
        assert readable(pair.link.fileno())
        assert len(pair.link.receive(1)) == 1

    def test_service_does_nothing_before_it_is_due(self, pair: Pair) -> None:
        pair.meet()
        assert pair.driver.until(lambda: pair.link.due() > pair.driver.now + 1.0)
        due, descriptor = pair.link.due(), pair.link.fileno()
        for _ in range(3):
            pair.link.service(pair.driver.now)
        assert (pair.link.due(), pair.link.fileno()) == (due, descriptor)

    def test_a_peer_may_disconnect_and_connect_again(self, pair: Pair) -> None:
        first = pair.meet()
        descriptor = pair.link.fileno()
        for _ in range(3):
            pair.peer.disconnect()
            for _ in range(10):
                pair.link.send(b"hello again, peer", first.source)
                pair.driver.turn()
            assert pair.meet().data == b"hello, link"
            assert pair.link.fileno() == descriptor

    def test_the_log_has_one_line_for_a_peer_that_does_not_return(
        self, pair: Pair, caplog: pytest.LogCaptureFixture
    ) -> None:
        caplog.set_level(logging.INFO)
        pair.meet()
        pair.peer.disconnect()
        for _ in range(10):
            pair.driver.turn(0)
        lines = len(caplog.records)
        for _ in range(20):
            pair.link.send(b"x")
            pair.driver.turn(0)
        assert len(caplog.records) <= lines + 1  # a link may detect late that the peer is silent

    def test_it_may_be_closed_twice(self, pair: Pair) -> None:
        hello = pair.meet()
        for _ in range(2):
            pair.link.close()
            assert pair.link.fileno() == -1
            assert pair.link.receive() == []
            assert not pair.link.send(b"x", hello.source)
            assert pair.link.due() == math.inf
            pair.link.service(1e9)
            assert pair.link.due() == math.inf

    def test_it_may_be_closed_before_a_peer_connects(self, pair: Pair) -> None:
        pair.driver.turn()
        pair.link.close()
        assert pair.link.fileno() == -1
        assert pair.link.due() == math.inf


class StreamLinkConformance(LinkConformance):
    """The tests for a link whose `stream` is true: connections without message boundaries."""

    def test_each_connection_has_a_different_source(self, pair: Pair) -> None:
        sources = []
        for _ in range(3):
            sources.append(pair.meet().source)
            pair.peer.disconnect()
        assert len(set(sources)) == 3
        assert pair.link.stream

    def test_a_peer_that_does_not_read_loses_whole_frames(self, pair: Pair) -> None:
        hello = pair.meet()
        sent = []
        number = 0
        while pair.link.dropped < 50:
            if pair.link.send(number.to_bytes(4, "big") * (FRAME // 4), hello.source):
                sent.append(number)
            number += 1
        assert pair.link.dropped == number - len(sent)
        received = b""
        while len(received) < FRAME * len(sent):
            pair.driver.turn(0)  # sends the rest of the last frame
            piece = pair.peer.receive()
            assert piece
            received += piece
        frames = [received[start : start + FRAME] for start in range(0, len(received), FRAME)]
        assert frames == [one.to_bytes(4, "big") * (FRAME // 4) for one in sent]
        assert pair.link.send(b"space again", hello.source)
        assert pair.peer.receive() == b"space again"
