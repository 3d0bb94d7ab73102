"""The server with real connections. `look` gets its time from the test."""

from __future__ import annotations

import errno
import logging
import socket
import struct
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from functools import partial

import pytest

from mav_robot_status.publishers.listener import listen
from mav_robot_status.publishers.simple_message.requests import RequestReader
from mav_robot_status.publishers.simple_message.server import (
    MINUTE,
    MOST_CLIENTS,
    MOST_WAITING,
    SOCKET_OPTIONS,
    Server,
)

from ....deadline import SOON, allow, wait_until

PING, PONG = struct.pack("<4i", 12, 1, 2, 0), struct.pack("<4i", 12, 1, 3, 1)
LATEST, NEXT = b"the latest frame", b"the next frame"


class Ends:
    """A server and its clients."""

    def __init__(self, ended: ExitStack) -> None:
        self._ended = ended
        opened = listen("test", "127.0.0.1", 0, SOCKET_OPTIONS, 64)
        self.address = opened.getsockname()
        self.server = ended.enter_context(closing(Server("test", opened, partial(RequestReader, "little"))))

    def connect(self, receive_buffer: int | None = None) -> socket.socket:
        """A new client. It may not be accepted yet."""
        client = self._ended.enter_context(socket.socket())
        if receive_buffer is not None:
            client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        client.settimeout(allow(SOON))
        client.connect(self.address)
        return client

    def look(self, now: float = 0.0, latest: bytes = LATEST) -> None:
        self.server.look(now, latest)

    def has_room(self) -> bool:
        """Look; whether another client would be accepted."""
        self.look()
        return len(self.server._clients) < MOST_CLIENTS

    def look_until(self, client: socket.socket, expected: bytes) -> None:
        """Look until the client has received this."""
        client.setblocking(False)
        got = bytearray()

        def arrived() -> bool:
            self.look()
            try:
                got.extend(client.recv(4096))
            except BlockingIOError:
                return False
            return len(got) >= len(expected)

        wait_until(arrived, what=f"received {bytes(got)!r}")
        assert bytes(got) == expected
        client.settimeout(allow(SOON))


@pytest.fixture
def ends() -> Iterator[Ends]:
    with ExitStack() as ended:
        yield Ends(ended)


def received(client: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count and (more := client.recv(count - len(data))):
        data += more
    return data


def test_a_new_client_gets_the_latest_frame_and_then_every_frame(ends: Ends) -> None:
    client = ends.connect()
    ends.look()
    ends.server.send(NEXT)
    assert received(client, len(LATEST + NEXT)) == LATEST + NEXT


def test_a_new_client_gets_nothing_while_there_is_no_frame(ends: Ends) -> None:
    client = ends.connect()
    ends.look(latest=b"")
    ends.server.send(NEXT)
    assert received(client, len(NEXT)) == NEXT


def test_a_ninth_client_is_refused_and_told_once_a_minute(ends: Ends, caplog: pytest.LogCaptureFixture) -> None:
    clients = [ends.connect() for _ in range(MOST_CLIENTS)]
    ends.look()
    with caplog.at_level(logging.WARNING):
        for at in (0.0, 1.0, MINUTE - 1, MINUTE):
            assert ends.connect().fileno() > 0
            ends.look(at)
    first, second = caplog.messages
    assert "refused: already 8 clients" in first
    assert second.endswith("refused: already 8 clients (2 lines before it were left out)")
    ends.server.send(NEXT)
    assert [received(client, len(LATEST + NEXT)) for client in clients] == [LATEST + NEXT] * MOST_CLIENTS


def test_a_refused_client_sees_the_end_of_its_connection(ends: Ends) -> None:
    for _ in range(MOST_CLIENTS):
        ends.connect()
    ninth = ends.connect()
    ends.look()
    assert ninth.recv(1) == b""


@pytest.mark.parametrize("reset", [False, True])
def test_a_client_that_has_gone_makes_room(ends: Ends, reset: bool) -> None:
    clients = [ends.connect() for _ in range(MOST_CLIENTS)]
    ends.look()
    if reset:
        clients[0].setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    clients[0].close()
    wait_until(ends.has_room)
    ends.look_until(ends.connect(), LATEST)
    assert ends.server.dropped == 0


def test_a_client_that_connects_again_at_once_is_not_refused(ends: Ends) -> None:
    clients = [ends.connect() for _ in range(MOST_CLIENTS)]
    ends.look()
    clients[0].close()
    again = ends.connect()
    ends.look()
    assert received(again, len(LATEST)) == LATEST


def test_a_client_that_does_not_read_is_disconnected_after_64_kb(ends: Ends, caplog: pytest.LogCaptureFixture) -> None:
    silent, reading = ends.connect(receive_buffer=1), ends.connect()
    ends.look(latest=b"")
    sent = 0
    with caplog.at_level(logging.WARNING):
        while not ends.server.dropped:
            ends.server.send(bytes(44))
            sent += 44
            assert received(reading, 44) == bytes(44)
            assert sent < 1 << 20
    assert MOST_WAITING < sent < 2 * MOST_WAITING  # the kernels hold some, too
    assert [message for message in caplog.messages if "does not read and is disconnected" in message]
    with pytest.raises(ConnectionResetError):
        received(silent, 1 << 20)
    ends.server.send(NEXT)
    assert received(reading, len(NEXT)) == NEXT
    assert ends.server.dropped == 1


def test_a_client_that_reads_late_gets_every_frame(ends: Ends) -> None:
    client = ends.connect(receive_buffer=1)
    ends.look(latest=b"")
    frames = [struct.pack("<11i", *range(number, number + 11)) for number in range(MOST_WAITING // 44)]
    for frame in frames:
        ends.server.send(frame)
    ends.look_until(client, b"".join(frames))
    assert ends.server.dropped == 0


def test_a_client_that_pings_and_does_not_read_is_disconnected(ends: Ends) -> None:
    client = ends.connect(receive_buffer=1)
    client.setblocking(False)
    ends.look()

    def flooded() -> bool:
        with suppress(OSError):  # its buffer is full, or it was disconnected
            client.send(PING * 256)
        ends.look()
        return ends.server.dropped == 1

    wait_until(flooded)


def test_a_ping_is_answered_between_frames(ends: Ends) -> None:
    client = ends.connect()
    ends.look()
    client.sendall(PING)
    ends.look_until(client, LATEST + PONG)


def test_half_a_request_and_silence_changes_nothing(ends: Ends) -> None:
    client = ends.connect()
    client.sendall(PING[:7])
    ends.look_until(client, LATEST)
    ends.server.send(NEXT)
    assert received(client, len(NEXT)) == NEXT
    client.sendall(PING[7:])
    ends.look_until(client, PONG)


def test_a_half_open_client_gives_its_place_back_within_20_seconds(ends: Ends) -> None:
    """While frames wait for their acknowledgement, the kernel sends no keepalives."""
    ends.connect()
    ends.look()
    (client,) = ends.server._clients.values()
    assert client.socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 20_000
    idle, interval, count = (
        client.socket.getsockopt(socket.IPPROTO_TCP, option)
        for option in (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
    )
    assert idle + interval * count == 20


def test_what_one_client_sends_does_not_touch_another(ends: Ends) -> None:
    hostile, other = ends.connect(), ends.connect()
    hostile.sendall(b"\xff" * 5000)
    other.sendall(PING)
    ends.look_until(other, LATEST + PONG)
    ends.server.send(NEXT)
    assert received(hostile, len(LATEST + NEXT)) == LATEST + NEXT


def test_without_free_descriptors_one_line_is_logged_a_minute(caplog: pytest.LogCaptureFixture) -> None:
    class Exhausted(socket.socket):
        def accept(self) -> tuple[socket.socket, object]:
            raise OSError(errno.EMFILE, "Too many open files")

    with listen("test", "127.0.0.1", 0, (), 1) as opened:
        server = Server("test", Exhausted(fileno=opened.detach()), partial(RequestReader, "little"))
        address = server.where.rpartition(":")
        with socket.create_connection((address[0], int(address[2]))), caplog.at_level(logging.WARNING):
            for at in (0.0, 0.1, 0.2):
                server.look(at, LATEST)
        server.close()
    assert caplog.messages == [f"test on {server.where}/tcp: cannot accept a client: Too many open files"]


def test_clients_that_connect_again_and_again_do_not_fill_the_log(ends: Ends, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        for _ in range(50):
            client = ends.connect()
            ends.look_until(client, LATEST)
            client.close()
    assert len(caplog.messages) == 20


def test_closing_ends_all_connections_and_frees_the_port(ends: Ends) -> None:
    client = ends.connect()
    ends.look()
    ends.server.close()
    assert received(client, 1 << 10) == LATEST
    ends.server.close()
    host, port = ends.address
    listen("test", host, port, (), 1).close()
