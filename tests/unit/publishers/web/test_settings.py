from __future__ import annotations

import re
import socket
from pathlib import Path

import pytest

from mav_robot_status.errors import LinkError, UsageError
from mav_robot_status.publishers.web.settings import WebSettings, listen, read, read_token

TOKEN = "correct-horse-battery"


@pytest.fixture
def token_file(tmp_path: Path) -> Path:
    path = tmp_path / "token"
    path.write_text(TOKEN + "\n")
    path.chmod(0o600)
    return path


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("127.0.0.1:8765", "127.0.0.1", 8765),
        ("localhost:80", "localhost", 80),
        ("[::1]:8765", "::1", 8765),
        (":8765", "127.0.0.1", 8765),
        ("8765", "127.0.0.1", 8765),
    ],
)
def test_a_loopback_address_needs_no_other_option(text: str, host: str, port: int) -> None:
    found = read({"listen": text})
    assert (found.host, found.port, found.token) == (host, port, None)


def test_the_default_is_this_computer_without_alarms() -> None:
    assert read({}) == WebSettings("127.0.0.1", 8765)
    assert read({"alarm": True}) == WebSettings("127.0.0.1", 8765, alarm=True)


@pytest.mark.parametrize("text", ["", "here", "127.0.0.1", "127.0.0.1:", "::1:8765", "127.0.0.1:99999", "[::1:8]:x"])
def test_an_invalid_address_is_an_error(text: str) -> None:
    with pytest.raises(UsageError, match=r"not an address to listen on; write HOST:PORT"):
        read({"listen": text})


@pytest.mark.parametrize("place", ["0.0.0.0:8765", "[::]:8765"])
def test_any_other_address_needs_a_token_or_open(place: str, token_file: Path) -> None:
    with pytest.raises(UsageError, match=r"others on the network can see the data: add --http-token-file FILE"):
        read({"listen": place})
    with pytest.raises(UsageError, match="http: open: must be true or false, not 'yes'"):
        read({"listen": place, "open": "yes"})
    assert read({"listen": place, "open": True}).token is None
    assert read({"listen": place, "token_file": str(token_file)}).token == TOKEN


def test_an_unknown_option_is_named() -> None:
    with pytest.raises(UsageError, match=r"http: unknown option 'port'; the options are listen, token"):
        read({"port": 1})


@pytest.mark.parametrize(("given", "names"), [("robots.example", ("robots.example",)), (["a", "b"], ("a", "b"))])
def test_hosts_is_one_name_or_a_list(given: object, names: tuple[str, ...]) -> None:
    assert read({"hosts": given}).names == names


def test_a_token_that_others_can_read_is_refused(token_file: Path) -> None:
    token_file.chmod(0o640)
    with pytest.raises(UsageError, match=f"chmod 600 {token_file}"):
        read_token(str(token_file))


@pytest.mark.parametrize("content", [b"", b"short", b"two words of a token", b"\xff" * 32, b"x" * 2000])
def test_an_invalid_token_is_refused_and_not_shown(content: bytes, token_file: Path) -> None:
    token_file.write_bytes(content)
    with pytest.raises(UsageError, match=r"one line of at least 16 characters") as error:
        read_token(str(token_file))
    assert not content or content.decode("latin-1") not in str(error.value)


def test_a_missing_token_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=re.escape(f"{tmp_path}/none: cannot read the token: No such file")):
        read_token(f"{tmp_path}/none")


def test_a_port_in_use_is_an_error_that_names_the_port() -> None:
    with listen(WebSettings(port=0)) as first:
        port = first.getsockname()[1]
        with pytest.raises(LinkError, match=rf"http: cannot listen on 127\.0\.0\.1:{port}/tcp: Address already in use"):
            listen(WebSettings(port=port))


def test_an_unresolvable_name_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*arguments: object, **named: object) -> None:
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(LinkError, match=r"cannot resolve the name 'robot\.example'"):
        read({"listen": "robot.example:8765"})
