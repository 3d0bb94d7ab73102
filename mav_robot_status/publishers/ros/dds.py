"""ROS 2 over DDS, with Cyclone DDS: a participant, and a writer for each topic.

The environment variable CYCLONEDDS_URI selects network interfaces, as it does for ROS 2 itself.
"""

from __future__ import annotations

import logging
import math
import os
import time
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final
from xml.sax.saxutils import quoteattr

from cyclonedds.core import DDSException
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from ...interface.options import short
from ...paced_log import PacedLog
from .dds_match import PREFIX, Subscriptions, judged
from .dds_types import TYPES, encoded
from .messages import kind_of
from .transport import Endpoint, UnreachableError

if TYPE_CHECKING:
    from uuid import UUID

    from .messages import MessageType
    from .settings import Ros2Settings
    from .transport import Sample

DEPTH: Final = 10
"""Messages of a topic that wait for a slow reader; ROS 2's default."""
log = logging.getLogger(__name__)

MISSED: Final = 3.0
"""A deadline is missed after this many periods."""
LEASE: Final = 3.0  # s after which a subscriber knows that the gateway is gone
COMPATIBLE: Final = "<Compatibility><IgnoreTypeInformation>1.15</IgnoreTypeInformation></Compatibility>"
"""1.15 is Fast DDS. Cyclone DDS rejects the type information of its version 3, and so every subscriber of Kilted."""
LOOPBACK: Final = "127.0.0.1"
LOCAL: Final = (
    f'<General><Interfaces><NetworkInterface address="{LOOPBACK}"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General>"
)
LOCAL_DISCOVERY: Final = (
    "<ParticipantIndex>auto</ParticipantIndex><MaxAutoParticipantIndex>32</MaxAutoParticipantIndex>"
)
URI: Final = "CYCLONEDDS_URI"
LONGEST: Final = 100  # ms for which a write may block
LOOK: Final = 1.0  # s between two looks at the subscribers
DISCOVERY: Final = 2.0  # s in which other participants answer a new one


class DdsTransport:
    """A participant of the domain, and its writers."""

    def __init__(self, settings: Ros2Settings) -> None:
        self._settings = settings
        self._participant: Any = None
        self._writers: dict[str, Any] = {}
        self._types: dict[str, str] = {}
        """The type of each writer."""
        self._subscriptions: Subscriptions | None = None
        self._seen: dict[UUID, float] = {}
        """When (monotonic seconds) each subscription was seen first; inf once it was told that it does not match."""
        self._look_at = 0.0
        self._tell = PacedLog(log, 10, 3600.0)

    def open(self) -> None:
        """Join the domain. Raises UnreachableError; Cyclone DDS then writes the cause to standard error."""
        self._participant = join(self._settings)
        self._subscriptions = Subscriptions(self._participant, self._settings.domain)

    def lost(self) -> None:
        """Never: DDS has no connection. The log names each subscriber of our topics that cannot hear us, once."""
        now = time.monotonic()
        if self._subscriptions is None or now < self._look_at:
            return
        self._look_at = now + LOOK
        with suppress(DDSException):  # nothing but the log line depends on it
            self._tell_unmatched(self._subscriptions.now(), now)

    def send(self, sample: Sample) -> None:
        """Publish. Raises UnreachableError."""
        try:
            self._writer(sample).write(encoded(TYPES[sample.type.name], sample.payload), sample.unix_ns)
        except DDSException as error:
            raise UnreachableError(f"cannot publish: {error}") from None

    def remove(self, topic: str) -> None:
        """Delete the writer of a topic."""
        self._writers.pop(topic, None)
        self._types.pop(topic, None)

    def close(self) -> None:
        """Leave the domain."""
        self._writers.clear()
        self._types.clear()
        self._seen.clear()
        self._participant = self._subscriptions = None

    def _tell_unmatched(self, found: dict[UUID, Endpoint], now: float) -> None:
        self._seen = {key: self._seen.get(key, now) for key in found}
        for topic, one in self._writers.items():
            for key, subscription in judged(found, topic, one, self._types[topic]).items():
                if not subscription.matched and now >= self._seen[key] + DISCOVERY:
                    self._seen[key] = math.inf
                    self._tell(logging.WARNING, now, f"ros2: a subscriber of {topic} hears nothing: {subscription.why}")

    def _writer(self, sample: Sample) -> Any:
        found = self._writers.get(sample.topic)
        if found is None:
            rate = self._settings.rate
            self._types[sample.topic] = sample.type.dds_name
            found = self._writers[sample.topic] = writer(self._participant, sample.topic, sample.type, rate)
        return found


_DOMAINS: Final[dict[int, Any]] = {}
"""The domains of this process. A domain has one configuration, and lives as long as the process."""


def join(settings: Ros2Settings) -> Any:
    """A participant. Raises UnreachableError."""
    domain = settings.domain
    try:
        if domain not in _DOMAINS:
            _DOMAINS[domain] = Domain(domain, configuration(settings))
        return DomainParticipant(domain)
    except (DDSException, UnicodeEncodeError) as error:
        why = getattr(error, "msg", None) or str(error)
        given = os.environ.get(URI)
        blamed = f"; is {URI}={short(given, 200)} right?" if given and domain not in _DOMAINS else ""
        raise UnreachableError(f"cannot join: {why}{blamed}") from None


def configuration(settings: Ros2Settings) -> str:
    """The configuration of our domain, and after it that of the user, which may be empty and goes before ours."""
    addresses = (*([LOOPBACK] if settings.local else []), *settings.peers)
    peers = "".join(f"<Peer address={quoteattr(address)}/>" for address in addresses)
    discovery = (LOCAL_DISCOVERY if settings.local else "") + (f"<Peers>{peers}</Peers>" if peers else "")
    ours = COMPATIBLE + (LOCAL if settings.local else "") + (f"<Discovery>{discovery}</Discovery>" if discovery else "")
    return f"<CycloneDDS><Domain>{ours}</Domain></CycloneDDS>,{os.environ.get(URI, '')}"


def subscriptions_of(settings: Ros2Settings) -> list[Endpoint]:
    """The subscriptions of other participants in the domain that announce themselves soon. Raises UnreachableError.

    A writer for each of their topics that is like ours shows whether they would hear the gateway. It publishes nothing.
    """
    participant = join(settings)
    subscriptions = Subscriptions(participant, settings.domain)
    time.sleep(DISCOVERY)
    kinds = {one.topic: kind for one in subscriptions.now().values() if (kind := kind_of(one.topic, settings))}
    try:
        writers = {topic: writer(participant, topic, kind, settings.rate) for topic, kind in kinds.items()}
        time.sleep(DISCOVERY)
        found = subscriptions.now()
        for topic, one in writers.items():
            found |= judged(found, topic, one, kinds[topic].dds_name)
    except DDSException as error:
        raise UnreachableError(f"cannot ask who is matched: {error.msg or error}") from None
    return sorted(found.values())


def writer(participant: Any, topic: str, kind: MessageType, rate: float) -> Any:
    """A writer that every default subscriber of ROS 2 matches. A late one gets the last message at once.

    `rate` in Hz says when a deadline is missed; 0: never.
    """
    qos = Qos(
        Policy.Reliability.Reliable(duration(milliseconds=LONGEST)),
        Policy.Durability.TransientLocal,
        Policy.DurabilityService(0, Policy.History.KeepLast(1), -1, -1, -1),
        Policy.History.KeepLast(DEPTH),
        Policy.Deadline(duration(seconds=MISSED / rate) if rate else duration(infinite=True)),
        Policy.Liveliness.Automatic(duration(seconds=LEASE)),
        Policy.Userdata(f"typehash={kind.hash};".encode()),
    )
    found = Topic(participant, f"{PREFIX}{topic}", TYPES[kind.name], qos)
    return DataWriter(participant, found, qos)
