"""One MQTT connection: opened in a helper thread, and again after it was lost, with the reason in words."""

from __future__ import annotations

import random
import ssl
from typing import TYPE_CHECKING, Any, Final, Protocol

from paho.mqtt.client import MQTT_ERR_SUCCESS, Client, MQTTMessage
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from .client import dial, make, shut
from .complaints import lost, refusal, words

if TYPE_CHECKING:
    from collections.abc import Callable

    from paho.mqtt.reasoncodes import ReasonCode

    from .client import Will
    from .complaints import Complaints
    from .options import Broker

FIRST_WAIT, LONGEST_WAIT = 1.0, 30.0  # s between two attempts; doubled each time, and spread
STEADY: Final = 10.0  # s that a connection has to hold for the next wait to be the first one
ANSWER: Final = 10.0  # s for a broker to answer
MOST_AT_ONCE: Final = 200  # packets read before others have their turn


class Owner(Protocol):
    """Who uses a connection. Everything is called in the loop's thread."""

    def opened(self) -> None:
        """The broker has let us in."""

    def lost(self) -> None:
        """What was not acknowledged by now is not delivered."""

    def acknowledged(self, mid: int, refused: str | None) -> None:
        """The broker has taken a publication, or a subscription, or says why not."""

    def received(self, message: MQTTMessage) -> None:
        """A publication of others."""


class Connection:
    """One client of a broker."""

    def __init__(self, broker: Broker, ident: str, will: Will | None, owner: Owner, complaints: Complaints) -> None:
        """`ident` stays the same for the same robot: the broker then ends what is left of an older connection first."""
        self._broker, self._ident, self._will, self._owner = broker, ident, will, owner
        self._complaints = complaints
        self._client: Client | None = None
        self._wait, self._due = FIRST_WAIT, 0.0
        self._since: float | None = None
        """When this attempt began, or the connection was opened."""
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
        """Whether something could not be written yet."""
        return self._client is not None and not self.dialling and self._client.want_write()

    def due(self, now: float) -> bool:
        """Whether it is time for another attempt."""
        return self._client is None and not self._closed and now >= self._due

    def dial(self) -> Callable[[], str | None]:
        """Begin an attempt: what is returned is to be called in another thread, and `dialled` told its result."""
        self.dialling = True
        self._client = client = self._make()
        return lambda: dial(client, self._broker)

    def dialled(self, reason: str | None, now: float) -> None:
        """The helper thread is done; `reason` is why it could not be."""
        self.dialling = False
        self._since = now
        if reason is not None or self._closed:
            self._end(now, reason or "closed")

    def turn(self, now: float) -> None:
        """Once a second: keep it alive, give up what does not answer."""
        if self._client is None or self.dialling or self._since is None:
            return
        if not self.open and now - self._since > ANSWER:
            self._end(now, f"no answer within {ANSWER:g} s")
            return
        if self.open and not self._steady and now - self._since >= STEADY:
            self._steady = True
            self._wait = FIRST_WAIT
            self._complaints.holds()
        self._run(self._client.loop_misc, now)

    def readable(self, now: float) -> None:
        """Take what came."""
        for _ in range(MOST_AT_ONCE):
            if self._client is None or not self._run(self._client.loop_read, now) or not self._more():
                return

    def writable(self, now: float) -> None:
        """Write what waits."""
        if self._client is not None:
            self._run(self._client.loop_write, now)

    def publish(self, topic: str, text: str, qos: int, retain: bool = False, expiry: int | None = None) -> int:
        """Hand to the broker; the number under which it is acknowledged. `expiry` (s) is for MQTT 5 only."""
        assert self._client is not None
        properties = None
        if expiry is not None and self._broker.version == "5":
            properties = Properties(PacketTypes.PUBLISH)  # type: ignore[no-untyped-call]
            properties.MessageExpiryInterval = expiry
        return self._client.publish(topic, text.encode(), qos, retain, properties).mid

    def subscribe(self, topics: list[tuple[str, int]]) -> None:
        """Ask for topics, each with a quality of service."""
        assert self._client is not None
        self._client.subscribe(topics)

    def drop(self, reason: str) -> None:
        """End it as if the line were cut, and try again later. Only in a callback of the owner."""
        self._reason, self._dropped = reason, True

    def leave(self) -> None:
        """Tell the broker that we go, so that it does not say the will.

        Only when nothing is on its way any more: an answer that comes after this would reset the connection.
        """
        self._closed = True
        if self._client is not None and self.open:
            self._client.disconnect()

    def close(self) -> None:
        """End it for good, as it is."""
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

    def _on_connect(self, client: Client, data: Any, flags: Any, code: ReasonCode, properties: Any) -> None:
        if code.is_failure:
            self._reason = f"the broker refuses: {words(code)}"
        else:
            self.open = True

    def _on_disconnect(self, client: Client, data: Any, flags: Any, code: ReasonCode, properties: Any) -> None:
        if flags.is_disconnect_packet_from_server:
            self._reason = f"the broker ends the connection: {words(code)}"

    def _on_subscribe(self, mid: int, codes: list[ReasonCode]) -> None:
        self._owner.acknowledged(mid, next(filter(None, map(refusal, codes)), None))

    def _run(self, step: Callable[[], Any], now: float) -> bool:
        """One of paho's steps; False if that was the end of the connection."""
        was_open = self.open
        try:
            fine = step() == MQTT_ERR_SUCCESS
        except Exception as error:  # whatever a peer's bytes make paho raise
            fine, self._reason = False, f"what comes is no MQTT ({type(error).__name__})"
        if not fine or self._dropped or self._client is None or self._client.socket() is None:
            self._end(now, self._reason or lost(self._broker, self.open, self._steady))
            return False
        if self.open and not was_open:
            self._since = now
            self._complaints.opens()
            self._owner.opened()
        return True

    def _more(self) -> bool:
        """Whether TLS has decrypted more than was read."""
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
            self._complaints.fails(reason)
        if was_open:
            self._owner.lost()
