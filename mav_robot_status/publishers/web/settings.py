"""Where the page is served, and to whom. The default is this computer only."""

from __future__ import annotations

import ipaddress
import os
import socket
from stat import S_IRGRP, S_IROTH, S_IWGRP, S_IWOTH
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...errors import LinkError, UsageError
from ...interface.options import short
from .options import DEFAULT_LISTEN, HttpOptions

if TYPE_CHECKING:
    from collections.abc import Mapping

OF_OTHERS: Final = S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH
SHORTEST_TOKEN: Final = 16  # characters
LONGEST_TOKEN: Final = 1024
SEND_BUFFER: Final = 1 << 16
"""Bytes that the kernel buffers for one browser. It is small, so that a browser that stops reading is noticed."""
GONE: Final = 20_000
"""Milliseconds after which a browser that acknowledges nothing is cut off (TCP_USER_TIMEOUT)."""
BACKLOG: Final = 64


class WebSettings(NamedTuple):
    """What `serve` needs."""

    host: str = "127.0.0.1"
    port: int = 8765
    """0: the kernel picks one."""
    token: str | None = None
    """The token that clients must send; None: every client gets data."""
    names: tuple[str, ...] = ()
    """Further host names that requests may use."""
    stale_after: float | None = None
    """Seconds without a line after which the page greys a vehicle; None: never."""


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
    return WebSettings(host, port, token, options.hosts)


def _address(text: str) -> tuple[str, int]:
    """`HOST:PORT`, `[IPv6]:PORT`, or a port on this computer."""
    host, _, port = text.rpartition(":")
    bare = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not (port.isascii() and port.isdigit() and len(port) <= 5 and int(port) <= 65535) or (
        ":" in bare and bare == host
    ):
        raise UsageError(
            f"http: {short(text, 200)} is not an address to listen on; write HOST:PORT, for example {DEFAULT_LISTEN}"
        )
    return bare or "127.0.0.1", int(port)


def _resolve(host: str, port: int) -> tuple[int, tuple[Any, ...]]:
    """Address family and address. Raises LinkError for a name that does not resolve."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError):
        raise LinkError(f"http: cannot resolve the name {host!r}") from None
    return found[0][0], found[0][4]


def is_loopback(host: str, port: int) -> bool:
    """Whether only this computer can reach that address."""
    return ipaddress.ip_address(_resolve(host, port)[1][0].partition("%")[0]).is_loopback


def read_token(path: str) -> str:
    """The token in a file that only its owner can read. Raises UsageError, which never shows the token."""
    name = os.path.expanduser(path)
    try:
        with open(name, "rb") as file:
            if os.fstat(file.fileno()).st_mode & OF_OTHERS:
                raise UsageError(f"{name}: other users can read or change this token: chmod 600 {name}")
            data = file.read(LONGEST_TOKEN + 1).strip()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise UsageError(f"{name}: cannot read the token: {reason}") from None
    text = data.decode("ascii", "replace")
    if not (SHORTEST_TOKEN <= len(text) <= LONGEST_TOKEN and all("!" <= c <= "~" for c in text)):
        raise UsageError(
            f"{name}: the token must be one line of at least {SHORTEST_TOKEN} characters without blanks: "
            f"openssl rand -hex 16 > {name}"
        )
    return text


def listen(options: WebSettings) -> socket.socket:
    """The listening socket. Raises LinkError, which names the port, if it cannot be opened."""
    family, address = _resolve(options.host, options.port)
    opened = socket.socket(family, socket.SOCK_STREAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # for a restart; a port in use stays an error
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)  # accepted connections inherit both
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, GONE)
        opened.bind(address)
        opened.listen(BACKLOG)
    except OSError as error:
        opened.close()
        raise LinkError(f"http: cannot listen on {options.host}:{options.port}/tcp: {error.strerror}") from None
    opened.setblocking(False)
    return opened
