"""`serve`: a board as a web page with a JSON API, in a separate thread."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import mimetypes
import threading
from hashlib import sha256
from importlib.resources import files
from typing import TYPE_CHECKING, Any, Final

from aiohttp import web

from ...clock import now as present
from ...language import style_sheet
from ...version import __version__
from .access_control import AccessControl, add_headers
from .events import PULSE, Events, Listener
from .help_page import help_page
from .looks import fields_module
from .scrape import Scrapes
from .settings import WebSettings, listen

if TYPE_CHECKING:
    from collections.abc import Callable

    from ...clock import Instant
    from ...interface import Metrics
    from ..board import Board, Entry

log = logging.getLogger(__name__)
quiet = logging.getLogger(f"{__name__}.http")
quiet.setLevel(logging.CRITICAL)  # aiohttp logs each request that is not HTTP

STANDING: Final = 5.0
"""Seconds without a round of the event loop after which the board's source counts as stalled."""
LOG_PERIOD: Final = 60.0  # s between two log lines about connections that cannot be accepted
KEEP_ALIVE: Final = 15.0  # s
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
        self._log_at = -math.inf
        self._ready = threading.Event()
        self._loop: asyncio.AbstractEventLoop
        self._events: Events
        self._access = AccessControl(options, lambda: clock().mono)
        self._thread = threading.Thread(target=self._run, name="http", daemon=True)

    @property
    def watched(self) -> frozenset[str]:
        """Handles that browsers show in detail. They need explanations."""
        return self._events.watched

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
        app = web.Application(middlewares=[self._access.middleware()])
        app.on_response_prepare.append(add_headers)
        self._add_routes(app)
        runner = web.AppRunner(
            app, access_log=None, logger=quiet, keepalive_timeout=KEEP_ALIVE, shutdown_timeout=0.1, handle_signals=False
        )
        await runner.setup()
        assert runner.server is not None
        self._access.set_server(runner.server)
        server = await self._loop.create_server(self._access, sock=self._socket)
        self._ready.set()
        try:
            while not self._stop.is_set():
                self._events.pulse()
                self._access.close_silent()
                with contextlib.suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self._stop.wait(), PULSE)
        finally:
            server.close()
            for listener in self._events.listeners:
                listener.abort()
            await runner.cleanup()

    def _failed(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Log a failure of the event loop. It reports each failed `accept` with a traceback, a hundred a second."""
        error = context.get("exception")
        if not isinstance(error, OSError):
            loop.default_exception_handler(context)
            return
        now = self._clock().mono
        if now >= self._log_at:
            self._log_at = now + LOG_PERIOD
            log.warning("%s: cannot accept another browser: %s", self.url, (error.strerror or str(error)).lower())

    def _add_routes(self, app: web.Application) -> None:
        for name, body in _assets().items():
            app.router.add_get("/" if name == "index.html" else f"/{name}", _asset(name, body))
        for name, made in GENERATED.items():
            app.router.add_get(f"/{name}", _asset(name, made()))
        app.router.add_get(
            "/schema.json", _asset(SCHEMA, files("mav_robot_status").joinpath(f"data/{SCHEMA}").read_bytes())
        )
        app.router.add_get("/healthz", self._healthz)
        app.router.add_get("/readyz", self._readyz)
        app.router.add_get("/events", self._stream)
        if self._scrapes is not None:
            app.router.add_get("/metrics", self._scrapes.answer)
        app.router.add_get("/api/v1/vehicles", self._vehicles)
        app.router.add_get("/api/v1/vehicles/{which:.+}", self._vehicle)

    async def _healthz(self, request: web.Request) -> web.Response:
        return web.json_response({"ok": True, "version": __version__})

    async def _readyz(self, request: web.Request) -> web.Response:
        standing = self.standing()
        body = {"ready": standing is None, "standing": standing, "vehicles": len(self.board.entries)}
        return web.json_response(body, status=200 if standing is None else 503)

    async def _vehicles(self, request: web.Request) -> web.Response:
        return web.json_response([entry.whole() for entry in self.board])

    async def _vehicle(self, request: web.Request) -> web.Response:
        entry = find(self.board, request.match_info["which"])
        if entry is None:
            return web.json_response({"error": "no such vehicle; /api/v1/vehicles lists them"}, status=404)
        return web.json_response(entry.whole())

    async def _stream(self, request: web.Request) -> web.StreamResponse:
        def abort() -> None:
            if request.transport is not None:
                request.transport.abort()

        listener = Listener(request.query.get("handle"), abort)
        if not self._events.enter(listener):
            return web.Response(status=503, text="Too many clients.\n", headers={"Retry-After": "10"})
        response = web.StreamResponse(headers={"Content-Type": "text/event-stream", "X-Accel-Buffering": "no"})
        try:
            with contextlib.suppress(ConnectionError):
                await response.prepare(request)
                while not self._stop.is_set():
                    if data := self._events.since(listener):
                        listener.busy_since = self._clock().mono
                        await response.write(data)
                        listener.busy_since = None
                    await self._events.wait()
        finally:
            self._events.leave(listener)
        return response


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


def _asset(name: str, body: bytes) -> Callable[[web.Request], Any]:
    kind = "text/javascript" if name.endswith(".js") else mimetypes.guess_type(name)[0] or "application/octet-stream"
    tag = f'"{sha256(body).hexdigest()[:16]}"'

    async def answer(request: web.Request) -> web.Response:
        headers = {"ETag": tag, "Cache-Control": "no-cache"}
        if request.headers.get("If-None-Match") == tag:
            return web.Response(status=304, headers=headers)
        charset = "utf-8" if kind.startswith("text/") else None
        return web.Response(body=body, content_type=kind, charset=charset, headers=headers)

    return answer
