"""The event stream: what has changed on the board, to every browser that listens.

Each browser is told what changed since it was told last, so that a slow one misses what was in between, and one that
reads nothing is cut off. Those that keep up share the same bytes.
"""

from __future__ import annotations

import asyncio
import json
import socket
from typing import TYPE_CHECKING, Any, Final

from ... import __version__
from ...clock import rfc3339

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from ...clock import Instant
    from ..board import Board, Entry

PULSE: Final = 0.2
"""Seconds between two looks at the board, at the least."""
TICK: Final = 1.0
"""Seconds between two events if nothing changes, so that a browser knows that we are there."""
PATIENCE: Final = 5.0
"""Seconds for which a browser may read nothing while there is something for it."""
MOST_LISTENERS: Final = 256


class Listener:
    """One browser, what it looks at, and what it was told."""

    __slots__ = ("abort", "busy_since", "explained", "handle", "told", "told_until", "turn")

    def __init__(self, handle: str | None, abort: Callable[[], None]) -> None:
        self.handle = handle
        """The vehicle whose history and explanation it wants."""
        self.abort = abort
        self.busy_since: float | None = None
        """When the write began that has not ended."""
        self.told = -1
        """The version of the board."""
        self.turn = -1
        """The tick."""
        self.told_until: float | None = None
        """The last moment of the history."""
        self.explained: Mapping[str, Any] | None = None


class Events:
    """All listeners. Everything here happens in the server's thread."""

    def __init__(
        self,
        board: Board,
        clock: Callable[[], Instant],
        standing: Callable[[], float | None],
        stale_after: float | None = None,
    ) -> None:
        """`standing` tells for how many seconds the board's source has not turned; None if it turns."""
        self._board, self._clock, self._standing, self._stale_after = board, clock, standing, stale_after
        self._news = asyncio.Event()
        self._version, self._turn, self._ticked = -1, 0, 0.0
        self._fresh = False
        """Whether there is an explanation that was not told."""
        self._cache: dict[tuple[int, int], bytes] = {}
        self.listeners: set[Listener] = set()
        self.dropped = 0
        """Listeners that were cut off."""
        self.watched: frozenset[str] = frozenset()
        """Handles that somebody looks at. Read from other threads."""
        self.explanations: dict[str, Mapping[str, Any]] = {}

    def enter(self, listener: Listener) -> bool:
        """Take a listener in; False if there are enough."""
        if len(self.listeners) >= MOST_LISTENERS:
            return False
        self.listeners.add(listener)
        self._look_who_watches()
        return True

    def leave(self, listener: Listener) -> None:
        """Forget a listener."""
        self.listeners.discard(listener)
        self._look_who_watches()

    def explain(self, handle: str, explanation: Mapping[str, Any]) -> None:
        """The newest explanation of a handle; a new object each time."""
        if handle in self.watched:
            self.explanations[handle] = explanation
            self._fresh = True

    async def wait(self) -> None:
        """Wait for the next pulse with news."""
        await self._news.wait()

    def pulse(self) -> None:
        """To be called every PULSE: wake those who wait if there is news, cut off those who read nothing."""
        now = self._clock().mono
        for listener in self.listeners:
            if listener.busy_since is not None and now - listener.busy_since > PATIENCE:
                listener.busy_since = None
                self.dropped += 1
                listener.abort()
        if now - self._ticked >= TICK - PULSE / 2:
            self._ticked = now
            self._turn += 1
        elif self._version == self._board.version and not self._fresh:
            return
        self._version, self._fresh = self._board.version, False
        self._cache.clear()
        self._news.set()
        self._news.clear()

    def since(self, listener: Listener) -> bytes:
        """What a listener has not been told yet; empty if that is nothing."""
        board = self._board
        parts = []
        if listener.told != board.version or listener.turn != self._turn:
            key = (listener.told, listener.turn)
            if key not in self._cache:
                self._cache[key] = self._change(*key)
            parts.append(self._cache[key])
            listener.told, listener.turn = board.version, self._turn
        entry = board.entries.get(listener.handle) if listener.handle is not None else None
        if entry is not None and listener.handle is not None:
            parts.extend(self._about(listener.handle, entry, listener))
        return b"".join(parts)

    def _look_who_watches(self) -> None:
        self.watched = frozenset(one.handle for one in self.listeners if one.handle is not None)
        for handle in self.explanations.keys() - self.watched:
            del self.explanations[handle]

    def _change(self, told: int, turn: int) -> bytes:
        now = self._clock()
        data: dict[str, Any] = {"now": rfc3339(now.unix_us), "standing": self._standing()}
        data["vehicles"] = [entry.whole() for entry in self._board if entry.version > told]
        if turn != self._turn:
            data["beats"] = {
                handle: [entry.stamp, entry.heartbeat_age, round(now.mono - entry.at, 3)]
                for handle, entry in self._board.entries.items()
            }
        if told < 0:
            data.update(source=socket.gethostname(), version=__version__, stale_after=self._stale_after)
        return event("board" if told < 0 else "change", data)

    def _about(self, handle: str, entry: Entry, listener: Listener) -> Iterator[bytes]:
        now = self._clock().mono
        since, listener.told_until = listener.told_until, now
        new = [t for t in entry.transitions if since is None or t.at > since]
        if since is None or new:
            data = {
                "handle": handle,
                "whole": since is None,
                "known_for": round(now - entry.began, 3),
                "transitions": [
                    {
                        "ago": round(now - t.at, 3),
                        "stamp": t.stamp,
                        "name": t.name,
                        "value": t.value,
                        "before": t.before,
                    }
                    for t in new
                ],
            }
            yield event("history", data)
        explanation = self.explanations.get(handle)
        if explanation is not None and explanation is not listener.explained:
            listener.explained = explanation
            yield event("explanation", explanation)


def event(name: str, data: object) -> bytes:
    """One event of a text/event-stream; JSON has no line ends."""
    return f"event: {name}\ndata: {json.dumps(data, separators=(',', ':'))}\n\n".encode()
