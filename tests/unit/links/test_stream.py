import select
import socket
from collections.abc import Iterator

import pytest

from mav_robot_status.links.stream import Stream

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
    """Send frames until the buffer is full. Return their number."""
    count = 0
    while stream.write(FRAME):
        count += 1
    return count


def drain(theirs: socket.socket) -> bytes:
    """The bytes that have arrived so far."""
    pieces = []
    while select.select([theirs], [], [], 0)[0]:
        pieces.append(theirs.recv(1 << 20))
    return b"".join(pieces)


def test_the_rest_of_a_frame_is_sent_before_the_next_frame(pair: Pair) -> None:
    stream, _, theirs = pair
    count = fill(stream)
    heard = drain(theirs)
    assert len(heard) % len(FRAME), "the system has cut no frame, so this shows nothing"
    while not stream.write(b"next"):
        heard += drain(theirs)
    assert heard + drain(theirs) == FRAME * count + b"next"


def test_the_rest_of_a_frame_is_sent_as_soon_as_the_buffer_has_room(pair: Pair) -> None:
    stream, epoll, theirs = pair
    count = fill(stream)
    assert not epoll.poll(0)
    heard = drain(theirs)
    while epoll.poll(0):
        with pytest.raises(BlockingIOError):
            stream.read()
        heard += drain(theirs)
    assert heard == FRAME * count


def test_the_end_of_a_stream_is_reported_after_all_its_data(pair: Pair) -> None:
    stream, epoll, theirs = pair
    theirs.send(b"goodbye")
    theirs.close()
    assert epoll.poll(0)
    assert stream.read() == (b"goodbye", "them")
    with pytest.raises(OSError, match="closed by the other end"):
        stream.read()


def test_sending_to_a_closed_peer_is_an_error(pair: Pair) -> None:
    stream, _, theirs = pair
    theirs.close()
    with pytest.raises(BrokenPipeError):
        stream.write(b"x")


def test_a_detached_stream_does_not_make_the_epoll_readable(pair: Pair) -> None:
    stream, epoll, theirs = pair
    theirs.send(b"x")
    assert epoll.poll(0)
    stream.detach()
    assert not epoll.poll(0)
