"""A server of a board, and whoever asks it."""

from __future__ import annotations

import http.client
import json
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from types import TracebackType
from typing import Any, NamedTuple

from mav_robot_status.clock import Instant
from mav_robot_status.clock import now as present
from mav_robot_status.interface import RobotStatusMsg
from mav_robot_status.publishers.board import Board
from mav_robot_status.publishers.web.events import Events
from mav_robot_status.publishers.web.options import WebOptions
from mav_robot_status.publishers.web.serve import WebServer

SOON = 8.0  # s


class Answer(NamedTuple):
    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class Site:
    """`with Site() as site:`; its port is any that is free."""

    def __init__(self, clock: Callable[[], Instant] = present, **options: Any) -> None:
        self.server = WebServer(Board(), WebOptions(port=0, **options), clock)
        self.port = int(self.server.url.rpartition(":")[2].strip("/"))

    def __enter__(self) -> Site:
        self.server.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.server.close()

    def take(self, *messages: RobotStatusMsg) -> None:
        """Put statuses on the board; they are there when this returns."""
        done = threading.Event()

        def change(board: Board, events: Events, now: Instant) -> None:
            for message in messages:
                board.take(message, now.mono)
            done.set()

        until(lambda: self.server.post(change))
        assert done.wait(SOON)

    def ask(self, path: str, method: str = "GET", **headers: str) -> Answer:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=SOON)
        try:
            named = {name.replace("_", "-"): value for name, value in headers.items()}
            connection.request(method, path, headers=named)
            answer = connection.getresponse()
            return Answer(answer.status, dict(answer.headers), answer.read())
        finally:
            connection.close()

    def listen(self, path: str = "/events") -> Listening:
        return Listening(self.port, path)


class Listening:
    """Somebody who reads the event stream; or does not."""

    def __init__(self, port: int, path: str) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), SOON)
        self.socket.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        self._file = self.socket.makefile("rb")

    def head(self) -> str:
        """The status line and the headers."""
        return b"".join(iter(self._file.readline, b"\r\n")).decode()

    def events(self) -> Iterator[tuple[str, Any]]:
        """Names and data, as long as they come."""
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


def until(condition: Callable[[], bool], seconds: float = SOON) -> None:
    """Wait until it is so."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not come about"
        time.sleep(0.005)
