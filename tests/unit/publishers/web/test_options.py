from __future__ import annotations

import re
import socket
from pathlib import Path

import pytest

from mav_robot_status.errors import LinkError, UsageError
from mav_robot_status.publishers.web.options import WebOptions, listen, read, read_token

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
def test_a_place_on_this_computer_needs_no_more(text: str, host: str, port: int) -> None:
    found = read({"listen": text})
    assert (found.host, found.port, found.token) == (host, port, None)


def test_by_default_it_is_this_computer() -> None:
    assert read({}) == WebOptions("127.0.0.1", 8765)


@pytest.mark.parametrize("text", ["", "here", "127.0.0.1", "127.0.0.1:", "::1:8765", "127.0.0.1:99999", "[::1:8]:x"])
def test_what_is_no_place_to_listen_is_said(text: str) -> None:
    with pytest.raises(UsageError, match=r"no place to listen; write HOST:PORT"):
        read({"listen": text})


@pytest.mark.parametrize("place", ["0.0.0.0:8765", "[::]:8765"])
def test_elsewhere_it_takes_a_token_or_the_word_of_the_person(place: str, token_file: Path) -> None:
    with pytest.raises(UsageError, match=r"others on the network could look: add --http-token-file FILE"):
        read({"listen": place})
    with pytest.raises(UsageError, match="others on the network"):
        read({"listen": place, "open": "yes"})
    assert read({"listen": place, "open": True}).token is None
    assert read({"listen": place, "token_file": str(token_file)}).token == TOKEN


def test_an_unknown_option_is_named() -> None:
    with pytest.raises(UsageError, match=r"http: unknown option 'port'; there are listen, token_file, open, hosts"):
        read({"port": 1})


@pytest.mark.parametrize(("given", "names"), [("robots.example", ("robots.example",)), (["a", "b"], ("a", "b"))])
def test_further_names_are_one_or_a_list(given: object, names: tuple[str, ...]) -> None:
    assert read({"hosts": given}).names == names


def test_a_token_that_others_can_read_is_refused(token_file: Path) -> None:
    token_file.chmod(0o640)
    with pytest.raises(UsageError, match=f"chmod 600 {token_file}"):
        read_token(str(token_file))


@pytest.mark.parametrize("content", [b"", b"short", b"two words of a token", b"\xff" * 32, b"x" * 2000])
def test_what_is_no_token_is_refused_and_not_shown(content: bytes, token_file: Path) -> None:
    token_file.write_bytes(content)
    with pytest.raises(UsageError, match=r"one line of 16 characters or more") as error:
        read_token(str(token_file))
    assert not content or content.decode("latin-1") not in str(error.value)


def test_a_token_file_that_is_not_there_is_said(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=re.escape(f"{tmp_path}/none: cannot read the token: No such file")):
        read_token(f"{tmp_path}/none")


def test_a_taken_port_is_an_error_that_names_it() -> None:
    with listen(WebOptions(port=0)) as first:
        port = first.getsockname()[1]
        with pytest.raises(LinkError, match=rf"http: cannot listen on 127\.0\.0\.1:{port}/tcp: Address already in use"):
            listen(WebOptions(port=port))


def test_a_name_that_nobody_knows_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def unknown(*arguments: object, **named: object) -> None:
        raise socket.gaierror(-2, "Name or service not known")

    monkeypatch.setattr(socket, "getaddrinfo", unknown)
    with pytest.raises(LinkError, match=r"the name 'robot\.example' is not known"):
        read({"listen": "robot.example:8765"})
