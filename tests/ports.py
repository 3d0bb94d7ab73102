"""Free ports for servers that a test starts later, or starts again."""

from __future__ import annotations

import contextlib
import random
import socket

FIRST, LAST = 20_000, 30_000
"""Below the range from which the system gives ports to clients. In that range any client may take the port first, even
a client that tries to connect to it."""


def free_port(kind: socket.SocketKind | None = None) -> int:
    """A port that nobody uses on any address; of both kinds without a `kind`."""
    kinds = (socket.SOCK_STREAM, socket.SOCK_DGRAM) if kind is None else (kind,)
    while True:
        number = random.randrange(FIRST, LAST)
        with contextlib.ExitStack() as opened, contextlib.suppress(OSError):
            for one in kinds:
                opened.enter_context(socket.socket(socket.AF_INET, one)).bind(("0.0.0.0", number))
            return number
