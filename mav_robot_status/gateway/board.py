"""The command `board`: shows all robots of an MQTT broker on the web page. It stores nothing, so several may run."""

from __future__ import annotations

import logging
import math
import secrets
import signal
from functools import partial
from typing import TYPE_CHECKING, Final

from ..clock import now as present
from ..publishers.board import Board
from ..publishers.error_reporter import ErrorReporter
from ..publishers.mqtt.connection import Connection
from ..publishers.mqtt.fleet import Fleet
from ..publishers.mqtt.loop import Loop
from ..publishers.web.serve import serve

if TYPE_CHECKING:
    from collections.abc import Mapping

    from paho.mqtt.client import MQTTMessage

    from ..clock import Instant
    from ..json_object import JsonMapping
    from ..publishers.mqtt.settings import Broker
    from ..publishers.web.events import Events
    from ..publishers.web.settings import WebSettings

    Line = tuple[JsonMapping, JsonMapping | None]
    """A line, and the last one with a connected link."""

log = logging.getLogger(__name__)

HAND_OVER: Final = 0.1  # s between two hand-overs to the web server
EXPIRE: Final = 0.5  # s between two searches for expired robots
MISSING_PERIOD: Final = 60.0  # s between two log lines about missing events
PAUSE: Final = 2.0  # s between two looks after which what waits may be old
SILENCE: Final = 5.0  # s without a message of any robot until a log line


class FleetBoard:
    """A subscriber that feeds a web page."""

    def __init__(self, broker: Broker, options: WebSettings) -> None:
        """Listen for browsers. Raises LinkError if the port is taken."""
        self._prefix = broker.prefix
        self._fleet = Fleet(broker.prefix, broker.keepalive)
        self._server = serve(Board(), options._replace(stale_after=float(broker.keepalive)))
        self._loop = Loop(present)
        ident = f"mrs-board-{secrets.token_hex(6)}"
        self._connection = Connection(broker, ident, None, self, ErrorReporter("mqtt", broker.name))
        self._loop.add(self._connection)
        self._waiting: dict[str, Line] = {}
        self._stop = self._old = False
        """Whether to stop; whether what arrives on this connection may be old."""
        self._looked_at = math.inf
        """When (monotonic seconds) messages were last read, or could have been."""
        self._missing_logged_at, self._missing_logged = -MISSING_PERIOD, 0
        self._subscribed = False
        self._silent_at = math.inf
        """When to log that nothing was received. -inf: something was received, or it is logged."""

    def stop_on_signals(self) -> None:
        """Stop on SIGINT and SIGTERM. Only in the main thread."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self.stop())

    def stop(self) -> None:
        """Make `run` return soon."""
        self._stop = True
        self._loop.wake()

    def run(self) -> None:
        """Run until `stop`."""
        expired_at = handed_at = 0.0
        try:
            while not self._stop:
                self._looked_at = present().mono
                self._loop.turn(HAND_OVER if self._waiting else EXPIRE)
                now = present()
                if now.mono - expired_at >= EXPIRE:
                    expired_at = now.mono
                    self._fleet.expire(now)
                    self._log_missing(now.mono)
                if self._subscribed:
                    self._server.turned = now.mono  # without this the page reports that the data is stale
                if now.mono - handed_at >= HAND_OVER:
                    handed_at = now.mono
                    self._hand_over()
        finally:
            fleet = self._fleet
            log.info("%d events, %d duplicates, %d missing", fleet.events, fleet.duplicates, fleet.missing)
            self._connection.close()
            self._loop.close()
            self._server.close()

    # callbacks of the connection

    def opened(self) -> None:
        """Subscribe to all topics below the prefix."""
        self._old = False
        self._fleet.begin()
        self._connection.subscribe(self._fleet.topics())

    def lost(self) -> None:
        """The connection is lost; the page keeps the old data."""
        self._subscribed = False

    def acknowledged(self, mid: int, refused: str | None) -> None:
        """The broker has accepted or refused the subscription."""
        if refused is not None:
            self._connection.drop(f"it refuses a subscription to {self._prefix}/+/...: {refused}")
        else:
            self._subscribed = True
            if self._silent_at == math.inf:
                self._silent_at = present().mono + SILENCE
            log.info("reading %s/+", self._prefix)

    def received(self, message: MQTTMessage) -> None:
        """A message below the prefix, of a gateway or of another client."""
        self._silent_at = -math.inf
        now = present()
        if now.mono - self._looked_at > PAUSE and not self._old:
            # this program was stopped: nobody knows how long what arrives now has waited
            self._old = True
            self._fleet.doubt(now)
            self._connection.drop("this program was stopped, so what waits may be old")
        self._looked_at = now.mono
        if not self._old:
            self._fleet.take(message.topic, bytes(message.payload), message.retain, now)

    def _hand_over(self) -> None:
        self._waiting.update((name, (line, self._fleet.last(name))) for name, line in self._fleet.news().items())
        if self._waiting and self._server.post(partial(_put, self._waiting)):
            self._waiting = {}

    def _log_missing(self, now: float) -> None:
        if self._subscribed and -math.inf < self._silent_at <= now:
            self._silent_at = -math.inf
            what = "no gateway publishes there, or the broker denies reading"
            log.warning("no message below %s/ so far: %s", self._prefix, what)
        if self._fleet.missing > self._missing_logged and now - self._missing_logged_at >= MISSING_PERIOD:
            self._missing_logged, self._missing_logged_at = self._fleet.missing, now
            events = self._fleet.events + self._missing_logged
            log.warning("%d of %d events are missing", self._missing_logged, events)


def _put(lines: Mapping[str, Line], board: Board, events: Events, now: Instant) -> None:
    """In the server's thread."""
    for name, (line, last) in lines.items():
        board.update_line(name, line, now.mono, last)
