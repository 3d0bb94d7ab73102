"""One robot on the broker: its status, its events in order, and its word that it is there."""

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
    from .complaints import Complaints
    from .options import Broker
    from .spool import Event, Spool

ONLINE: Final = "ONLINE"
OFFLINE: Final = "OFFLINE"
BROKEN: Final = "CONNECTIONBROKEN"
"""The states of a connection, as VDA 5050 calls them."""
WINDOW: Final = 100
"""Events handed to the client that the broker has not acknowledged."""


class Robot:
    """What one robot says. Of the loop's thread."""

    def __init__(self, name: str, broker: Broker, spool: Spool, complaints: Complaints) -> None:
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
        """Whether the spool may hold more than that."""
        ident = "mrs-" + hashlib.sha256(self._topic.encode()).hexdigest()[:16]  # 23 characters are always allowed
        will = Will(f"{self._topic}/connection", BROKEN)
        self.connection = Connection(broker, ident, will, self, complaints)

    @property
    def settled(self) -> bool:
        """Whether nothing is on its way any more."""
        on_its_way = self._window or self._more or self._unanswered or self.connection.wants_write
        return not (self.connection.open and on_its_way)

    def tell(self, line: str) -> None:
        """The newest status. Where the line is full it is left out: in a second there is another."""
        self._line = line
        if self.connection.open and not self.connection.wants_write:
            self.connection.publish(f"{self._topic}/status", line, 0, True, self._expiry)

    def pump(self, news: bool = False) -> None:
        """Hand waiting events to the client, as many as the window takes. `news`: there is a new one."""
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
        """Say that nothing is known from now on, and that this is meant so."""
        if self.connection.open:
            if self._line:
                last = unknown(json.loads(self._line), rfc3339(now.unix_us), None)
                self._publish("status", json.dumps(last))
            self._publish("connection", OFFLINE)

    # what the connection tells

    def opened(self) -> None:
        """First what is so, or that nothing is known; then that we are there; then what waits."""
        self.lost()
        self._handed, self._more = 0, True
        self._publish("status", self._line, self._expiry)
        self._publish("connection", ONLINE)
        self.pump()

    def lost(self) -> None:
        """What was not acknowledged will be handed over again."""
        self._window.clear()
        self._unanswered.clear()

    def acknowledged(self, mid: int, refused: str | None) -> None:
        """An event is the broker's, or nothing is: then again later, from the first that waits."""
        if refused is not None:
            self.connection.drop(f"it does not let us publish under {self._topic}/: {refused}")
            return
        self._unanswered.discard(mid)
        event = self._window.pop(mid, None)
        if event is not None:
            self._spool.done(event)
            self.pump()

    def received(self, message: MQTTMessage) -> None:
        """Nothing was subscribed to."""

    def _publish(self, what: str, text: str, expiry: int | None = None) -> None:
        self._unanswered.add(self.connection.publish(f"{self._topic}/{what}", text, 1, True, expiry))
