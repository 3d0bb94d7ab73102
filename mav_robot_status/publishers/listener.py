"""TCP ports on which outputs serve clients: `HOST:PORT` as people write it, and the listening socket."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterable
from typing import Any, Final, NamedTuple

from ..errors import LinkError

_ADDRESS: Final = re.compile(r"(?:\[(?P<v6>[0-9A-Za-z:.%-]+)\]|(?P<host>[^:\[\]\s]*))(?::(?P<port>[0-9]{1,5})?)?", re.A)
_PORT: Final = re.compile(r"[0-9]{1,5}", re.A)
LAST_PORT: Final = 65535


class Place(NamedTuple):
    """Where to listen: the parts that a text gives."""

    host: str
    """Empty if the text has none; an IPv6 address without its brackets."""
    port: int | None


def place(text: str) -> Place | None:
    """What `HOST:PORT`, `HOST`, `:PORT`, `PORT` or `[IPv6]:PORT` says; None for any other text."""
    if _PORT.fullmatch(text):
        text = f":{text}"
    found = _ADDRESS.fullmatch(text)
    if found is None or not text:
        return None
    port = int(found["port"]) if found["port"] else None
    return None if port is not None and port > LAST_PORT else Place(found["v6"] or found["host"] or "", port)


def host_port(host: str, port: int) -> str:
    """`127.0.0.1:11002`, `[::1]:11002`."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def resolve(what: str, host: str, port: int) -> tuple[int, tuple[Any, ...]]:
    """Address family and address. Raises LinkError, which names the output `what`, for a name that does not resolve."""
    try:
        found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except (OSError, UnicodeError):
        raise LinkError(f"{what}: cannot resolve the name {host!r}") from None
    return found[0][0], found[0][4]


def listen(what: str, host: str, port: int, options: Iterable[tuple[int, int, int]], backlog: int) -> socket.socket:
    """A listening, non-blocking socket. Accepted connections inherit its socket options.

    Raises LinkError, which names the port and the output `what`, if it cannot be opened.
    """
    family, address = resolve(what, host, port)
    opened = socket.socket(family, socket.SOCK_STREAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # for a restart; a port in use stays an error
        for level, option, value in options:
            opened.setsockopt(level, option, value)
        opened.bind(address)
        opened.listen(backlog)
    except OSError as error:
        opened.close()
        raise LinkError(f"{what}: cannot listen on {host_port(host, port)}/tcp: {error.strerror}") from None
    opened.setblocking(False)
    return opened
