"""A server of a board, and its clients."""

from __future__ import annotations

import http.client
import json
import socket
import threading
from collections.abc import Callable, Iterator
from email.message import Message
from types import TracebackType
from typing import Any, NamedTuple

from mav_robot_status.clock import Instant
from mav_robot_status.clock import now as present
from mav_robot_status.interface import RobotStatusMsg
from mav_robot_status.publishers.board import Board
from mav_robot_status.publishers.web.events import Events
from mav_robot_status.publishers.web.serve import WebServer
from mav_robot_status.publishers.web.settings import WebSettings

from ....deadline import SOON, allow, wait_until


class Answer(NamedTuple):
    status: int
    headers: Message
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class Site:
    """`with Site() as site:`. The kernel picks a free port."""

    def __init__(self, clock: Callable[[], Instant] = present, **options: Any) -> None:
        self.server = WebServer(Board(), WebSettings(port=0, **options), clock)
        self.port = int(self.server.url.rpartition(":")[2].strip("/"))

    def __enter__(self) -> Site:
        self.server.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.server.close()

    def take(self, *messages: RobotStatusMsg) -> None:
        """Put statuses on the board; return when they are there."""
        done = threading.Event()

        def change(board: Board, events: Events, now: Instant) -> None:
            for message in messages:
                board.update(message, now.mono)
            done.set()

        until(lambda: self.server.post(change))
        assert done.wait(allow(SOON))

    def ask(self, path: str, method: str = "GET", **headers: str) -> Answer:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=allow(SOON))
        try:
            named = {name.replace("_", "-"): value for name, value in headers.items()}
            connection.request(method, path, headers=named)
            answer = connection.getresponse()
            return Answer(answer.status, answer.headers, answer.read())
        finally:
            connection.close()

    def listen(self, path: str = "/events") -> Listening:
        return Listening(self.port, path)


class Listening:
    """A client of the event stream. It may stop reading."""

    def __init__(self, port: int, path: str) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), allow(SOON))
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        self._file = self.socket.makefile("rb")

    def head(self) -> str:
        """The status line and the headers."""
        return b"".join(iter(self._file.readline, b"\r\n")).decode()

    def events(self) -> Iterator[tuple[str, Any]]:
        """Names and data until the stream ends."""
        name = ""
        for raw in self._file:
            line = raw.decode().rstrip("\r\n")
            if line.startswith("event: "):
                name = line[7:]
            elif line.startswith("data: "):
                yield name, json.loads(line[6:])

    def close(self) -> None:
        self._file.close()
        self.socket.close()


def until(condition: Callable[[], bool]) -> None:
    """Wait until the condition is true."""
    wait_until(condition)
