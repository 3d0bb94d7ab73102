"""The command `board`: all robots of an MQTT broker on the web page. It keeps nothing: there may be any number."""

from __future__ import annotations

import logging
import math
import secrets
import signal
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from ..clock import now as present
from ..publishers.board import Board
from ..publishers.mqtt.complaints import Complaints
from ..publishers.mqtt.connection import Connection
from ..publishers.mqtt.fleet import Fleet
from ..publishers.mqtt.loop import Loop
from ..publishers.web.serve import serve

if TYPE_CHECKING:
    from collections.abc import Mapping

    from paho.mqtt.client import MQTTMessage

    from ..clock import Instant
    from ..publishers.mqtt.options import Broker
    from ..publishers.web.events import Events
    from ..publishers.web.options import WebOptions

log = logging.getLogger(__name__)

HAND_OVER: Final = 0.1  # s between two hand-overs to the web server
EXPIRE: Final = 0.5  # s between two looks for what does not renew itself
TELL: Final = 60.0  # s between two lines about events that did not come
SILENCE: Final = 5.0  # s without a word from any robot until the log says so


class FleetBoard:
    """A subscriber that feeds a web page."""

    def __init__(self, broker: Broker, options: WebOptions) -> None:
        """Listen for browsers. Raises LinkError if the port is taken."""
        self._prefix = broker.prefix
        self._fleet = Fleet(broker.prefix, broker.keepalive)
        self._server = serve(Board(), options._replace(stale_after=float(broker.keepalive)))
        self._loop = Loop(present)
        ident = f"mrs-board-{secrets.token_hex(6)}"
        self._connection = Connection(broker, ident, None, self, Complaints(broker))
        self._loop.add(self._connection)
        self._waiting: dict[str, Mapping[str, Any]] = {}
        self._stop = False
        self._told_at, self._told = -TELL, 0
        self._subscribed = False
        self._silent_at = math.inf
        """When it is to be told that nothing came yet; never once something came."""

    def stop_on_signals(self) -> None:
        """SIGINT and SIGTERM end it. Only in the main thread."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self.stop())

    def stop(self) -> None:
        """Make `run` return soon."""
        self._stop = True
        self._loop.wake()

    def run(self) -> None:
        """Turn until `stop`."""
        expired_at = handed_at = 0.0
        try:
            while not self._stop:
                self._loop.turn(HAND_OVER if self._waiting else EXPIRE)
                now = present()
                if now.mono - expired_at >= EXPIRE:
                    expired_at = now.mono
                    self._fleet.expire(now)
                    self._tell(now.mono)
                if self._subscribed:
                    self._server.turned = now.mono  # else the page says that nothing comes
                if now.mono - handed_at >= HAND_OVER:
                    handed_at = now.mono
                    self._hand_over()
        finally:
            fleet = self._fleet
            log.info("%d events, %d again, %d missing", fleet.events, fleet.duplicates, fleet.missing)
            self._connection.close()
            self._loop.close()
            self._server.close()

    # what the connection tells

    def opened(self) -> None:
        """Ask for everything below the prefix."""
        self._fleet.begin()
        self._connection.subscribe(self._fleet.topics())

    def lost(self) -> None:
        """What is shown ages from now on."""
        self._subscribed = False

    def acknowledged(self, mid: int, refused: str | None) -> None:
        """What was asked for comes, or may not be read."""
        if refused is not None:
            self._connection.drop(f"it does not let us read {self._prefix}/+/...: {refused}")
        else:
            self._subscribed = True
            if self._silent_at == math.inf:
                self._silent_at = present().mono + SILENCE
            log.info("reading %s/+", self._prefix)

    def received(self, message: MQTTMessage) -> None:
        """A publication of a gateway, or of anybody."""
        self._silent_at = -math.inf
        self._fleet.take(message.topic, bytes(message.payload), message.retain, present())

    def _hand_over(self) -> None:
        self._waiting.update(self._fleet.news())
        if self._waiting and self._server.post(partial(_put, self._waiting)):
            self._waiting = {}

    def _tell(self, now: float) -> None:
        if self._subscribed and -math.inf < self._silent_at <= now:
            self._silent_at = -math.inf
            log.warning("nothing below %s/ so far: is no gateway there, or may we not read it?", self._prefix)
        if self._fleet.missing > self._told and now - self._told_at >= TELL:
            self._told, self._told_at = self._fleet.missing, now
            log.warning("%d events of %d did not come", self._told, self._fleet.events + self._told)


def _put(lines: Mapping[str, Mapping[str, Any]], board: Board, events: Events, now: Instant) -> None:
    """In the server's thread."""
    for name, line in lines.items():
        board.take_line(name, line, now.mono)
