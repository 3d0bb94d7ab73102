"""The connections of browsers: how many there are, how long they may be silent, how much they may send."""

from __future__ import annotations

import asyncio
import logging
import math
from typing import TYPE_CHECKING, Final

from tornado.http1connection import HTTP1ConnectionParameters, HTTP1ServerConnection
from tornado.httputil import HTTPServerConnectionDelegate
from tornado.iostream import IOStream

from .settings import BACKLOG

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable

    from tornado.httputil import HTTPConnection, HTTPMessageDelegate, HTTPServerRequest

log = logging.getLogger(__name__)
logging.getLogger("tornado").setLevel(logging.CRITICAL)  # it logs what strangers send

MOST_CONNECTIONS: Final = 512
SILENT: Final = 10.0
"""Seconds within which a client must send its first request."""
KEEP_ALIVE: Final = 15.0
"""Seconds within which it must send each further request."""
MOST_HEADERS: Final = 1 << 15
"""Bytes of the headers of a request."""
MOST_BODY: Final = 1 << 14
"""Bytes of the body of a request. No request needs one; it is read and dropped."""
CHUNK: Final = 1 << 14
"""Bytes that are read at a time."""
MOST_BUFFERED: Final = MOST_HEADERS + 2 * CHUNK
"""Bytes that wait for one connection. Reading stops before."""
REST: Final = 1.0
"""Seconds without another attempt after a connection cannot be accepted."""
LOG_PERIOD: Final = 60.0  # s between two log lines about this


class Connections(HTTPServerConnectionDelegate):
    """All connections. Everything here runs in the server's thread."""

    def __init__(
        self, listening: socket.socket, url: str, pages: HTTPServerConnectionDelegate, clock: Callable[[], float]
    ) -> None:
        """`pages` gets the requests. `url` is the name of the page in the log."""
        self._socket, self._url, self._pages, self._clock = listening, url, pages, clock
        self._loop = asyncio.get_running_loop()
        self._silent: dict[HTTP1ServerConnection, float] = {}
        """Connections without a request so far, and when they were opened."""
        self._log_at = -math.inf
        self.open: set[HTTP1ServerConnection] = set()
        self.refused = 0
        """Connections beyond MOST_CONNECTIONS."""

    def listen(self) -> None:
        """Accept connections from now on."""
        self._loop.add_reader(self._socket, self._accept)

    def close_silent(self) -> None:
        """Close connections that sent no request in time."""
        now = self._clock()
        for connection in [c for c, since in self._silent.items() if now - since >= SILENT]:
            connection.stream.close()

    def close(self) -> None:
        """Close the port and all connections."""
        self._loop.remove_reader(self._socket)
        self._socket.close()
        for connection in list(self.open):
            connection.stream.close()

    def heard(self, request: HTTPServerRequest) -> None:
        """A client has sent a request."""
        assert isinstance(request.server_connection, HTTP1ServerConnection)
        self._silent.pop(request.server_connection, None)

    def start_request(self, server_conn: object, request_conn: HTTPConnection) -> HTTPMessageDelegate:
        """Tornado calls this before each request."""
        return self._pages.start_request(server_conn, request_conn)

    def on_close(self, server_conn: object) -> None:
        """Tornado calls this at the end of each connection."""
        assert isinstance(server_conn, HTTP1ServerConnection)
        self.open.discard(server_conn)
        self._silent.pop(server_conn, None)

    def _accept(self) -> None:
        try:
            for _ in range(BACKLOG):
                self._serve(self._socket.accept()[0])
        except (BlockingIOError, ConnectionAbortedError):
            pass
        except OSError as error:  # no free descriptor: the client keeps waiting, and the socket stays readable
            self._loop.remove_reader(self._socket)
            self._loop.call_later(REST, self._listen_again)
            if self._clock() >= self._log_at:
                self._log_at = self._clock() + LOG_PERIOD
                reason = (error.strerror or str(error)).lower()
                log.warning("%s: cannot accept another browser: %s", self._url, reason)

    def _listen_again(self) -> None:
        if self._socket.fileno() >= 0:
            self.listen()

    def _serve(self, accepted: socket.socket) -> None:
        if len(self.open) >= MOST_CONNECTIONS:
            self.refused += 1
            accepted.close()
            return
        stream = IOStream(accepted, max_buffer_size=MOST_BUFFERED, read_chunk_size=CHUNK)
        limits = HTTP1ConnectionParameters(
            chunk_size=CHUNK,
            max_header_size=MOST_HEADERS,
            header_timeout=KEEP_ALIVE,
            max_body_size=MOST_BODY,
            body_timeout=SILENT,
        )
        connection = HTTP1ServerConnection(stream, limits)
        self.open.add(connection)
        self._silent[connection] = self._clock()
        connection.start_serving(self)
