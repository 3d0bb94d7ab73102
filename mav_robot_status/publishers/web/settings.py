"""The options of the web page: where it is served, and to whom. The default is this computer only."""

from __future__ import annotations

import ipaddress
import socket
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Final, NamedTuple

from ...errors import UsageError
from ...interface.options import Option, Options, short
from ...user_files import read_secret
from ..listener import listen as open_listener
from ..listener import place, resolve

if TYPE_CHECKING:
    from collections.abc import Mapping

SHORTEST_TOKEN: Final = 16  # characters
LONGEST_TOKEN: Final = 1024
SEND_BUFFER: Final = 1 << 16
"""Bytes that the kernel buffers for one browser. It is small, so that a browser that stops reading is noticed."""
GONE: Final = 20_000
"""Milliseconds after which a browser that acknowledges nothing is cut off (TCP_USER_TIMEOUT)."""
SOCKET_OPTIONS: Final = (
    (socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER),
    (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, GONE),
)
BACKLOG: Final = 64


DEFAULT_LISTEN: Final = "127.0.0.1:8765"


@dataclass(frozen=True)
class HttpOptions(Options):
    """The options of the publisher `http`, and of `board`."""

    listen: Annotated[str, Option("serve a live web page, for example on 127.0.0.1:8765", "--http", "HOST:PORT")] = (
        DEFAULT_LISTEN
    )
    token_file: Annotated[
        str | None, Option("show data only to clients that send the token in FILE", "--http-token-file", "FILE")
    ] = None
    open: Annotated[bool, Option("show data to everybody who can reach HOST:PORT", "--http-open")] = False
    hosts: Annotated[tuple[str, ...], Option("further host names of the page: of a proxy or in DNS")] = ()
    alarm: Annotated[
        bool, Option("on the page, sound and mark each new error, stop and loss until it is acknowledged", "--alarm")
    ] = False


class WebSettings(NamedTuple):
    """What `serve` needs."""

    host: str = "127.0.0.1"
    port: int = 8765
    """0: the kernel picks one."""
    token: str | None = None
    """The token that clients must send; None: every client gets data."""
    names: tuple[str, ...] = ()
    """Further host names that requests may use."""
    alarm: bool = False
    """Whether the page sounds and marks each new error, stop and loss."""
    stale_after: float | None = None
    """Seconds without a line after which the page shows a vehicle as lost; None: never."""


def read(given: Mapping[str, object]) -> WebSettings:
    """The settings of a publisher's mapping. Raises UsageError for a wrong option, and for data shown to everybody."""
    options = HttpOptions.read("http", given)
    host, port = _address(options.listen)
    token = read_token(options.token_file) if options.token_file else None
    if token is None and not options.open and not is_loopback(host, port):
        raise UsageError(
            f"http: {options.listen}: others on the network can see the data: add --http-token-file FILE (token_file), "
            "or --http-open (open: true) to show it to everybody"
        )
    return WebSettings(host, port, token, options.hosts, options.alarm)


def _address(text: str) -> tuple[str, int]:
    """`HOST:PORT`, `[IPv6]:PORT`, or a port on this computer."""
    found = place(text)
    if found is None or found.port is None:
        raise UsageError(
            f"http: {short(text, 200)} is not an address to listen on; write HOST:PORT, for example {DEFAULT_LISTEN}"
        )
    return found.host or "127.0.0.1", found.port


def is_loopback(host: str, port: int) -> bool:
    """Whether only this computer can reach that address."""
    return ipaddress.ip_address(resolve("http", host, port)[1][0].partition("%")[0]).is_loopback


def read_token(path: str) -> str:
    """The token in a file that only its owner can read. Raises UsageError, which never shows the token."""
    name, data = read_secret(path, "token", LONGEST_TOKEN + 1)
    text = data.strip().decode("ascii", "replace")
    if not (SHORTEST_TOKEN <= len(text) <= LONGEST_TOKEN and all("!" <= c <= "~" for c in text)):
        raise UsageError(
            f"{name}: the token must be one line of at least {SHORTEST_TOKEN} characters without blanks: "
            f"openssl rand -hex 16 > {name}"
        )
    return text


def listen(options: WebSettings) -> socket.socket:
    """The listening socket. Raises LinkError, which names the port, if it cannot be opened."""
    return open_listener("http", options.host, options.port, SOCKET_OPTIONS, BACKLOG)
