from __future__ import annotations

import contextlib
import errno
import os
import socket
import threading
from pathlib import Path

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.clock import now as present
from mav_robot_status.publishers.web import connections

from ....deadline import SOON, allow
from .site import Site, until

HEALTH = b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n"
MB = 1 << 20


def resident() -> int:
    """Bytes."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def answer_to(site: Site, *parts: bytes, end: bool = True) -> bytes:
    """What the server sends before it closes the connection. `end`: the client says that it sends no more."""
    with socket.create_connection(("127.0.0.1", site.port), allow(SOON)) as stranger:
        received = b""
        with contextlib.suppress(ConnectionError):
            for part in parts:
                stranger.sendall(part)
        if end:
            with contextlib.suppress(OSError):  # the server has closed it
                stranger.shutdown(socket.SHUT_WR)
        with contextlib.suppress(ConnectionError):
            while data := stranger.recv(1 << 16):
                received += data
        return received


def test_a_connection_without_a_request_is_closed() -> None:
    ahead = 0.0
    with Site(clock=lambda: Instant(present().mono + ahead, 0)) as site:
        with socket.create_connection(("127.0.0.1", site.port), allow(SOON)) as silent:
            assert site.ask("/healthz").status == 200
            ahead = connections.SILENT + 1
            assert silent.recv(100) == b""
        assert site.ask("/healthz").status == 200


def test_the_number_of_connections_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "MOST_CONNECTIONS", 5)
    with Site() as site:
        sockets = [socket.create_connection(("127.0.0.1", site.port), allow(SOON)) for _ in range(5)]
        until(lambda: len(site.server._connections.open) == 5)
        with socket.create_connection(("127.0.0.1", site.port), allow(SOON)) as one_more:
            assert one_more.recv(100) == b""
        sockets[0].sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert sockets[0].recv(12) == b"HTTP/1.1 200"
        for one in sockets:
            one.close()


@pytest.mark.parametrize(
    "data", [b"\0" * 100, b"GET / HTTP/9.9\r\n\r\n", b"GET " + b"x" * 100_000, b"\x16\x03\x01" * 50]
)
def test_a_request_that_is_not_http_is_not_logged(data: bytes, caplog: pytest.LogCaptureFixture) -> None:
    with Site() as site:
        answer_to(site, data)
        assert site.ask("/healthz").status == 200
    assert not [r for r in caplog.records if r.levelname in ("ERROR", "CRITICAL")]


@pytest.mark.parametrize(
    ("head", "part", "count", "status"),
    [
        (b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 52428800\r\n\r\n", b"x" * MB, 50, b"405"),
        (HEALTH + b"Content-Length: 52428800\r\n\r\n", b"x" * MB, 50, b"400"),
        (HEALTH + b"Content-Length: 99999999999999999999\r\n\r\n", b"x" * MB, 50, b"400"),
        (HEALTH + b"Transfer-Encoding: chunked\r\n\r\n", b"1000\r\n" + b"x" * 4096 + b"\r\n", 12_800, b"400"),
        (HEALTH + b"Cookie: ", b"x" * MB, 1, b""),
        (HEALTH, b"X: y\r\n" * 1000, 200, b""),
        (b"GET /", b"x" * MB, 1, b""),
    ],
    ids=["body", "body of a read", "length", "chunks", "header", "headers", "target"],
)
def test_what_is_too_large_is_refused_and_not_kept(
    head: bytes, part: bytes, count: int, status: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    with Site() as site:
        assert site.ask("/healthz").status == 200
        before = resident()
        received = answer_to(site, head, *[part] * count, end=False)
        assert received[9:12] in (status, b"")  # the end of the connection may overtake the answer
        assert resident() - before < 8 * MB
        assert site.ask("/healthz").status == 200
    assert not caplog.messages


def test_a_stream_of_requests_that_nobody_reads_answers_to_is_not_kept() -> None:
    with Site() as site, socket.create_connection(("127.0.0.1", site.port), allow(SOON)) as greedy:
        assert site.ask("/healthz").status == 200
        before = resident()
        greedy.settimeout(0.2)
        with contextlib.suppress(OSError):
            for _ in range(200):
                greedy.sendall(b"GET /help.html HTTP/1.1\r\nHost: localhost\r\n\r\n" * 5000)
        assert site.ask("/healthz").status == 200
        assert resident() - before < 8 * MB


def test_requests_in_one_packet_are_answered_in_order() -> None:
    with Site() as site:
        received = answer_to(
            site,
            (HEALTH + b"\r\n") * 3 + b"HEAD / HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n",
            end=False,
        )
        assert received.count(b"HTTP/1.1 200 OK\r\n") == 4
        assert received.endswith(b"\r\n\r\n")


def test_a_slow_client_is_closed_after_its_first_request_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "KEEP_ALIVE", 0.1)
    with Site() as site:
        with socket.create_connection(("127.0.0.1", site.port), allow(SOON)) as slow:
            slow.sendall(HEALTH + b"\r\n" + HEALTH)
            while slow.recv(1 << 16):
                pass
        until(lambda: not site.server._connections.open)


def test_a_client_that_does_not_end_its_body_is_closed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "SILENT", 0.1)
    with Site() as site:
        assert answer_to(site, HEALTH + b"Content-Length: 5\r\n\r\nabc", end=False) == b""


def test_connections_that_cannot_be_accepted_are_one_log_line(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    class Full:
        """A socket whose process has no free descriptor."""

        def __init__(self, whole: socket.socket) -> None:
            self._whole = whole
            self.tried = 0

        def __getattr__(self, name: str) -> object:
            return getattr(self._whole, name)

        def accept(self) -> tuple[socket.socket, object]:
            self.tried += 1
            if self.tried < 3:
                raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))
            return self._whole.accept()

    monkeypatch.setattr(connections, "REST", 0.05)
    with Site() as site:
        full = Full(site.server._connections._socket)
        site.server._connections._socket = full  # type: ignore[assignment]
        assert site.ask("/healthz").status == 200
        assert full.tried >= 3
    assert [r.message for r in caplog.records if r.levelname == "WARNING"] == [
        f"{site.server.url}: cannot accept another browser: too many open files"
    ]


def test_the_end_disconnects_everybody_and_leaves_no_thread(caplog: pytest.LogCaptureFixture) -> None:
    with Site() as site:
        streaming = site.listen()
        next(streaming.events())
        idle = socket.create_connection(("127.0.0.1", site.port), allow(SOON))
        until(lambda: len(site.server._connections.open) == 2)
    assert idle.recv(100) == b""
    assert list(streaming.events()) is not None
    assert not any(thread.name == "http" for thread in threading.enumerate())
    assert not [r for r in caplog.records if r.levelname in ("WARNING", "ERROR", "CRITICAL")]
    idle.close()
    streaming.close()
