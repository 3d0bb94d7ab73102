import select
import socket
from collections.abc import Iterator

import pytest

from mav_robot_status.link.stream import Stream

Pair = tuple[Stream, select.epoll, socket.socket]


@pytest.fixture(name="pair")
def fixture_pair() -> Iterator[Pair]:
    with select.epoll() as epoll:
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        theirs.settimeout(5)
        yield Stream(epoll, ours.fileno(), "them"), epoll, theirs
        ours.close()
        theirs.close()


FRAME = bytes(range(250)) * 1001


def fill(stream: Stream) -> int:
    """How many frames are taken until there is no room."""
    count = 0
    while stream.write(FRAME):
        count += 1
    return count


def drain(theirs: socket.socket) -> bytes:
    """All that has come so far."""
    pieces = []
    while select.select([theirs], [], [], 0)[0]:
        pieces.append(theirs.recv(1 << 20))
    return b"".join(pieces)


def test_the_rest_of_a_frame_goes_before_the_next_frame(pair: Pair) -> None:
    stream, _, theirs = pair
    count = fill(stream)
    heard = drain(theirs)
    assert len(heard) % len(FRAME), "the system has cut no frame, so this shows nothing"
    while not stream.write(b"next"):
        heard += drain(theirs)
    assert heard + drain(theirs) == FRAME * count + b"next"


def test_the_rest_of_a_frame_goes_as_soon_as_there_is_room(pair: Pair) -> None:
    stream, epoll, theirs = pair
    count = fill(stream)
    assert not epoll.poll(0)
    heard = drain(theirs)
    while epoll.poll(0):
        with pytest.raises(BlockingIOError):
            stream.read()
        heard += drain(theirs)
    assert heard == FRAME * count


def test_an_end_is_told_after_all_that_came_before_it(pair: Pair) -> None:
    stream, epoll, theirs = pair
    theirs.send(b"goodbye")
    theirs.close()
    assert epoll.poll(0)
    assert stream.read() == (b"goodbye", "them")
    with pytest.raises(OSError, match="closed by the other end"):
        stream.read()


def test_sending_to_an_end_that_has_gone_is_an_error(pair: Pair) -> None:
    stream, _, theirs = pair
    theirs.close()
    with pytest.raises(BrokenPipeError):
        stream.write(b"x")


def test_a_stream_that_is_detached_wakes_nobody(pair: Pair) -> None:
    stream, epoll, theirs = pair
    theirs.send(b"x")
    assert epoll.poll(0)
    stream.detach()
    assert not epoll.poll(0)
