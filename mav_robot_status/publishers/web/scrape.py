"""`/metrics`: a request waits until the gateway's thread reads the values, so that all of them are current."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from ..metrics import CONTENT_TYPE, exposition
from .handler import Response

if TYPE_CHECKING:
    from ...interface import Metrics
    from .handler import Handler

PATIENCE: Final = 5.0
"""Seconds to wait. The event loop runs at least once a second."""


class Scrapes:
    """The requests that wait. Everything but `wanted` runs in the server's thread."""

    def __init__(self) -> None:
        self.wanted = False
        """Whether a request waits. The gateway's thread clears it before it reads the values."""
        self._waiting: set[asyncio.Future[Metrics]] = set()

    async def answer(self, handler: Handler) -> Response:
        """Answer one request. 503 if the gateway is stalled: a missing series is better than a frozen one."""
        future: asyncio.Future[Metrics] = asyncio.get_running_loop().create_future()
        self._waiting.add(future)
        self.wanted = True
        try:
            metrics = await asyncio.wait_for(future, PATIENCE)
        except asyncio.TimeoutError:
            return Response(b"The gateway is stalled.\n", status=503)
        finally:
            self._waiting.discard(future)
        return Response(exposition(metrics).encode(), CONTENT_TYPE)

    def give(self, metrics: Metrics) -> None:
        """Answer all waiting requests."""
        for future in self._waiting:
            if not future.done():
                future.set_result(metrics)
