"""A kind of link as a value: `LinkKind` declares one, `Url` is one connection string that was read as that kind.

A package adds a kind with an entry point. Its name is the scheme, its value is a `LinkKind`::

    [project.entry-points."mav_robot_status.links"]
    myproto = "my_package:MYPROTO"
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from typing import NamedTuple

from mav_robot_status.errors import LinkError
from mav_robot_status.links.base import Link


class Url(NamedTuple):
    """What one connection string means."""

    kind: LinkKind
    host: str
    """Without brackets; empty for a kind without a host."""
    port: int
    device: str
    """The path of a serial device or of a log; for a kind from another package the text after the scheme."""
    baud: int
    """Bits per second; 0 unless the kind is serial."""
    text: str
    """The connection string itself."""
    senders: tuple[str, ...] = ()
    """The addresses and networks that are heard, of a kind that listens; empty: all."""

    def words(self) -> str:
        """What the link does, for the log: `listening on 127.0.0.1:14550/udp, from 10.0.0.5 only`."""
        trusted = f", from {', '.join(self.senders)} only" if self.senders else ""
        return self.kind.words.format(where=self.where(), device=self.device, baud=self.baud) + trusted

    def where(self) -> str:
        """HOST:PORT, as `host_port` writes it."""
        return host_port(self.host, self.port)


class LinkKind(NamedTuple):
    """One kind of link. The other packages of the gateway read its attributes, never its name."""

    name: str
    schemes: tuple[str, ...]
    """What may stand before the first colon of a connection string, with or without `//` after it."""
    forms: str
    """The connection strings of this kind, for the help: `udp:H:P  udpin:H:P`."""
    words: str
    """What a link does, for the log. A format string with `where` (HOST:PORT), `device` and `baud`."""
    example: str
    """A connection string."""
    description: str
    """For the help, a few words: `listen on a UDP port`."""
    opener: str | Callable[[Url], Link]
    """Opens the link, or `module:callable` to import it when a link is opened. Raises LinkError or OSError."""
    read: Callable[[LinkKind, str, str, int | None], Url] | None = None
    """Makes the Url from the kind, the whole text, the text after the scheme, and the baud rate of the command line.
    Raises UsageError. None: the text after the scheme becomes `Url.device`."""
    transport: str = ""
    """`udp`, `tcp`, `serial` or `file`, for what `doctor` examines; empty: `doctor` examines nothing."""
    listens: bool = False
    """Several peers can send to this link. Else it has one peer."""
    speaks_first: bool = False
    """The link must send first: the peer does not know its address."""
    broadcasts: bool = False
    """Sends to a broadcast address until a peer answers."""

    @property
    def is_log(self) -> bool:
        """Whether it is a file that can only be read."""
        return self.transport == "file"

    @property
    def is_serial(self) -> bool:
        """Whether it is a serial device: it has a baud rate, and the peer is usually the autopilot itself."""
        return self.transport == "serial"

    def url(self, text: str, rest: str, baud: int | None) -> Url:
        """What `text` means. `rest` is the part after the scheme. Raises UsageError."""
        if self.read is None:
            return Url(self, "", 0, rest, 0, text)
        return self.read(self, text, rest, baud)

    def open(self, url: Url) -> Link:
        """Open a link of this kind. Raises LinkError if it cannot be opened."""
        opener = self.opener
        if isinstance(opener, str):
            module, _, name = opener.partition(":")
            opener = getattr(importlib.import_module(module), name)
        try:
            link: Link = opener(url)
        except OSError as error:
            raise LinkError(f"{url.text}: {error.strerror or error}") from error
        return link


def host_port(host: str, port: int) -> str:
    """`127.0.0.1:14550`, `[::1]:14550`."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"
