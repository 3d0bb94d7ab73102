from __future__ import annotations

import socket

import pytest

from mav_robot_status.publishers.web.access_control import AccessControl
from mav_robot_status.publishers.web.settings import WebSettings

from .site import Site

TOKEN = "correct-horse-battery"


def access_for(**options: object) -> AccessControl:
    return AccessControl(WebSettings(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "host",
    ["127.0.0.1", "127.0.0.1:8765", "localhost:1", "[::1]:8765", "[fe80::1]", "10.0.0.7:80", "LOCALHOST", "localhost."],
)
def test_addresses_and_names_of_this_computer_are_accepted(host: str) -> None:
    assert access_for().is_known_host(host)


@pytest.mark.parametrize(
    "host", ["", "evil.example", "localhost.evil.example", "127.0.0.1.evil.example:8765", "[", ":", "[]"]
)
def test_a_foreign_name_that_resolves_here_is_not_accepted(host: str) -> None:
    assert not access_for().is_known_host(host)


def test_configured_names_are_accepted() -> None:
    opened = access_for(names=("Robots.example",))
    assert opened.is_known_host("robots.example:443")
    assert opened.is_known_host(socket.gethostname())


@pytest.mark.parametrize(
    ("shown", "admitted"),
    [
        (f"Bearer {TOKEN}", True), (f"bearer  {TOKEN}", True), ("", False), ("Bearer", False),
        (f"Basic {TOKEN}", False),
        (f"Bearer {TOKEN}x", False), (f"Bearer {TOKEN[:-1]}", False), ("Bearer \udcff\u00e9", False),
    ],
)  # fmt: skip
def test_only_a_client_with_the_token_is_admitted(shown: str, admitted: bool) -> None:
    assert access_for(token=TOKEN).has_token(shown) is admitted


def test_without_a_token_every_client_is_admitted() -> None:
    assert access_for().has_token("")


def test_data_requires_the_token_and_the_page_does_not() -> None:
    with Site(token=TOKEN) as site:
        for path in ("/api/v1/vehicles", "/api/v1/vehicles/1", "/events"):
            refused = site.ask(path)
            assert (refused.status, refused.headers["WWW-Authenticate"]) == (401, "Bearer")
        assert site.ask("/api/v1/vehicles", Authorization=f"Bearer {TOKEN}").status == 200
        for path in ("/", "/page.js", "/healthz", "/readyz", "/schema.json"):
            assert site.ask(path).status == 200


def test_an_unknown_host_name_gets_no_data() -> None:
    with Site() as site:
        for path in ("/", "/api/v1/vehicles", "/events", "/healthz"):
            assert site.ask(path, Host="evil.example").status == 421


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE", "OPTIONS", "PROPFIND"])
def test_every_method_that_writes_is_refused(method: str) -> None:
    with Site() as site:
        for path in ("/", "/api/v1/vehicles", "/events", "/nothing"):
            refused = site.ask(path, method)
            assert (refused.status, refused.headers["Allow"]) == (405, "GET,HEAD")


@pytest.mark.parametrize("path", ["/%61pi/v1/vehicles", "/api%2Fv1/vehicles", "/%65vents", "http://localhost/events"])
def test_a_path_in_another_spelling_requires_the_token_too(path: str) -> None:
    with Site(token=TOKEN) as site:
        assert site.ask(path).status == 401


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
