"""Who comes in: connections counted, host names and tokens checked, strict headers on the way out."""

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

    from .options import WebOptions

MOST_CONNECTIONS: Final = 512
SILENT: Final = 10.0
"""Seconds within which who connects has to ask for something."""
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


class Door:
    """The protocol factory of the server, and its middleware."""

    def __init__(self, options: WebOptions, clock: Callable[[], float]) -> None:
        here = socket.gethostname().lower()
        self._names = {"localhost", here, f"{here}.local", options.host.lower(), *(n.lower() for n in options.names)}
        self._token = options.token
        self._clock = clock
        self._server: web.Server
        self._silent: dict[object, float] = {}
        """Connections on which nothing was asked yet, and since when."""
        self.refused = 0

    def opens_to(self, server: web.Server) -> None:
        """Whose connections these are."""
        self._server = server

    def __call__(self) -> Protocol:
        """The protocol of a new connection."""
        handler = self._server()
        if len(self._server.connections) >= MOST_CONNECTIONS:
            self.refused += 1
            self._silent[handler] = -SILENT  # out with it at the next look
        else:
            self._silent[handler] = self._clock()
        return handler

    def look(self) -> None:
        """Cut off those who have connected and ask for nothing."""
        now = self._clock()
        for handler in [h for h, since in self._silent.items() if now - since >= SILENT]:
            del self._silent[handler]
            assert isinstance(handler, web.RequestHandler)
            handler.force_close()

    def middleware(self) -> Middleware:
        """Every request passes here first."""

        @web.middleware
        async def guard(request: web.Request, handler: Handler) -> web.StreamResponse:
            self._silent.pop(request.protocol, None)
            if request.method not in ("GET", "HEAD"):
                raise web.HTTPMethodNotAllowed(request.method, ("GET", "HEAD"))
            if not self.knows(request.headers.get("Host", "")):
                raise web.HTTPMisdirectedRequest(text="This host name is not known here; ask by address.\n")
            if request.path.startswith(GUARDED) and not self.admits(request.headers.get("Authorization", "")):
                raise web.HTTPUnauthorized(text="A token is needed.\n", headers={"WWW-Authenticate": "Bearer"})
            return await handler(request)

        return guard

    def knows(self, host: str) -> bool:
        """Whether a Host header is one of ours: a name that somebody else made lead here (DNS rebinding) is not.

        An address cannot be made to lead elsewhere.
        """
        name = host.lower()
        name = name[: name.rfind("]") + 1] if name.startswith("[") else name.partition(":")[0]
        try:
            ipaddress.ip_address(name.strip("[]"))
        except ValueError:
            return name.rstrip(".") in self._names
        return True

    def admits(self, authorization: str) -> bool:
        """Whether the token is shown, if there is one."""
        if self._token is None:
            return True
        kind, _, shown = authorization.partition(" ")
        right = hmac.compare_digest(shown.strip().encode("utf-8", "replace"), self._token.encode())
        return kind.lower() == "bearer" and right


async def dress(request: web.Request, response: web.StreamResponse) -> None:
    """The headers of every response."""
    response.headers.update(HEADERS)
    response.headers.setdefault("Cache-Control", "no-store")
    response.headers.pop("Server", None)
