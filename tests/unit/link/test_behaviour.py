"""What every kind of link does alike, on real sockets and real terminals."""

import logging
import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest

from mav_robot_status.link.base import Link, Received
from mav_robot_status.link.url import KINDS

from .ends import End, TcpClientEnd, TcpServerEnd, TerminalEnd, Turner, UdpClientEnd, UdpServerEnd, open_at, wait

ENDS: dict[str, Callable[[Path], End]] = {
    "udpin": lambda _: UdpClientEnd(),
    "udpout": lambda _: UdpServerEnd(),
    "udpbcast": lambda _: UdpServerEnd("udpbcast", "127.255.255.255", "0.0.0.0"),
    "tcp": lambda _: TcpServerEnd(),
    "tcp over IPv6": lambda _: TcpServerEnd("::1"),
    "tcpin": lambda _: TcpClientEnd(),
    "serial": TerminalEnd,
}
STREAMS = [kind for kind in ENDS if kind.startswith(("tcp", "serial"))]
FRAME = 280  # bytes, the longest of MAVLink 2


class Rig(NamedTuple):
    link: Link
    end: End
    turner: Turner

    def meet(self) -> Received:
        """The other end comes and says something."""
        self.end.come(self.link)
        self.end.say(b"hello, link")
        assert self.turner.until(lambda: bool(self.turner.pieces))
        return self.turner.pieces.pop()


@pytest.fixture(params=ENDS)
def rig(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Rig]:
    end = ENDS[request.param](tmp_path)
    link = open_at(end)
    yield Rig(link, end, Turner(link))
    link.close()
    end.go()


def test_every_live_kind_is_here() -> None:
    assert {kind.name for kind in KINDS if kind.name != "log"} <= set(ENDS)


def test_what_is_said_and_answered_comes_whole(rig: Rig) -> None:
    hello = rig.meet()
    assert hello.data == b"hello, link"
    assert rig.link.send(b"hello, end", hello.source)
    assert rig.end.hear() == b"hello, end"
    rig.end.say(bytes(range(256)) * 4)
    assert rig.turner.heard(1024) == bytes(range(256)) * 4
    assert rig.link.dropped == 0


def test_receiving_and_sending_before_anybody_is_there_do_no_harm(rig: Rig) -> None:
    assert rig.link.receive() == []
    rig.turner.turn()
    assert rig.link.receive() == []
    assert rig.link.send(b"x") in (True, False)
    assert rig.meet().data == b"hello, link"


def test_its_descriptor_wakes_who_waits_when_something_comes_and_not_before(rig: Rig) -> None:
    rig.meet()
    assert rig.turner.until(lambda: rig.link.due() in (math.inf, rig.turner.now + 30))
    descriptor = rig.link.fileno()
    assert not wait(descriptor, 0)
    rig.end.say(b"x")
    assert wait(descriptor)
    assert [piece.data for piece in rig.link.receive()] == [b"x"]
    assert not wait(descriptor, 0)


def test_it_takes_no_more_pieces_than_the_limit(rig: Rig) -> None:
    rig.meet()
    for _ in range(3):
        rig.end.say(b"x")
    assert wait(rig.link.fileno())
    assert len(rig.link.receive(1)) == 1


def test_an_end_that_goes_is_survived_and_heard_again_when_it_comes_back(rig: Rig) -> None:
    first = rig.meet()
    descriptor = rig.link.fileno()
    for _ in range(3):
        rig.end.go()
        for _ in range(10):
            rig.link.send(b"is anybody there", first.source)
            rig.turner.turn()
        assert rig.meet().data == b"hello, link"
        assert rig.link.fileno() == descriptor


@pytest.mark.parametrize("rig", STREAMS, indirect=True)
def test_each_connection_of_a_stream_has_an_address_of_its_own(rig: Rig) -> None:
    sources = []
    for _ in range(3):
        sources.append(rig.meet().source)
        rig.end.go()
    assert len(set(sources)) == 3
    assert rig.link.stream


def test_attempts_in_vain_are_told_once(rig: Rig, caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    rig.meet()
    rig.end.go()
    for _ in range(10):
        rig.turner.turn(0)
    told = len(caplog.records)
    for _ in range(20):
        rig.link.send(b"x")
        rig.turner.turn(0)
    # a broadcaster whose peer is silent says so in this time
    assert len(caplog.records) <= told + rig.end.url.startswith("udpbcast")


def test_closing_it_twice_is_closing_it_once(rig: Rig) -> None:
    hello = rig.meet()
    for _ in range(2):
        rig.link.close()
        assert rig.link.fileno() == -1
        assert rig.link.receive() == []
        assert not rig.link.send(b"x", hello.source)
        assert rig.link.due() == math.inf
        rig.link.service(1e9)
        assert rig.link.due() == math.inf


def test_closing_it_before_anybody_came_is_closing_it(rig: Rig) -> None:
    rig.turner.turn()
    rig.link.close()
    assert rig.link.fileno() == -1
    assert rig.link.due() == math.inf


@pytest.mark.parametrize("rig", STREAMS, indirect=True)
def test_an_end_that_does_not_read_costs_frames_but_cuts_none(rig: Rig) -> None:
    hello = rig.meet()
    sent = []
    number = 0
    while rig.link.dropped < 50:
        if rig.link.send(number.to_bytes(4, "big") * (FRAME // 4), hello.source):
            sent.append(number)
        number += 1
    assert rig.link.dropped == number - len(sent)
    heard = b""
    while len(heard) < FRAME * len(sent):
        rig.turner.turn(0)  # sends what was left of the last frame
        piece = rig.end.hear()
        assert piece
        heard += piece
    frames = [heard[start : start + FRAME] for start in range(0, len(heard), FRAME)]
    assert frames == [one.to_bytes(4, "big") * (FRAME // 4) for one in sent]
    assert rig.link.send(b"there is room again", hello.source)
    assert rig.end.hear() == b"there is room again"
