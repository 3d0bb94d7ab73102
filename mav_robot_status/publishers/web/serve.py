"""`serve`: a board as a web page with a JSON API, in a separate thread."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import mimetypes
import re
import threading
from hashlib import sha256
from importlib.resources import files
from typing import TYPE_CHECKING, Final

from tornado.iostream import StreamClosedError

from ...clock import now as present
from ...language import style_sheet
from ...language.shapes import sprite
from ...version import __version__
from .access_control import AccessControl
from .connections import Connections
from .events import PULSE, Events, Listener
from .handler import Handler, Pages, Response, as_json
from .help_page import help_page
from .looks import fields_module
from .scrape import Scrapes
from .settings import WebSettings, listen

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...clock import Instant
    from ...interface import Metrics
    from ..board import Board, Entry
    from .handler import Answer

log = logging.getLogger(__name__)

STANDING: Final = 5.0
"""Seconds without a round of the event loop after which the board's source counts as stalled."""
CLOSING: Final = 2.0  # s to wait for the thread to end
SCHEMA: Final = "robot_status.schema.json"
GENERATED: Final = {"fields.js": fields_module, "tones.css": lambda: style_sheet().encode(), "help.html": help_page}
"""The files of the page that are made from tables."""


class WebServer:
    """The server of a board. It owns the board: only functions given to `post` may write to it."""

    def __init__(
        self,
        board: Board,
        options: WebSettings,
        clock: Callable[[], Instant] = present,
        scrapes: Scrapes | None = None,
    ) -> None:
        """Listen. Raises LinkError if the port is in use. `scrapes` holds the waiting requests for metrics."""
        self.board = board
        self._clock, self._scrapes = clock, scrapes
        self._stale_after, self._alarm = options.stale_after, options.alarm
        self._socket = listen(options)
        host, port = self._socket.getsockname()[:2]
        self.url = f"http://[{host}]:{port}/" if ":" in host else f"http://{host}:{port}/"
        self.turned: float | None = None
        """When (monotonic seconds) the event loop of the source last ran; None: not checked. Any thread may set it."""
        self._posted = False
        self._ready = threading.Event()
        self._loop: asyncio.AbstractEventLoop
        self._events: Events
        self._connections: Connections
        self._access = AccessControl(options)
        self._thread = threading.Thread(target=self._run, name="http", daemon=True)

    @property
    def watched(self) -> frozenset[str]:
        """Handles that browsers show in detail. They need explanations."""
        return self._events.watched

    @property
    def listeners(self) -> int:
        """How many browsers show the page."""
        return len(self._events.listeners)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()
        self._ready.wait()
        log.info("the page is at %s", self.url)

    def post(self, change: Callable[[Board, Events, Instant], None]) -> bool:
        """Run `change` in the server's thread. One other thread may call this; it returns at once.

        False if the last change is still waiting: keep the new data and post it later.
        """
        if self._posted:
            return False
        self._posted = True
        with contextlib.suppress(RuntimeError):  # closed
            self._loop.call_soon_threadsafe(self._take, change)
        return True

    def give(self, metrics: Metrics) -> None:
        """Answer the waiting requests for metrics. Any thread may call this."""
        assert self._scrapes is not None
        with contextlib.suppress(RuntimeError):  # closed
            self._loop.call_soon_threadsafe(self._scrapes.give, metrics)

    def close(self) -> None:
        """Stop the server and disconnect the browsers."""
        with contextlib.suppress(RuntimeError):  # closed before
            self._loop.call_soon_threadsafe(self._stop.set)
        self._thread.join(CLOSING)

    def standing(self) -> float | None:
        """Seconds since the event loop of the source last ran, if more than STANDING; else None."""
        seconds = 0.0 if self.turned is None else self._clock().mono - self.turned
        return round(seconds, 1) if seconds > STANDING else None

    def _take(self, change: Callable[[Board, Events, Instant], None]) -> None:
        self._posted = False
        change(self.board, self._events, self._clock())

    def _run(self) -> None:
        asyncio.run(self._serve())

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._loop.set_exception_handler(self._failed)
        self._stop = asyncio.Event()
        self._events = Events(self.board, self._clock, self.standing, self._stale_after, self._alarm)
        commands = {"/api/v1/acknowledge": self._acknowledge}
        pages = Pages(self._answers(), self._access.refusal, lambda request: self._connections.heard(request), commands)
        self._connections = Connections(self._socket, self.url, pages, lambda: self._clock().mono)
        self._connections.listen()
        self._ready.set()
        try:
            while not self._stop.is_set():
                self._events.pulse()
                self._connections.close_silent()
                with contextlib.suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self._stop.wait(), PULSE)
        finally:
            self._connections.close()

    def _failed(self, loop: asyncio.AbstractEventLoop, context: dict[str, object]) -> None:
        """Log a failure of the event loop. The end of a connection is not one, nor is a request cut off at the end."""
        if not isinstance(context.get("exception"), (OSError, asyncio.CancelledError)):
            loop.default_exception_handler(context)

    def _answers(self) -> dict[str, Answer]:
        bodies = {name: (name, body) for name, body in _assets().items()}
        bodies.update((name, (name, made())) for name, made in GENERATED.items())
        name, index = bodies.pop("index.html")
        bodies[""] = bodies["wall"] = name, index.replace(b"{{shapes}}", sprite().encode())
        bodies["schema.json"] = SCHEMA, files("mav_robot_status").joinpath(f"data/{SCHEMA}").read_bytes()
        answers = {re.escape(f"/{path}"): _asset(*body) for path, body in bodies.items()}
        answers["/healthz"] = self._healthz
        answers["/readyz"] = self._readyz
        answers["/events"] = self._stream
        if self._scrapes is not None:
            answers["/metrics"] = self._scrapes.answer
        answers["/api/v1/vehicles"] = self._vehicles
        answers["/api/v1/vehicles/(.+)"] = self._vehicle
        return answers

    async def _healthz(self, handler: Handler) -> Response:
        return as_json({"ok": True, "version": __version__})

    async def _readyz(self, handler: Handler) -> Response:
        standing = self.standing()
        body = {"ready": standing is None, "standing": standing, "vehicles": len(self.board.entries)}
        return as_json(body, status=200 if standing is None else 503)

    async def _vehicles(self, handler: Handler) -> Response:
        return as_json([entry.whole() for entry in self.board])

    async def _vehicle(self, handler: Handler) -> Response:
        entry = find(self.board, handler.path_args[0])
        if entry is None:
            return as_json({"error": "no such vehicle; /api/v1/vehicles lists them"}, status=404)
        return as_json(entry.whole())

    async def _acknowledge(self, handler: Handler) -> Response:
        """A person has seen the alarms. A page of another site cannot send this header."""
        if "X-Requested-With" not in handler.request.headers:
            return Response(b"The header X-Requested-With is missing.\n", status=403)
        self.board.acknowledge(handler.query("handle"), self._clock())
        return Response(status=204)

    async def _stream(self, handler: Handler) -> Response | None:
        listener = Listener(handler.query("handle"), handler.abort)
        if not self._events.enter(listener):
            return Response(b"Too many clients.\n", status=503, headers={"Retry-After": "10"})
        try:
            with contextlib.suppress(StreamClosedError):
                await handler.begin("text/event-stream", {"X-Accel-Buffering": "no"})
                while not self._stop.is_set() and handler.request.method != "HEAD":
                    if data := self._events.since(listener):
                        listener.busy_since = self._clock().mono
                        await handler.add(data)
                        listener.busy_since = None
                    await self._events.wait()
        finally:
            self._events.leave(listener)
        return None


def serve(board: Board, options: WebSettings, scrapes: Scrapes | None = None) -> WebServer:
    """Serve a board. Raises LinkError if the port is in use."""
    server = WebServer(board, options, scrapes=scrapes)
    server.start()
    return server


def find(board: Board, which: str) -> Entry | None:
    """Find an entry by system id (the first vehicle of several), by `system.component`, or by handle."""
    for entry in board:
        system, component = entry.line.get("system"), entry.line.get("component")
        if which == f"{system}.{component}" or (which == str(system) and not entry.line.get("members")):
            return entry
    return board.entries.get(which)


def _assets() -> dict[str, bytes]:
    folder = files(__package__).joinpath("assets")
    return {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}


def _asset(name: str, body: bytes) -> Answer:
    kind = "text/javascript" if name.endswith(".js") else mimetypes.guess_type(name)[0] or "application/octet-stream"
    kind += "; charset=utf-8" if kind.startswith("text/") else ""
    headers = {"ETag": f'"{sha256(body).hexdigest()[:16]}"', "Cache-Control": "no-cache"}

    async def answer(handler: Handler) -> Response:
        if handler.request.headers.get("If-None-Match") == headers["ETag"]:
            return Response(status=304, headers=headers)
        return Response(body, kind, headers=headers)

    return answer
