"""The `http` publisher: hands statuses to a web server in the same process and never waits for it."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Final

from ...errors import UsageError
from ...extras import install
from ..board import Board
from .settings import HttpOptions, read

if TYPE_CHECKING:
    from ...clock import Instant
    from ...interface import PublisherContext, RobotStatus, RobotStatusMsg
    from ...json_object import JsonMapping
    from .events import Events

MOST_WAITING: Final = 10_000
"""Messages kept for a busy server. Beyond that, only the last of each handle is kept."""
RETRY: Final = 0.05  # s until the next attempt after the server was busy
COUNT: Final = 2.0
"""Seconds between two counts of the senders that are not heard."""
EXPLAIN: Final = 1.0
"""Seconds between two explanations of a vehicle that a browser shows in detail."""


class HttpPublisher:
    """The live board in a browser.

    Raises UsageError for a wrong option and if the extra `web` is not installed, LinkError if the port is in use.
    """

    periodic = True
    live_only = True

    options_type = HttpOptions
    check_options = staticmethod(read)
    listens_on = staticmethod(lambda given: read(given)[:2])

    def __init__(self, context: PublisherContext) -> None:
        options = self.check_options(context.options)
        try:
            from .scrape import Scrapes
            from .serve import serve
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("mav_robot_status"):
                raise
            raise UsageError(f"http: the web page needs an extra: {install('web')}") from None
        self._explain = context.explain
        self._waiting: list[RobotStatusMsg] = []
        self._gone: list[str] = []
        """Handles that the server has to remove."""
        self._explanations: dict[str, JsonMapping] = {}
        self._explained: dict[str, float] = {}
        """When (monotonic seconds) each vehicle that a browser shows was explained."""
        self._statuses: dict[str, RobotStatus] = {}
        """The last status of each of these vehicles."""
        self._metrics = context.metrics
        self._scrapes = Scrapes()
        self._counted, self._left_out, self._told_left_out = -math.inf, 0, 0
        self.dropped = 0
        """Messages left out because the server was busy."""
        self._server = serve(Board(), options, None if self._metrics is None else self._scrapes)

    @property
    def url(self) -> str:
        """The address of the page."""
        return self._server.url

    def busy(self) -> bool:
        """Never. Messages for a busy server are left out."""
        return False

    @property
    def queued(self) -> int:
        """Messages that wait for the server."""
        return len(self._waiting)

    def publish(self, msg: RobotStatusMsg) -> None:
        """Hold the message until `service`, which follows every round of updates."""
        self._waiting.append(msg)
        if msg.handle in self._explained and self._statuses.get(msg.handle) is not msg.status:
            self._statuses[msg.handle] = msg.status
            self._explained[msg.handle] = -math.inf  # the explanation must match the shown status

    def service(self, now: Instant) -> float | None:
        """Hand messages to the server; explain one of the vehicles that browsers show, if it is due."""
        self._server.turned = now.mono
        if self._scrapes.wanted and self._metrics is not None:
            self._scrapes.wanted = False
            self._server.give(self._metrics(now))
        again = self._explain_one(now)
        if self._metrics is not None and self._server.listeners and now.mono >= self._counted + COUNT:
            self._counted = now.mono
            self._left_out = sum(one.left_out for one in self._metrics(now).connections)
        if self._waiting or self._explanations or self._gone or self._left_out != self._told_left_out:
            if self._server.post(partial(_put, self._waiting, self._explanations, self._gone, self._left_out)):
                self._waiting, self._explanations, self._gone = [], {}, []
                self._told_left_out = self._left_out
            elif len(self._waiting) > MOST_WAITING:
                latest = list({msg.handle: msg for msg in self._waiting}.values())
                self.dropped += len(self._waiting) - len(latest)
                self._waiting = latest
        return min(again, now.mono + RETRY) if self._waiting or self._gone else again

    def forget(self, handle: str) -> None:
        """Remove a handle that is gone from the page. The next message of a new handle of that name adds it again."""
        self._waiting = [msg for msg in self._waiting if msg.handle != handle]
        self._gone.append(handle)

    def close(self) -> None:
        """Stop the server."""
        self._server.close()

    def _explain_one(self, now: Instant) -> float:
        """Explain at most one vehicle, so that many browsers do not delay the gateway; return when the next is due."""
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
    explanations: dict[str, JsonMapping],
    gone: list[str],
    left_out: int,
    board: Board,
    events: Events,
    now: Instant,
) -> None:
    """Runs in the server's thread."""
    events.left_out = left_out
    for handle in gone:
        board.forget(handle)
    for msg in messages:
        board.update(msg, now.mono)
    for handle, explanation in explanations.items():
        events.explain(handle, explanation)
