"""Access control: checks of host names and tokens."""

from __future__ import annotations

import hmac
import ipaddress
import socket
from typing import TYPE_CHECKING, Final

from .handler import Response

if TYPE_CHECKING:
    from tornado.httputil import HTTPServerRequest

    from .settings import WebSettings

GUARDED: Final = ("/api/", "/events", "/metrics")


class AccessControl:
    """The checks that each request passes first."""

    def __init__(self, options: WebSettings) -> None:
        here = socket.gethostname().lower()
        self._names = {"localhost", here, f"{here}.local", options.host.lower(), *(n.lower() for n in options.names)}
        self._token = options.token

    def refusal(self, request: HTTPServerRequest) -> Response | None:
        """The response to a request that is refused; None if it may be answered."""
        if not self.is_known_host(request.headers.get("Host", "")):
            return Response(b"Unknown host name; use the IP address.\n", status=421)
        if request.path.startswith(GUARDED) and not self.has_token(request.headers.get("Authorization", "")):
            return Response(b"Token required.\n", status=401, headers={"WWW-Authenticate": "Bearer"})
        return None

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
