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
from .said import about, said, with_words

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ...clock import Instant
    from ...json_object import JsonMapping, JsonObject
    from ..board import Board, Entry

PULSE: Final = 0.25
"""Seconds between two checks of the board: a browser draws as often."""
TICK: Final = 1.0
"""Seconds between two events without a change. They show a browser that the server is alive."""
PATIENCE: Final = 5.0
"""Seconds after which a browser that does not read is disconnected."""
MOST_LISTENERS: Final = 256


class Listener:
    """One browser: its selected vehicle, and the data that it has."""

    __slots__ = ("abort", "busy_since", "explained", "handle", "sent_about", "sent_until", "sent_version", "turn")

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
        self.sent_about = -1
        """The version of the entry whose causes it has."""


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
        self.left_out = 0
        """Senders that the gateway does not hear, because there are too many."""
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
        board, alarms = self._board, self._board.alarms
        new = [entry for entry in board if entry.version > sent]
        told = [entry for entry in board if self._version_of(entry) > sent]  # what a group says is of its members
        data["vehicles"] = [entry.whole() for entry in new]
        data["headlines"] = {str(entry.line["handle"]): self._say(entry) for entry in told}
        if events := [one._asdict() for one in alarms.events if one.version > sent]:
            data["events"] = events
        if alarms.version > sent:
            data["pending"] = [one._asdict() for one in alarms.pending.values()]
        if turn != self._turn:
            data["beats"] = {
                handle: [entry.stamp, entry.heartbeat_age, round(now.mono - entry.at, 3)]
                for handle, entry in self._board.entries.items()
            }
        if sent < 0:
            data.update(source=socket.gethostname(), version=__version__)
            data.update(stale_after=self._stale_after, alarm=self._alarm)
        data["left_out"] = self.left_out + board.refused
        return event("board" if sent < 0 else "change", data)

    def _version_of(self, entry: Entry) -> int:
        """The version at the last change of a robot, or of a member of a group."""
        return max((one.version for one in (entry, *self._board.members(entry.line).values())), default=0)

    def _say(self, entry: Entry) -> JsonObject:
        handle = str(entry.line["handle"])
        version, words = self._said.get(handle, (-1, {}))
        newest = self._version_of(entry)
        if version != newest:
            members = {name: one.line for name, one in self._board.members(entry.line).items()}
            words = said(entry.whole(), entry.last, members)
            self._said[handle] = newest, words
            if len(self._said) > len(self._board.entries):  # some are gone
                self._said = {name: self._said[name] for name in self._board.entries if name in self._said}
        return words

    def _about(self, handle: str, entry: Entry, listener: Listener) -> Iterator[bytes]:
        instant = self._clock()
        now = instant.mono
        if listener.sent_about != entry.version:
            listener.sent_about = entry.version
            yield event("about", {"handle": handle, **about(entry.whole(), entry.last)})
        since, listener.sent_until = listener.sent_until, now
        new = [t for t in entry.transitions if since is None or t.at > since]
        if since is None or new:
            data = {
                "handle": handle,
                "whole": since is None,
                "now": rfc3339(instant.unix_us),
                "kept_since": {
                    name: rfc3339(instant.unix_us - round((now - at) * 1e6)) for name, at in entry.kept_since().items()
                },
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
