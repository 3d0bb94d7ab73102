"""The options of the web page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Final

from ...interface.options import Option, Options

DEFAULT_LISTEN: Final = "127.0.0.1:8765"


@dataclass(frozen=True)
class HttpOptions(Options):
    """The options of the publisher `http`, and of `board`."""

    listen: Annotated[str, Option("serve a live web page, for example on 127.0.0.1:8765", "--http", "HOST:PORT")] = (
        DEFAULT_LISTEN
    )
    token_file: Annotated[
        str | None, Option("show data only to clients that send the token in FILE", "--http-token-file", "FILE")
    ] = None
    open: Annotated[bool, Option("show data to everybody who can reach HOST:PORT", "--http-open")] = False
    hosts: Annotated[tuple[str, ...], Option("further host names of the page: of a proxy or in DNS")] = ()
    alarm: Annotated[
        bool, Option("on the page, sound and mark each new error, stop and loss until it is acknowledged", "--alarm")
    ] = False
