"""`/metrics`: who asks waits until the gateway's thread has taken the values, so that none of them is old."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from aiohttp import web

from ..metrics import CONTENT_TYPE, exposition

if TYPE_CHECKING:
    from ...interface import Metrics

PATIENCE: Final = 5.0
"""Seconds to wait for a gateway that turns once a second at the least."""


class Scrapes:
    """Those who wait for metrics. Everything here happens in the server's thread, but for `wanted`."""

    def __init__(self) -> None:
        self.wanted = False
        """Whether somebody waits. The gateway's thread sets it back before it takes the values."""
        self._waiting: set[asyncio.Future[Metrics]] = set()

    async def answer(self, request: web.Request) -> web.Response:
        """One request. 503 if the gateway stands still: then no series is better than one that does not change."""
        future: asyncio.Future[Metrics] = asyncio.get_running_loop().create_future()
        self._waiting.add(future)
        self.wanted = True
        try:
            metrics = await asyncio.wait_for(future, PATIENCE)
        except asyncio.TimeoutError:
            return web.Response(status=503, text="The gateway stands still.\n")
        finally:
            self._waiting.discard(future)
        return web.Response(body=exposition(metrics).encode(), headers={"Content-Type": CONTENT_TYPE})

    def give(self, metrics: Metrics) -> None:
        """Answer all who wait."""
        for future in self._waiting:
            if not future.done():
                future.set_result(metrics)
