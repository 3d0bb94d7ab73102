import logging
import math
import os
import resource
import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from mav_robot_status.errors import LinkError
from mav_robot_status.links.base import IDLE, SPEAKS, STAYS
from mav_robot_status.links.tcp_server import MAX_CLIENTS, NEWCOMER, RETRY, TcpServerLink
from mav_robot_status.links.url import parse
from mav_robot_status.testing.conformance.links import LinkDriver, readable

from .peers import port_of

Connect = Callable[..., socket.socket]


class Clock:
    """A clock that a test sets."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture(name="clock")
def fixture_clock() -> Clock:
    return Clock()


@pytest.fixture(name="link")
def fixture_link(clock: Clock) -> Iterator[TcpServerLink]:
    link = TcpServerLink(parse("tcpin:127.0.0.1:0"), fraction=lambda: 0.0, clock=clock)
    yield link
    link.close()


@pytest.fixture(name="connect")
def fixture_connect(link: TcpServerLink) -> Iterator[Connect]:
    with ExitStack() as clients:

        def connect(host: str = "127.0.0.1") -> socket.socket:
            client = clients.enter_context(socket.create_connection(("127.0.0.1", port_of(link)), 5, (host, 0)))
            assert readable(link.fileno())
            link.receive()
            return client

        yield connect


def test_the_text_names_the_port(link: TcpServerLink) -> None:
    assert port_of(link) > 0
    assert link.text == f"listening on 127.0.0.1:{port_of(link)}/tcp"
    assert link.due() == math.inf


def test_clients_have_their_own_sources_and_receive_alone_or_together(link: TcpServerLink, connect: Connect) -> None:
    clients = [connect() for _ in range(3)]
    sources = []
    for number, client in enumerate(clients):
        client.send(b"I am %d" % number)
        assert readable(link.fileno())
        [piece] = link.receive()
        assert piece.data == b"I am %d" % number
        assert isinstance(piece.source, tuple)
        assert piece.source[:2] == client.getsockname()
        sources.append(piece.source)
    assert link.send(b"to one", sources[1])
    assert link.send(b"to all")
    assert [client.recv(6) for client in clients] == [b"to all", b"to one", b"to all"]
    clients[0].close()
    assert readable(link.fileno())
    link.receive()
    assert not link.send(b"to nobody", sources[0])
    assert link.dropped == 1
    assert link.send(b"to all")
    assert link.dropped == 1


def test_a_send_without_clients_is_counted(link: TcpServerLink) -> None:
    assert not link.send(b"x")
    assert link.dropped == 1


def test_a_client_that_does_not_read_does_not_affect_the_others(link: TcpServerLink, connect: Connect) -> None:
    connect()
    reading = connect()
    sent = 0
    while link.dropped < 10:
        assert link.send(b"x" * 280)
        sent += 280
        while readable(reading.fileno(), 0):
            sent -= len(reading.recv(1 << 16))
    while sent:
        sent -= len(reading.recv(1 << 16))
    assert sent == 0


def test_no_more_than_eight_clients_are_accepted(
    link: TcpServerLink, connect: Connect, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    clients = [connect() for _ in range(MAX_CLIENTS)]
    too_many = [connect() for _ in range(3)]
    assert [client.recv(1) for client in too_many] == [b""] * 3
    assert link.refused == 3
    assert caplog.messages == [f"{link.text}: 127.0.0.1:{too_many[0].getsockname()[1]} refused: already 8 clients"]
    clients[3].close()
    assert readable(link.fileno())
    link.receive()
    late = connect()
    assert link.send(b"welcome")
    assert late.recv(100) == b"welcome"


def test_each_connect_and_disconnect_is_logged(
    link: TcpServerLink, connect: Connect, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    client = connect()
    name = f"{link.text}: 127.0.0.1:{client.getsockname()[1]}"
    client.close()
    assert readable(link.fileno())
    link.receive()
    assert caplog.messages == [f"{name} has connected", f"{name} is gone: closed by the other end"]


def test_a_client_whose_connection_breaks_on_sending_is_dropped(link: TcpServerLink, connect: Connect) -> None:
    client = connect()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    client.close()
    assert readable(link.fileno())
    assert not link.send(b"x")
    assert not readable(link.fileno(), 0)


@pytest.mark.parametrize("host", ["127.0.0.1", "[::1]"])
def test_a_port_in_use_is_an_error_that_names_the_owner(host: str) -> None:
    first = TcpServerLink(parse(f"tcpin:{host}:0"))
    with pytest.raises(LinkError, match="stop it or listen on another port") as raised:
        TcpServerLink(parse(f"tcpin:{host}:{port_of(first)}"))
    where = f"tcp port {port_of(first)} on {host.strip('[]')}"
    assert str(raised.value).startswith(f"{where} is taken by ")
    assert f"(pid {os.getpid()})" in str(raised.value)
    first.close()


def test_connections_in_time_wait_do_not_block_the_port(link: TcpServerLink, connect: Connect) -> None:
    client = connect()
    text = f"tcpin:127.0.0.1:{port_of(link)}"
    link.close()  # we close first, so our port stays in TIME_WAIT
    assert client.recv(1) == b""
    client.close()
    again = TcpServerLink(parse(text))
    again.close()


def test_an_invalid_host_is_a_one_line_error() -> None:
    with pytest.raises(LinkError, match=r"'a\.\.b' is not a known host; to listen write an address of this machine"):
        TcpServerLink(parse("tcpin:a..b:5760"))


def test_without_free_descriptors_the_server_neither_fails_nor_spins(
    link: TcpServerLink, caplog: pytest.LogCaptureFixture
) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with socket.create_connection(("127.0.0.1", port_of(link)), 5) as client:
        probe = os.dup(0)
        os.close(probe)
        resource.setrlimit(resource.RLIMIT_NOFILE, (probe, hard))  # every lower number is in use
        try:
            assert link.receive() == []
            assert link.due() == -math.inf
            link.service(100.0)
            assert link.due() == 100.0 + RETRY[0]
            link.service(link.due())
            assert link.receive() == []
            link.service(200.0)
            assert link.due() == 200.0 + 2 * RETRY[0]
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
        assert caplog.messages == [f"{link.text}: cannot accept another client: too many open files"]
        client.send(b"at last")
        assert LinkDriver(link).received(7) == b"at last"


def speaking(link: TcpServerLink, client: socket.socket) -> object:
    """The source of a client that has sent something."""
    client.sendall(b"x")
    assert readable(link.fileno())
    [piece] = link.receive()
    return piece.source


def is_open(client: socket.socket) -> bool:
    client.setblocking(False)
    try:
        return client.recv(1) != b""
    except BlockingIOError:
        return True


def test_a_client_without_valid_frames_gives_way_before_one_with_and_a_vehicle_never(
    link: TcpServerLink, connect: Connect, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    clients = [connect() for _ in range(MAX_CLIENTS)]
    priorities = {speaking(link, client): STAYS for client in clients}
    *_, talker, idle = priorities
    priorities.update({talker: SPEAKS, idle: IDLE})
    link.priority = lambda source: priorities.get(source, STAYS)
    assert not is_open(connect())  # all are new
    clock.now += NEWCOMER + 1
    for gone in (clients[-1], clients[-2]):
        assert is_open(gone)
        assert is_open(connect())
        assert not is_open(gone)
    assert not is_open(connect())
    assert link.refused == 2
    assert sum("makes room for a new client" in line for line in caplog.messages) == 1


def test_clients_that_speak_and_come_back_do_not_drop_a_vehicle_before_its_first_heartbeat(
    link: TcpServerLink, connect: Connect, clock: Clock
) -> None:
    link.priority = lambda source: SPEAKS
    talkers = [connect() for _ in range(MAX_CLIENTS)]
    clock.now += NEWCOMER + 1
    vehicle = connect()
    for _ in range(MAX_CLIENTS * 2):
        talkers.append(connect())
    assert is_open(vehicle)


def test_a_host_with_many_new_clients_gives_way_to_another_host(
    link: TcpServerLink, connect: Connect, clock: Clock
) -> None:
    link.priority = lambda source: SPEAKS
    crowd = [connect() for _ in range(MAX_CLIENTS)]
    vehicle = connect("127.0.0.2")
    assert is_open(vehicle)
    assert [is_open(client) for client in crowd] == [False] + [True] * (MAX_CLIENTS - 1)


def test_lines_that_clients_cause_are_paced_and_counted(
    link: TcpServerLink, connect: Connect, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    for _ in range(100):
        connect().close()
        clock.now += 0.1
        assert readable(link.fileno())
        link.receive()
    assert len(caplog.messages) == 16
    clock.now += 240
    connect()
    assert caplog.messages[-1].endswith("has connected (92 lines before it were left out)")


def test_connections_from_other_addresses_are_closed_and_counted(caplog: pytest.LogCaptureFixture) -> None:
    link = TcpServerLink(parse("tcpin:127.0.0.1:0?from=127.0.0.5"))
    try:
        for _ in range(3):
            with socket.create_connection(("127.0.0.1", port_of(link)), 5) as other:
                assert readable(link.fileno())
                assert link.receive() == []
                assert not is_open(other)
        assert link.due() == -math.inf
        link.service(100.0)
        assert link.due() == math.inf
        assert caplog.messages == [f"{link.text}: refused 3 connections from 127.0.0.1, which is not in from=127.0.0.5"]
        assert link.text.endswith("/tcp, from 127.0.0.5 only")
        with socket.create_connection(("127.0.0.1", port_of(link)), 5, ("127.0.0.5", 0)) as vehicle:
            assert readable(link.fileno())
            assert link.receive() == []
            vehicle.sendall(b"heard")
            assert LinkDriver(link).received(5) == b"heard"
    finally:
        link.close()
