"""The `http` publisher: hands statuses to a web server in the same process, and never waits for it."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from ...errors import UsageError
from ..board import Board
from .options import read

if TYPE_CHECKING:
    from collections.abc import Mapping

    from ...clock import Instant
    from ...interface import PublisherContext, RobotStatus, RobotStatusMsg
    from .events import Events

MOST_WAITING: Final = 10_000
"""Messages kept for a server that is not ready for more; beyond that only the last of each handle is."""
RETRY: Final = 0.05  # s until a server that is not ready for more is asked again
EXPLAIN: Final = 1.0
"""Seconds between two explanations of a vehicle that somebody looks at."""


class HttpPublisher:
    """The live board in a browser.

    Options: `listen` (HOST:PORT, 127.0.0.1:8765), `token_file`, `open`, `hosts`: see docs/web.md. Raises UsageError for
    others and if the extra is not installed, LinkError if the port is taken.
    """

    periodic = True

    check_options = staticmethod(read)

    def __init__(self, context: PublisherContext) -> None:
        options = self.check_options(context.options)
        try:
            from .scrape import Scrapes
            from .serve import serve
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("mav_robot_status"):
                raise
            raise UsageError("http: the web page needs an extra: pip install 'mav-robot-status[web]'") from None
        self._explain = context.explain
        self._waiting: list[RobotStatusMsg] = []
        self._explanations: dict[str, Mapping[str, Any]] = {}
        self._explained: dict[str, float] = {}
        """When (monotonic seconds) each vehicle that somebody looks at was explained."""
        self._statuses: dict[str, RobotStatus] = {}
        """Of those: the status that was published last."""
        self._metrics = context.metrics
        self._scrapes = Scrapes()
        self.dropped = 0
        """Messages that the server had no time for."""
        self._server = serve(Board(), options, None if self._metrics is None else self._scrapes)

    @property
    def url(self) -> str:
        """Where the page is."""
        return self._server.url

    def busy(self) -> bool:
        """Never: what the server has no time for is left out."""
        return False

    @property
    def queued(self) -> int:
        """Messages kept until the server is ready for more."""
        return len(self._waiting)

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hold it until `service`, which is called after every round of updates."""
        self._waiting.append(msg)
        if msg.handle in self._explained and self._statuses.get(msg.handle) is not msg.status:
            self._statuses[msg.handle] = msg.status
            self._explained[msg.handle] = -math.inf  # what is explained is what is shown

    def service(self, now: Instant) -> float | None:
        """Hand over; explain one vehicle that somebody looks at, if it is its turn."""
        self._server.turned = now.mono
        if self._scrapes.wanted and self._metrics is not None:
            self._scrapes.wanted = False
            self._server.give(self._metrics(now))
        again = self._explain_one(now)
        if self._waiting or self._explanations:
            if self._server.post(partial(_put, self._waiting, self._explanations)):
                self._waiting, self._explanations = [], {}
            elif len(self._waiting) > MOST_WAITING:
                latest = list({msg.handle: msg for msg in self._waiting}.values())
                self.dropped += len(self._waiting) - len(latest)
                self._waiting = latest
        return min(again, now.mono + RETRY) if self._waiting else again

    def close(self) -> None:
        """End the server."""
        self._server.close()

    def _explain_one(self, now: Instant) -> float:
        """One in a round, so that many who look cost the others no time; when the next is due."""
        watched = self._server.watched
        if not watched or self._explain is None:
            return math.inf
        last = {handle: self._explained.get(handle, -math.inf) for handle in watched}
        handle = min(last, key=last.__getitem__)
        if last[handle] + EXPLAIN <= now.mono:
            last[handle] = now.mono
            found = self._explain(handle, now)
            if found is not None:
                self._explanations[handle] = found
        self._explained = last
        self._statuses = {handle: self._statuses[handle] for handle in watched & self._statuses.keys()}
        return max(min(last.values()) + EXPLAIN, now.mono + 0.01)


def _put(
    messages: list[RobotStatusMsg],
    explanations: dict[str, Mapping[str, Any]],
    board: Board,
    events: Events,
    now: Instant,
) -> None:
    """In the server's thread."""
    for msg in messages:
        board.take(msg, now.mono)
    for handle, explanation in explanations.items():
        events.explain(handle, explanation)
