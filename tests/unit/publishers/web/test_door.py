from __future__ import annotations

import socket

import pytest

from mav_robot_status.clock import Instant
from mav_robot_status.clock import now as present
from mav_robot_status.publishers.web import door
from mav_robot_status.publishers.web.door import Door
from mav_robot_status.publishers.web.options import WebOptions

from .site import SOON, Site, until

TOKEN = "correct-horse-battery"


def the_door(**options: object) -> Door:
    return Door(WebOptions(**options), lambda: 0.0)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1", "127.0.0.1:8765", "localhost:1", "[::1]:8765", "[fe80::1]", "10.0.0.7:80", "LOCALHOST", "localhost."],
)
def test_addresses_and_this_computer_are_known(host: str) -> None:
    assert the_door().knows(host)


@pytest.mark.parametrize(
    "host", ["", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example:8765", "[", ":", "[]"]
)
def test_a_name_that_somebody_else_made_lead_here_is_not(host: str) -> None:
    assert not the_door().knows(host)


def test_names_that_were_given_are_known() -> None:
    opened = the_door(names=("Robots.example",))
    assert opened.knows("robots.example:443")
    assert opened.knows(socket.gethostname())


@pytest.mark.parametrize(
    ("shown", "admitted"),
    [
        (f"Bearer {TOKEN}", True), (f"bearer  {TOKEN}", True), ("", False), ("Bearer", False),
        (f"Basic {TOKEN}", False),
        (f"Bearer {TOKEN}x", False), (f"Bearer {TOKEN[:-1]}", False), ("Bearer \udcff\u00e9", False),
    ],
)  # fmt: skip
def test_only_who_shows_the_token_is_admitted(shown: str, admitted: bool) -> None:
    assert the_door(token=TOKEN).admits(shown) is admitted


def test_without_a_token_everybody_is() -> None:
    assert the_door().admits("")


def test_data_need_the_token_and_the_page_that_asks_for_it_does_not() -> None:
    with Site(token=TOKEN) as site:
        for path in ("/api/v1/vehicles", "/api/v1/vehicles/1", "/events"):
            refused = site.ask(path)
            assert (refused.status, refused.headers["WWW-Authenticate"]) == (401, "Bearer")
        assert site.ask("/api/v1/vehicles", Authorization=f"Bearer {TOKEN}").status == 200
        for path in ("/", "/page.js", "/healthz", "/readyz", "/schema.json"):
            assert site.ask(path).status == 200


def test_another_host_name_gets_nothing() -> None:
    with Site() as site:
        for path in ("/", "/api/v1/vehicles", "/events", "/healthz"):
            assert site.ask(path, Host="evil.example").status == 421


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE", "OPTIONS", "PROPFIND"])
def test_nothing_can_be_changed(method: str) -> None:
    with Site() as site:
        for path in ("/", "/api/v1/vehicles", "/events", "/nothing"):
            assert site.ask(path, method).status == 405


@pytest.mark.parametrize("path", ["/", "/page.css", "/api/v1/vehicles", "/healthz", "/nothing", "/../../etc/passwd"])
def test_every_answer_has_strict_headers(path: str) -> None:
    with Site() as site:
        headers = site.ask(path).headers
        policy = headers["Content-Security-Policy"]
        assert policy.startswith("default-src 'none'; script-src 'self';")
        assert "unsafe" not in policy
        assert headers["X-Content-Type-Options"] == "nosniff"
        assert headers["X-Frame-Options"] == "DENY"
        assert "Server" not in headers
        assert "Access-Control-Allow-Origin" not in headers


def test_who_connects_and_asks_for_nothing_is_cut_off() -> None:
    ahead = 0.0
    with Site(clock=lambda: Instant(present().mono + ahead, 0)) as site:
        with socket.create_connection(("127.0.0.1", site.port), SOON) as silent:
            assert site.ask("/healthz").status == 200
            ahead = door.SILENT + 1
            assert silent.recv(100) == b""
        assert site.ask("/healthz").status == 200


def test_there_are_no_more_connections_than_are_good(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(door, "MOST_CONNECTIONS", 5)
    with Site() as site:
        sockets = [socket.create_connection(("127.0.0.1", site.port), SOON) for _ in range(5)]
        until(lambda: len(site.server._door._server.connections) == 5)
        with socket.create_connection(("127.0.0.1", site.port), SOON) as one_more:
            assert one_more.recv(100) == b""
        sockets[0].sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert sockets[0].recv(12) == b"HTTP/1.1 200"
        for one in sockets:
            one.close()


@pytest.mark.parametrize(
    "data", [b"\0" * 100, b"GET / HTTP/9.9\r\n\r\n", b"GET " + b"x" * 100_000, b"\x16\x03\x01" * 50]
)
def test_what_is_no_http_is_no_news(data: bytes, caplog: pytest.LogCaptureFixture) -> None:
    with Site() as site:
        with socket.create_connection(("127.0.0.1", site.port), SOON) as stranger:
            stranger.sendall(data)
            stranger.shutdown(socket.SHUT_WR)
            while stranger.recv(4096):
                pass
        assert site.ask("/healthz").status == 200
    assert not [r for r in caplog.records if r.levelname in ("ERROR", "CRITICAL")]
