"""Access control: a limit on connections, checks of host names and tokens, strict response headers."""

from __future__ import annotations

import hmac
import ipaddress
import socket
from typing import TYPE_CHECKING, Final

from aiohttp import web

if TYPE_CHECKING:
    from asyncio import Protocol
    from collections.abc import Callable

    from aiohttp.typedefs import Handler, Middleware

    from .settings import WebSettings

MOST_CONNECTIONS: Final = 512
SILENT: Final = 10.0
"""Seconds within which a client must send its first request."""
GUARDED: Final = ("/api/", "/events", "/metrics")
HEADERS: Final = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}


class AccessControl:
    """The protocol factory of the server, and its middleware."""

    def __init__(self, options: WebSettings, clock: Callable[[], float]) -> None:
        here = socket.gethostname().lower()
        self._names = {"localhost", here, f"{here}.local", options.host.lower(), *(n.lower() for n in options.names)}
        self._token = options.token
        self._clock = clock
        self._server: web.Server
        self._silent: dict[object, float] = {}
        """Connections without a request so far, and when they were opened."""
        self.refused = 0

    def set_server(self, server: web.Server) -> None:
        """Set the server of these connections."""
        self._server = server

    def __call__(self) -> Protocol:
        """The protocol of a new connection."""
        handler = self._server()
        if len(self._server.connections) >= MOST_CONNECTIONS:
            self.refused += 1
            self._silent[handler] = -SILENT  # closed at the next check
        else:
            self._silent[handler] = self._clock()
        return handler

    def close_silent(self) -> None:
        """Close connections that sent no request in time."""
        now = self._clock()
        for handler in [h for h, since in self._silent.items() if now - since >= SILENT]:
            del self._silent[handler]
            assert isinstance(handler, web.RequestHandler)
            handler.force_close()

    def middleware(self) -> Middleware:
        """The checks that each request passes first."""

        @web.middleware
        async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
            self._silent.pop(request.protocol, None)
            if request.method not in ("GET", "HEAD"):
                raise web.HTTPMethodNotAllowed(request.method, ("GET", "HEAD"))
            if not self.is_known_host(request.headers.get("Host", "")):
                raise web.HTTPMisdirectedRequest(text="Unknown host name; use the IP address.\n")
            if request.path.startswith(GUARDED) and not self.has_token(request.headers.get("Authorization", "")):
                raise web.HTTPUnauthorized(text="Token required.\n", headers={"WWW-Authenticate": "Bearer"})
            return await handler(request)

        return guard

    def is_known_host(self, host: str) -> bool:
        """Whether a Host header is one of ours. This stops DNS rebinding; an address is always accepted."""
        name = host.lower()
        name = name[: name.rfind("]") + 1] if name.startswith("[") else name.partition(":")[0]
        try:
            ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            return name.rstrip(".") in self._names
        return True

    def has_token(self, authorization: str) -> bool:
        """Whether the request has the token, if one is set."""
        if self._token is None:
            return True
        kind, _, shown = authorization.partition(" ")
        right = hmac.compare_digest(shown.strip().encode("utf-8", "replace"), self._token.encode())
        return kind.lower() == "bearer" and right


async def add_headers(request: web.Request, response: web.StreamResponse) -> None:
    """Add the headers of every response."""
    response.headers.update(HEADERS)
    response.headers.setdefault("Cache-Control", "no-store")
    response.headers.pop("Server", None)
