import errno
import logging
import math
import socket
from collections.abc import Callable, Iterator

import pytest

from mav_robot_status.link.stream import STEADY
from mav_robot_status.link.tcp import CONNECT_WAIT, RETRY, TcpLink
from mav_robot_status.link.url import parse

from .conftest import Names
from .ends import Turner, wait

Open = Callable[[str], TcpLink]


@pytest.fixture(name="open_")
def fixture_open() -> Iterator[Open]:
    links = []

    def open_(text: str) -> TcpLink:
        links.append(TcpLink(parse(text), chance=lambda: 0.0))
        return links[-1]

    yield open_
    for link in links:
        link.close()


@pytest.fixture(name="server")
def fixture_server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(5)
        yield server


@pytest.fixture(name="closed_port")
def fixture_closed_port() -> int:
    """A port where nobody listens."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def where(server: socket.socket) -> str:
    return f"127.0.0.1:{server.getsockname()[1]}/tcp"


def connect(link: TcpLink, server: socket.socket, now: float) -> socket.socket:
    """The server's end of a connection that is made at `now`."""
    link.service(now)
    accepted = server.accept()[0]
    if link.due() != now + STEADY:
        assert wait(link.fileno())
        assert link.receive() == []
        link.service(now)
    assert link.due() == now + STEADY
    return accepted


def test_a_peer_that_refuses_is_called_at_longer_and_longer_intervals(
    open_: Open, closed_port: int, caplog: pytest.LogCaptureFixture
) -> None:
    link = open_(f"tcp:127.0.0.1:{closed_port}")
    assert link.due() == -math.inf
    now, waits = 100.0, []
    for _ in range(8):
        link.service(now)
        while link.due() == now + CONNECT_WAIT:  # the answer comes in its own time
            assert wait(link.fileno())
            assert link.receive() == []
            link.service(now)
        waits.append(round(link.due() - now, 6))
        now = link.due()
    assert waits == [0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 10.0, 10.0]
    assert caplog.messages == [f"connecting to 127.0.0.1:{closed_port}/tcp: connection refused, trying again"]


def test_what_is_said_from_connecting_to_losing(
    open_: Open, server: socket.socket, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    link = open_(f"tcp:{where(server).removesuffix('/tcp')}")
    connect(link, server, 100.0).close()
    assert wait(link.fileno())
    link.service(100.0 + STEADY)
    assert link.due() == math.inf
    assert link.receive() == []
    assert link.due() == -math.inf
    link.service(110.0)
    assert link.due() == 110.0 + RETRY[0]
    accepted = connect(link, server, 110.0 + RETRY[0])
    assert link.send(b"again")
    assert accepted.recv(100) == b"again"
    accepted.close()
    assert [(record.levelname, record.message) for record in caplog.records] == [
        ("INFO", f"connected to {where(server)}"),
        ("WARNING", f"lost {where(server)}: closed by the other end, trying again"),
        ("INFO", f"connected to {where(server)}"),
    ]


def test_a_peer_that_closes_again_and_again_is_told_once_and_called_less_and_less(
    open_: Open, server: socket.socket, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    link = open_(f"tcp:{where(server).removesuffix('/tcp')}")
    now, waits = 100.0, []
    for _ in range(4):
        with connect(link, server, now) as accepted:
            accepted.send(b"x")
        while link.due() != -math.inf:
            assert wait(link.fileno())
            link.receive()
        link.service(now)
        waits.append(round(link.due() - now, 6))
        now = link.due()
    assert waits == [0.2, 0.4, 0.8, 1.6]
    assert caplog.messages == [
        f"connected to {where(server)}",
        f"connecting to {where(server)}: closed by the other end soon after connecting, trying again",
    ]
    with connect(link, server, now):
        link.service(now + STEADY)
    assert caplog.messages[2:] == [f"connected to {where(server)}"]


def test_a_peer_that_was_away_is_told_when_it_is_back_even_if_it_left_soon(
    open_: Open, closed_port: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    link = open_(f"tcp:127.0.0.1:{closed_port}")
    turner = Turner(link)
    name = f"127.0.0.1:{closed_port}/tcp"
    with socket.create_server(("127.0.0.1", closed_port)) as server:
        connect(link, server, 0.0).close()
        assert wait(link.fileno())
        link.receive()
    assert turner.until(lambda: "refused" in caplog.text)
    with socket.create_server(("127.0.0.1", closed_port)) as server:
        turner.until(lambda: wait(server.fileno(), 0))
        server.accept()[0].close()
    assert [message.removesuffix(", trying again") for message in caplog.messages[:4]] == [
        f"connected to {name}",
        f"connecting to {name}: closed by the other end soon after connecting",
        f"connecting to {name}: connection refused",
        f"connected to {name}",
    ]


def test_a_connection_that_breaks_on_sending_is_let_go(open_: Open, server: socket.socket) -> None:
    link = open_(f"tcp:{where(server).removesuffix('/tcp')}")
    accepted = connect(link, server, 100.0)
    accepted.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    accepted.close()  # with a reset
    assert wait(link.fileno())
    assert not link.send(b"x")
    assert link.dropped == 1
    assert link.due() == -math.inf
    assert not wait(link.fileno(), 0)


def test_a_host_that_does_not_answer_is_given_up(open_: Open, server: socket.socket) -> None:
    with socket.create_server(("127.0.0.1", 0), backlog=0) as deaf:
        address = deaf.getsockname()
        with socket.create_connection(address):  # its backlog is full now: what else comes is not answered
            link = open_(f"tcp:127.0.0.1:{address[1]}")
            link.service(100.0)
            assert link.due() == 100.0 + CONNECT_WAIT
            assert link.receive() == []
            link.service(101.0)
            assert link.due() == 100.0 + CONNECT_WAIT
            assert not link.send(b"x")
            link.service(100.0 + CONNECT_WAIT)
            assert link.due() == 100.0 + CONNECT_WAIT + RETRY[0]


def test_each_address_of_a_name_is_tried(open_: Open, server: socket.socket, names: Names) -> None:
    names.known["sitl.test"] = "127.0.0.2 127.0.0.3 127.0.0.1"
    link = open_(f"tcp:sitl.test:{server.getsockname()[1]}")
    names.ask(link, 100.0)
    while link.due() == 100.0 + CONNECT_WAIT:
        assert wait(link.fileno())
        link.receive()
        link.service(100.0)
    server.accept()[0].close()
    assert link.due() == 100.0 + STEADY


def test_a_name_that_is_not_known_is_asked_for_again(
    open_: Open, server: socket.socket, names: Names, caplog: pytest.LogCaptureFixture
) -> None:
    link = open_(f"tcp:sitl.test:{server.getsockname()[1]}")
    names.ask(link, 100.0)
    names.ask(link, link.due())
    assert names.asked == 2
    assert link.due() == 100.0 + 0.2 + 0.4
    assert caplog.messages == [
        f"connecting to sitl.test:{server.getsockname()[1]}/tcp: the name is not known, trying again"
    ]
    names.known["sitl.test"] = "127.0.0.1"
    names.ask(link, link.due())
    server.accept()[0].close()


def test_a_kind_of_address_that_this_machine_has_not_is_no_end(
    open_: Open, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse(family: int, kind: int) -> socket.socket:
        raise OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol")

    link = open_("tcp:[::1]:5760")
    monkeypatch.setattr(socket, "socket", refuse)
    link.service(100.0)
    assert link.due() == 100.0 + RETRY[0]
    assert caplog.messages == ["connecting to [::1]:5760/tcp: address family not supported by protocol, trying again"]


def test_frames_do_not_wait_for_company_and_a_dead_peer_is_noticed(open_: Open, server: socket.socket) -> None:
    link = open_(f"tcp:{where(server).removesuffix('/tcp')}")
    with connect(link, server, 100.0):
        assert link._socket
        assert link._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        assert link._socket.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        assert link._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 20_000
