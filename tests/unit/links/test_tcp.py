import errno
import logging
import math
import socket
from collections.abc import Callable, Iterator

import pytest

from mav_robot_status.links.stream import STABLE_AFTER
from mav_robot_status.links.tcp import CONNECT_WAIT, RETRY, TcpLink
from mav_robot_status.links.url import parse
from mav_robot_status.testing.conformance.links import LinkDriver, readable

from .conftest import Names

Open = Callable[[str], TcpLink]


@pytest.fixture(name="open_")
def fixture_open() -> Iterator[Open]:
    links = []

    def open_(text: str) -> TcpLink:
        links.append(TcpLink(parse(text), fraction=lambda: 0.0))
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
    """A port without a listener."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as free:
        free.bind(("127.0.0.1", 0))
        return int(free.getsockname()[1])


def where(server: socket.socket) -> str:
    return f"127.0.0.1:{server.getsockname()[1]}/tcp"


def connect(link: TcpLink, server: socket.socket, now: float) -> socket.socket:
    """Connect at `now`, and return the server's socket."""
    link.service(now)
    accepted = server.accept()[0]
    if link.due() != now + STABLE_AFTER:
        assert readable(link.fileno())
        assert link.receive() == []
        link.service(now)
    assert link.due() == now + STABLE_AFTER
    return accepted


def test_a_link_retries_a_peer_that_refuses_at_growing_intervals(
    open_: Open, closed_port: int, caplog: pytest.LogCaptureFixture
) -> None:
    link = open_(f"tcp:127.0.0.1:{closed_port}")
    assert link.due() == -math.inf
    now, waits = 100.0, []
    for _ in range(8):
        link.service(now)
        while link.due() == now + CONNECT_WAIT:  # the outcome is not known yet
            assert readable(link.fileno())
            assert link.receive() == []
            link.service(now)
        waits.append(round(link.due() - now, 6))
        now = link.due()
    assert waits == [0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 10.0, 10.0]
    assert caplog.messages == [f"connecting to 127.0.0.1:{closed_port}/tcp: connection refused, trying again"]


def test_the_log_of_a_connection_that_is_lost_and_restored(
    open_: Open, server: socket.socket, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    link = open_(f"tcp:{where(server).removesuffix('/tcp')}")
    connect(link, server, 100.0).close()
    assert readable(link.fileno())
    link.service(100.0 + STABLE_AFTER)
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


def test_a_peer_that_closes_repeatedly_is_logged_once_and_retried_less_often(
    open_: Open, server: socket.socket, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    link = open_(f"tcp:{where(server).removesuffix('/tcp')}")
    now, waits = 100.0, []
    for _ in range(4):
        with connect(link, server, now) as accepted:
            accepted.send(b"x")
        while link.due() != -math.inf:
            assert readable(link.fileno())
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
        link.service(now + STABLE_AFTER)
    assert caplog.messages[2:] == [f"connected to {where(server)}"]


def test_the_return_of_a_peer_is_logged_even_if_it_leaves_soon(
    open_: Open, closed_port: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    link = open_(f"tcp:127.0.0.1:{closed_port}")
    driver = LinkDriver(link)
    name = f"127.0.0.1:{closed_port}/tcp"
    with socket.create_server(("127.0.0.1", closed_port)) as server:
        connect(link, server, 0.0).close()
        assert readable(link.fileno())
        link.receive()
    assert driver.until(lambda: "refused" in caplog.text)
    with socket.create_server(("127.0.0.1", closed_port)) as server:
        driver.until(lambda: readable(server.fileno(), 0))
        server.accept()[0].close()
    assert [message.removesuffix(", trying again") for message in caplog.messages[:4]] == [
        f"connected to {name}",
        f"connecting to {name}: closed by the other end soon after connecting",
        f"connecting to {name}: connection refused",
        f"connected to {name}",
    ]


def test_a_connection_that_breaks_on_sending_is_dropped(open_: Open, server: socket.socket) -> None:
    link = open_(f"tcp:{where(server).removesuffix('/tcp')}")
    accepted = connect(link, server, 100.0)
    accepted.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
    accepted.close()  # sends a reset
    assert readable(link.fileno())
    assert not link.send(b"x")
    assert link.dropped == 1
    assert link.due() == -math.inf
    assert not readable(link.fileno(), 0)


def test_a_connection_attempt_times_out(open_: Open, server: socket.socket) -> None:
    with socket.create_server(("127.0.0.1", 0), backlog=0) as full:
        address = full.getsockname()
        with socket.create_connection(address):  # its backlog is now full: the next connection gets no answer
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
    names.resolve(link, 100.0)
    while link.due() == 100.0 + CONNECT_WAIT:
        assert readable(link.fileno())
        link.receive()
        link.service(100.0)
    server.accept()[0].close()
    assert link.due() == 100.0 + STABLE_AFTER


def test_an_unknown_name_is_looked_up_again(
    open_: Open, server: socket.socket, names: Names, caplog: pytest.LogCaptureFixture
) -> None:
    link = open_(f"tcp:sitl.test:{server.getsockname()[1]}")
    names.resolve(link, 100.0)
    names.resolve(link, link.due())
    assert names.lookups == 2
    assert link.due() == 100.0 + 0.2 + 0.4
    assert caplog.messages == [
        f"connecting to sitl.test:{server.getsockname()[1]}/tcp: the name is not known, trying again"
    ]
    names.known["sitl.test"] = "127.0.0.1"
    names.resolve(link, link.due())
    server.accept()[0].close()


def test_an_unsupported_address_family_is_retried(
    open_: Open, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def refuse(family: int, kind: int) -> socket.socket:
        raise OSError(errno.EAFNOSUPPORT, "Address family not supported by protocol")

    link = open_("tcp:[::1]:5760")
    monkeypatch.setattr(socket, "socket", refuse)
    link.service(100.0)
    assert link.due() == 100.0 + RETRY[0]
    assert caplog.messages == ["connecting to [::1]:5760/tcp: address family not supported by protocol, trying again"]


def test_frames_are_sent_at_once_and_a_dead_peer_is_detected(open_: Open, server: socket.socket) -> None:
    link = open_(f"tcp:{where(server).removesuffix('/tcp')}")
    with connect(link, server, 100.0):
        assert link._socket
        assert link._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
        assert link._socket.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        assert link._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 20_000
