"""One MQTT connection. A helper thread opens it, and opens it again after a loss. Each failure has a reason."""

from __future__ import annotations

import random
import ssl
from collections.abc import Callable
from typing import Any, Final, Protocol

from paho.mqtt.client import MQTT_ERR_SUCCESS, Client, MQTTMessage
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties
from paho.mqtt.reasoncodes import ReasonCode

from ..error_reporter import ErrorReporter
from .client import Will, dial, lost, make, refusal, shut, words
from .settings import Broker

FIRST_WAIT, LONGEST_WAIT = 1.0, 30.0  # s between two attempts; doubled each time, with jitter
STEADY: Final = 10.0  # s after which a connection counts as steady and the wait is reset
ANSWER: Final = 10.0  # s for a broker to answer
MOST_AT_ONCE: Final = 200  # packets read before the next connection is served


class Owner(Protocol):
    """The callbacks of a connection. All of them run in the loop's thread."""

    def opened(self) -> None:
        """The broker has accepted the connection."""

    def lost(self) -> None:
        """The connection is lost. Publications without an acknowledgement are not delivered."""

    def acknowledged(self, mid: int, refused: str | None) -> None:
        """The broker has acknowledged a publication or a subscription. `refused` is the reason of a refusal."""

    def received(self, message: MQTTMessage) -> None:
        """A message of a subscribed topic has arrived."""


class Connection:
    """One client of a broker."""

    def __init__(self, broker: Broker, ident: str, will: Will | None, owner: Owner, errors: ErrorReporter) -> None:
        """`ident` is the same for each connection of a robot, so that the broker first closes an older connection."""
        self._broker, self._ident, self._will, self._owner = broker, ident, will, owner
        self._errors = errors
        self._client: Client | None = None
        self._wait, self._due = FIRST_WAIT, 0.0
        self._since: float | None = None
        """When this attempt began, or when the connection was opened."""
        self.open = False
        self.dialling = False
        self._reason = ""
        self._steady = self._dropped = self._closed = False

    @property
    def socket(self) -> Any:
        """The socket to wait for; None while there is none."""
        return None if self._client is None or self.dialling else self._client.socket()

    @property
    def wants_write(self) -> bool:
        """Whether data waits for the socket."""
        return self._client is not None and not self.dialling and self._client.want_write()

    def due(self, now: float) -> bool:
        """Whether it is time for another attempt."""
        return self._client is None and not self._closed and now >= self._due

    def dial(self) -> Callable[[], str | None]:
        """Begin an attempt. Call the returned function in another thread and pass its result to `dialled`."""
        self.dialling = True
        self._client = client = self._make()
        return lambda: dial(client, self._broker)

    def dialled(self, reason: str | None, now: float) -> None:
        """The helper thread has finished. `reason` is the reason of a failure, or None."""
        self.dialling = False
        self._since = now
        if reason is not None or self._closed:
            self._end(now, reason or "closed")

    def turn(self, now: float) -> None:
        """Call this once a second: it sends pings and closes a connection without an answer."""
        if self._client is None or self.dialling or self._since is None:
            return
        if not self.open and now - self._since > ANSWER:
            self._end(now, f"no answer within {ANSWER:g} s")
            return
        if self.open and not self._steady and now - self._since >= STEADY:
            self._steady = True
            self._wait = FIRST_WAIT
            self._errors.holds()
        self._run(self._client.loop_misc, now)

    def readable(self, now: float) -> None:
        """Read the data on the socket."""
        for _ in range(MOST_AT_ONCE):
            if self._client is None or not self._run(self._client.loop_read, now) or not self._more():
                return

    def writable(self, now: float) -> None:
        """Write the data that waits."""
        if self._client is not None:
            self._run(self._client.loop_write, now)

    def publish(self, topic: str, text: str, qos: int, retain: bool = False, expiry: int | None = None) -> int:
        """Publish a text; return the message id of its acknowledgement. `expiry` (s) needs MQTT 5."""
        assert self._client is not None
        properties = None
        if expiry is not None and self._broker.version == "5":
            properties = Properties(PacketTypes.PUBLISH)  # type: ignore[no-untyped-call]
            properties.MessageExpiryInterval = expiry
        return self._client.publish(topic, text.encode(), qos, retain, properties).mid

    def subscribe(self, topics: list[tuple[str, int]]) -> None:
        """Subscribe to topics, each with its quality of service."""
        assert self._client is not None
        self._client.subscribe(topics)

    def drop(self, reason: str) -> None:
        """Close the socket without a DISCONNECT and try again later. Only for callbacks of the owner."""
        self._reason, self._dropped = reason, True

    def leave(self) -> None:
        """Send a DISCONNECT, so that the broker does not publish the will.

        Call this only when no acknowledgement is pending: one that arrives later would reset the connection.
        """
        self._closed = True
        if self._client is not None and self.open:
            self._client.disconnect()

    def close(self) -> None:
        """Close the socket and do not try again."""
        self._closed = True
        if self._client is not None and not self.dialling:
            shut(self._client)
            self._client = None
        self.open = False

    def _make(self) -> Client:
        client = make(self._broker, self._ident, self._will)
        client.on_connect = self._on_connect
        client.on_disconnect = self._on_disconnect
        client.on_publish = lambda c, u, mid, code, p: self._owner.acknowledged(mid, refusal(code))
        client.on_subscribe = lambda c, u, mid, codes, p: self._on_subscribe(mid, codes)
        client.on_message = lambda c, u, message: self._owner.received(message)
        return client

    def _on_connect(self, client: Client, data: object, flags: object, code: ReasonCode, properties: object) -> None:
        if code.is_failure:
            self._reason = f"the broker refuses: {words(code)}"
        else:
            self.open = True

    def _on_disconnect(self, client: Client, data: object, flags: Any, code: ReasonCode, properties: object) -> None:
        if flags.is_disconnect_packet_from_server:
            self._reason = f"the broker ends the connection: {words(code)}"

    def _on_subscribe(self, mid: int, codes: list[ReasonCode]) -> None:
        self._owner.acknowledged(mid, next(filter(None, map(refusal, codes)), None))

    def _run(self, step: Callable[[], object], now: float) -> bool:
        """Run a step of paho. False if the connection has ended."""
        was_open = self.open
        try:
            fine = step() == MQTT_ERR_SUCCESS
        except Exception as error:  # whatever paho raises for the bytes of a peer
            fine, self._reason = False, f"the answer is not MQTT ({type(error).__name__})"
        if not fine or self._dropped or self._client is None or self._client.socket() is None:
            self._end(now, self._reason or lost(self._broker, self.open, self._steady))
            return False
        if self.open and not was_open:
            self._since = now
            self._errors.opens()
            self._owner.opened()
        return True

    def _more(self) -> bool:
        """Whether TLS has decrypted data that is not read yet."""
        sock = self.socket
        return isinstance(sock, ssl.SSLSocket) and sock.pending() > 0

    def _end(self, now: float, reason: str) -> None:
        client, self._client = self._client, None
        if client is not None:
            shut(client)
        self._due = now + self._wait * random.uniform(0.7, 1.3)
        self._wait = min(2 * self._wait, LONGEST_WAIT)
        was_open, self.open, self._since = self.open, False, None
        self._steady = False
        self._reason, self._dropped = "", False
        if not self._closed:
            self._errors.fails(reason)
        if was_open:
            self._owner.lost()
