"""The event stream: the changes of the board, sent to each browser.

Each browser gets the changes since its last event. A slow browser misses the states between; a browser that stops
reading is disconnected. Browsers that keep up share the same bytes.
"""

from __future__ import annotations

import asyncio
import json
import socket
from typing import TYPE_CHECKING, Final

from ...clock import rfc3339
from ...version import __version__
from .said import said, with_words

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ...clock import Instant
    from ...json_object import JsonMapping, JsonObject
    from ..board import Board, Entry

PULSE: Final = 0.2
"""Seconds between two checks of the board."""
TICK: Final = 1.0
"""Seconds between two events without a change. They show a browser that the server is alive."""
PATIENCE: Final = 5.0
"""Seconds after which a browser that does not read is disconnected."""
MOST_LISTENERS: Final = 256


class Listener:
    """One browser: its selected vehicle, and the data that it has."""

    __slots__ = ("abort", "busy_since", "explained", "handle", "sent_until", "sent_version", "turn")

    def __init__(self, handle: str | None, abort: Callable[[], None]) -> None:
        self.handle = handle
        """The handle of the vehicle that it shows in detail."""
        self.abort = abort
        self.busy_since: float | None = None
        """When the pending write began; None: nothing is pending."""
        self.sent_version = -1
        """The version of the board that it has."""
        self.turn = -1
        """The last tick that it has."""
        self.sent_until: float | None = None
        """The end of the history that it has."""
        self.explained: JsonMapping | None = None


class Events:
    """All listeners. Everything here runs in the server's thread."""

    def __init__(
        self,
        board: Board,
        clock: Callable[[], Instant],
        standing: Callable[[], float | None],
        stale_after: float | None = None,
        alarm: bool = False,
    ) -> None:
        """`standing` returns for how many seconds the board's source has been stalled; None while it runs."""
        self._board, self._clock, self._standing = board, clock, standing
        self._stale_after, self._alarm = stale_after, alarm
        self._said: dict[str, tuple[int, JsonObject]] = {}
        """What the page says of each handle, with the version of its entry. Made only while a browser needs it."""
        self._news = asyncio.Event()
        self._version, self._turn, self._ticked = -1, 0, 0.0
        self._fresh = False
        """Whether there is a new explanation."""
        self._cache: dict[tuple[int, int, int, int], bytes] = {}
        """Events that several listeners get: what they have, and what the board has. Emptied in each pulse."""
        self.listeners: set[Listener] = set()
        self.dropped = 0
        """Listeners that were disconnected."""
        self.watched: frozenset[str] = frozenset()
        """Handles that browsers show in detail. Other threads read this."""
        self.explanations: dict[str, JsonMapping] = {}

    def enter(self, listener: Listener) -> bool:
        """Add a listener; False if there are MOST_LISTENERS already."""
        if len(self.listeners) >= MOST_LISTENERS:
            return False
        self.listeners.add(listener)
        self._update_watched()
        return True

    def leave(self, listener: Listener) -> None:
        """Remove a listener."""
        self.listeners.discard(listener)
        self._update_watched()

    def explain(self, handle: str, explanation: JsonMapping) -> None:
        """The newest explanation of a handle; a new object each time."""
        if handle in self.watched:
            self.explanations[handle] = explanation
            self._fresh = True

    async def wait(self) -> None:
        """Wait for the next pulse with a change."""
        await self._news.wait()

    def pulse(self) -> None:
        """Call this every PULSE. It wakes the listeners after a change and disconnects those that do not read."""
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
        """The events that a listener does not have; empty if it has all."""
        board = self._board
        parts = []
        if listener.sent_version != board.version or listener.turn != self._turn:
            # the board may change between two listeners that come in one pulse
            key = (listener.sent_version, listener.turn, board.version, self._turn)
            if key not in self._cache:
                self._cache[key] = self._change(listener.sent_version, listener.turn)
            parts.append(self._cache[key])
            listener.sent_version, listener.turn = board.version, self._turn
        entry = board.entries.get(listener.handle) if listener.handle is not None else None
        if entry is not None and listener.handle is not None:
            parts.extend(self._about(listener.handle, entry, listener))
        return b"".join(parts)

    def _update_watched(self) -> None:
        self.watched = frozenset(one.handle for one in self.listeners if one.handle is not None)
        for handle in self.explanations.keys() - self.watched:
            del self.explanations[handle]

    def _change(self, sent: int, turn: int) -> bytes:
        now = self._clock()
        data: JsonObject = {"now": rfc3339(now.unix_us), "standing": self._standing()}
        new = [entry for entry in self._board if entry.version > sent]
        data["vehicles"] = [entry.whole() for entry in new]
        data["headlines"] = {str(entry.line["handle"]): self._say(entry) for entry in new}
        if turn != self._turn:
            data["beats"] = {
                handle: [entry.stamp, entry.heartbeat_age, round(now.mono - entry.at, 3)]
                for handle, entry in self._board.entries.items()
            }
        if sent < 0:
            data.update(source=socket.gethostname(), version=__version__)
            data.update(stale_after=self._stale_after, alarm=self._alarm)
        return event("board" if sent < 0 else "change", data)

    def _say(self, entry: Entry) -> JsonObject:
        handle = str(entry.line["handle"])
        version, words = self._said.get(handle, (-1, {}))
        if version != entry.version:
            words = said(entry.whole(), entry.last)
            self._said[handle] = entry.version, words
            if len(self._said) > len(self._board.entries):  # some are gone
                self._said = {name: self._said[name] for name in self._board.entries if name in self._said}
        return words

    def _about(self, handle: str, entry: Entry, listener: Listener) -> Iterator[bytes]:
        now = self._clock().mono
        since, listener.sent_until = listener.sent_until, now
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
                        "value": with_words(t.value),
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
