"""Where the page is served, and to whom. By default to this computer only."""

from __future__ import annotations

import ipaddress
import os
import socket
from stat import S_IRGRP, S_IROTH, S_IWGRP, S_IWOTH
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...errors import LinkError, UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping

KEYS: Final = ("listen", "token_file", "open", "hosts")
DEFAULT_LISTEN: Final = "127.0.0.1:8765"
OF_OTHERS: Final = S_IRGRP | S_IWGRP | S_IROTH | S_IWOTH
SHORTEST_TOKEN: Final = 16  # characters
LONGEST_TOKEN: Final = 1024
SEND_BUFFER: Final = 1 << 16
"""Bytes that the kernel holds for one browser: what does not fit is noticed."""
GONE: Final = 20_000
"""Milliseconds after which a browser that acknowledges nothing is cut off (TCP_USER_TIMEOUT)."""
BACKLOG: Final = 64


class WebOptions(NamedTuple):
    """What `serve` is told."""

    host: str = "127.0.0.1"
    port: int = 8765
    """0: the kernel picks one."""
    token: str | None = None
    """Who does not show it gets no data; None: everybody does."""
    names: tuple[str, ...] = ()
    """Further host names under which browsers may ask: of a proxy, of the DNS."""
    stale_after: float | None = None
    """Seconds after which a vehicle of which no line came is greyed; None: lines need not come regularly."""


def read(options: Mapping[str, object]) -> WebOptions:
    """The options of a publisher's mapping. Raises UsageError for what is none, or would show data to everybody."""
    for key in options:
        if key not in KEYS:
            raise UsageError(f"http: unknown option '{key}'; there are {', '.join(KEYS)}")
    listen = str(options.get("listen", DEFAULT_LISTEN))
    host, port = _place(listen)
    token = read_token(str(options["token_file"])) if options.get("token_file") else None
    if token is None and options.get("open") is not True and not is_loopback(host, port):
        raise UsageError(
            f"http: {listen}: others on the network could look: add --http-token-file FILE (token_file), "
            "or --http-open (open: true) if everybody may"
        )
    names: Any = options.get("hosts", ())
    return WebOptions(host, port, token, (names,) if isinstance(names, str) else tuple(str(n) for n in names))


def _place(text: str) -> tuple[str, int]:
    """`HOST:PORT`, `[IPv6]:PORT`, or a port on this computer."""
    host, _, port = text.rpartition(":")
    bare = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not (port.isascii() and port.isdigit() and int(port) <= 65535) or (":" in bare and bare == host):
        raise UsageError(f"http: {text!r} is no place to listen; write HOST:PORT, for example {DEFAULT_LISTEN}")
    return bare or "127.0.0.1", int(port)


def _resolve(host: str, port: int) -> tuple[int, tuple[Any, ...]]:
    """Family and address. Raises LinkError for a name that nobody knows."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError):
        raise LinkError(f"http: the name {host!r} is not known") from None
    return found[0][0], found[0][4]


def is_loopback(host: str, port: int) -> bool:
    """Whether only this computer reaches that address."""
    return ipaddress.ip_address(_resolve(host, port)[1][0].partition("%")[0]).is_loopback


def read_token(path: str) -> str:
    """The token in a file, which only its owner may read. Raises UsageError, which never shows it."""
    name = os.path.expanduser(path)
    try:
        with open(name, "rb") as file:
            if os.fstat(file.fileno()).st_mode & OF_OTHERS:
                raise UsageError(f"{name}: others than its owner can read or change this token: chmod 600 {name}")
            data = file.read(LONGEST_TOKEN + 1).strip()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise UsageError(f"{name}: cannot read the token: {reason}") from None
    text = data.decode("ascii", "replace")
    if not (SHORTEST_TOKEN <= len(text) <= LONGEST_TOKEN and all("!" <= c <= "~" for c in text)):
        raise UsageError(
            f"{name}: the token is one line of {SHORTEST_TOKEN} characters or more, without blanks: "
            f"openssl rand -hex 16 > {name}"
        )
    return text


def listen(options: WebOptions) -> socket.socket:
    """The socket that listens. Raises LinkError that names the port if it is taken."""
    family, address = _resolve(options.host, options.port)
    opened = socket.socket(family, socket.SOCK_STREAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # after a restart; a taken port stays an error
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER)  # those who connect inherit both
        opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, GONE)
        opened.bind(address)
        opened.listen(BACKLOG)
    except OSError as error:
        opened.close()
        raise LinkError(f"http: cannot listen on {options.host}:{options.port}/tcp: {error.strerror}") from None
    opened.setblocking(False)
    return opened
