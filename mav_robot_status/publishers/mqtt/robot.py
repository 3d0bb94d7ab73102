"""One robot on the broker: its status, its events in order, and the state of its connection."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Final

from ...clock import rfc3339
from .client import Will
from .connection import Connection
from .lines import unknown

if TYPE_CHECKING:
    from paho.mqtt.client import MQTTMessage

    from ...clock import Instant
    from ..error_reporter import ErrorReporter
    from .settings import Broker
    from .spool import Event, Spool

ONLINE: Final = "ONLINE"
OFFLINE: Final = "OFFLINE"
BROKEN: Final = "CONNECTIONBROKEN"
"""The states of a connection, by their names in VDA 5050."""
WINDOW: Final = 100
"""The limit on events that the client has and the broker has not acknowledged."""


class Robot:
    """The topics of one robot. Only the loop's thread may use it."""

    def __init__(self, name: str, broker: Broker, spool: Spool, errors: ErrorReporter) -> None:
        self._topic = f"{broker.prefix}/{name}"
        self._name, self._spool = name, spool
        self._expiry = broker.keepalive * 3 // 2 + 1
        self._line = ""
        self._window: dict[int, Event] = {}
        self._unanswered: set[int] = set()
        """Other publications that the broker has not acknowledged."""
        self._handed = 0
        """The place of the last event that was handed to the client."""
        self._more = True
        """Whether the spool may hold later events."""
        ident = "mrs-" + hashlib.sha256(self._topic.encode()).hexdigest()[:16]  # every broker allows 23 characters
        will = Will(f"{self._topic}/connection", BROKEN)
        self.connection = Connection(broker, ident, will, self, errors)

    @property
    def settled(self) -> bool:
        """Whether nothing waits for the broker."""
        pending = self._window or self._more or self._unanswered or self.connection.wants_write
        return not (self.connection.open and pending)

    def publish(self, line: str) -> None:
        """Publish the newest status. It is skipped if the socket is full: the next one follows within a second."""
        self._line = line
        if self.connection.open and not self.connection.wants_write:
            self.connection.publish(f"{self._topic}/status", line, 0, True, self._expiry)

    def pump(self, news: bool = False) -> None:
        """Hand waiting events to the client while the window has room. `news` is True after a new event."""
        self._more = self._more or news
        if not self.connection.open or not self._more or len(self._window) > WINDOW // 2:
            return
        room = WINDOW - len(self._window)
        events = self._spool.after(self._name, self._handed, room)
        self._more = len(events) == room
        dropped = self._spool.dropped[self._name]
        for event in events:
            text = f'{event.text[:-1]}, "dropped": {dropped}}}'
            self._window[self.connection.publish(f"{self._topic}/events", text, 1)] = event
            self._handed = event.place

    def leave(self, now: Instant) -> None:
        """Publish an unknown status and the state OFFLINE."""
        if self.connection.open:
            if self._line:
                last = unknown(json.loads(self._line), rfc3339(now.unix_us), None)
                self._publish("status", json.dumps(last))
            self._publish("connection", OFFLINE)

    # callbacks of the connection

    def opened(self) -> None:
        """Publish the status, or clear a retained one; then the state ONLINE; then the waiting events."""
        self.lost()
        self._handed, self._more = 0, True
        self._publish("status", self._line, self._expiry)
        self._publish("connection", ONLINE)
        self.pump()

    def lost(self) -> None:
        """Forget pending publications. Events without an acknowledgement are sent again."""
        self._window.clear()
        self._unanswered.clear()

    def acknowledged(self, mid: int, refused: str | None) -> None:
        """The broker has an event. After a refusal, reconnect later and start with the first waiting event."""
        if refused is not None:
            self.connection.drop(f"it refuses publications under {self._topic}/: {refused}")
            return
        self._unanswered.discard(mid)
        event = self._window.pop(mid, None)
        if event is not None:
            self._spool.done(event)
            self.pump()

    def received(self, message: MQTTMessage) -> None:
        """Never called: a robot subscribes to no topic."""

    def _publish(self, what: str, text: str, expiry: int | None = None) -> None:
        self._unanswered.add(self.connection.publish(f"{self._topic}/{what}", text, 1, True, expiry))
