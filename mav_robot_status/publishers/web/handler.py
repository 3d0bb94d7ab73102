"""Requests and responses: the routes, what every request passes, and what every response has."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any, Final, NamedTuple
from urllib.parse import quote, unquote

from tornado.http1connection import HTTP1ServerConnection
from tornado.web import Application, RequestHandler, stream_request_body

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Mapping

    from tornado.httputil import HTTPServerRequest

    Answer = Callable[["Handler"], Awaitable["Response | None"]]
    """Answers a request. None: it has sent the response itself."""
    Check = Callable[[HTTPServerRequest], "Response | None"]

TEXT: Final = "text/plain; charset=utf-8"
JSON: Final = "application/json; charset=utf-8"
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
    "Cache-Control": "no-store",
}
"""The headers of every response. A response may replace one."""
_TARGET: Final = re.compile(r"(?:https?://[^/?#]*)?([^?#]*)")


class Response(NamedTuple):
    """A whole response."""

    body: bytes = b""
    kind: str = TEXT
    status: int = 200
    headers: Mapping[str, str] = {}


def as_json(value: object, status: int = 200) -> Response:
    """A value as a response."""
    return Response(json.dumps(value).encode(), JSON, status)


class Pages(Application):
    """The routes. A path is a regular expression."""

    def __init__(
        self,
        answers: Mapping[str, Answer],
        check: Check,
        heard: Callable[[HTTPServerRequest], None],
        commands: Mapping[str, Answer],
    ) -> None:
        """`check` may refuse a request; `heard` is called for every request. `commands` answer the method POST."""
        common = {"check": check, "heard": heard}
        posted = {"methods": ("POST",), **common}
        super().__init__(
            [
                *((path, Handler, {**common, "answer": answer}) for path, answer in answers.items()),
                *((path, Handler, {**posted, "answer": answer}) for path, answer in commands.items()),
            ],
            default_handler_class=Handler,
            default_handler_args={**common, "answer": _not_found},
            log_function=lambda handler: None,
        )

    def find_handler(self, request: HTTPServerRequest, **kwargs: object) -> Any:
        """The handler of a request. Each path has one spelling, for the routes and for the checks."""
        target = _TARGET.match(request.uri or "")
        request.path = quote(unquote(target[1])) if target else ""
        return super().find_handler(request, **kwargs)


@stream_request_body  # so that a method is refused before its body is read
class Handler(RequestHandler):
    """One request, and its response."""

    def initialize(
        self,
        check: Check,
        heard: Callable[[HTTPServerRequest], None],
        answer: Answer,
        methods: tuple[str, ...] = ("GET", "HEAD"),
    ) -> None:
        """Tornado calls this with the headers of the request."""
        self.SUPPORTED_METHODS = methods
        self._check, self._answer = check, answer
        heard(self.request)

    def set_default_headers(self) -> None:
        """The headers of every response."""
        self.clear_header("Server")
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def data_received(self, chunk: bytes) -> None:
        """Drop a part of the body."""

    async def get(self, *_: str) -> None:
        """Answer."""
        response = self._check(self.request) or await self._answer(self)
        if response is not None:
            self._send(response)

    head = post = get

    def write_error(self, status_code: int, **_: object) -> None:
        """Send the text of an error. A body is not read after it, so the connection ends."""
        allow = {"Allow": ",".join(self.SUPPORTED_METHODS)} if status_code == 405 else {}
        body = f"{status_code}: {self._reason}".encode()
        self._send(Response(body, status=status_code, headers={"Connection": "close", **allow}))

    def compute_etag(self) -> None:
        """None: only files have tags."""

    def query(self, name: str) -> str | None:
        """The first value of that name in the query."""
        return next((value.decode("utf-8", "replace") for value in self.request.query_arguments.get(name, ())), None)

    def begin(self, kind: str, headers: Mapping[str, str]) -> Awaitable[None]:
        """Send the headers of a response that stays open."""
        self._describe(Response(kind=kind, headers=headers))
        self._connection.stream.set_nodelay(True)
        return self.flush()

    def add(self, data: bytes) -> Awaitable[None]:
        """Send more of it. Done when the kernel has all; raises StreamClosedError if the connection is closed."""
        assert self.request.connection is not None
        return self.request.connection.write(data)  # `write` and `flush` of the handler copy, and take as long again

    def abort(self) -> None:
        """Close the connection."""
        self._connection.stream.close()

    @property
    def _connection(self) -> HTTP1ServerConnection:
        assert isinstance(self.request.server_connection, HTTP1ServerConnection)
        return self.request.server_connection

    def _describe(self, response: Response) -> None:
        self.set_status(response.status)
        self.set_header("Content-Type", response.kind)
        for name, value in response.headers.items():
            self.set_header(name, value)

    def _send(self, response: Response) -> None:
        self._describe(response)
        self.finish(response.body or None)


async def _not_found(handler: Handler) -> Response:
    return Response(b"404: Not Found", status=404)
