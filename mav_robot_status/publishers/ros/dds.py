"""ROS 2 over DDS, with Cyclone DDS: a participant, and a writer for each topic.

The environment variable CYCLONEDDS_URI selects network interfaces, as it does for ROS 2 itself.
"""

from __future__ import annotations

import os
import re
import time
from typing import TYPE_CHECKING, Any, Final
from xml.sax.saxutils import quoteattr

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsSubscription
from cyclonedds.core import DDSException
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from ...interface.options import short
from .dds_types import TYPES, encoded
from .transport import Endpoint, UnreachableError

if TYPE_CHECKING:
    from .messages import MessageType
    from .settings import Ros2Settings
    from .transport import Sample

PREFIX: Final = "rt"
"""What ROS 2 puts before the name of a topic."""
DEPTH: Final = 10
"""Messages of a topic that wait for a slow reader; ROS 2's default."""
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
DISCOVERY: Final = 2.0  # s in which other participants answer a new one
MOST_ENDPOINTS: Final = 1000
_HASH: Final = re.compile(rb"typehash=([^;]*);")


class DdsTransport:
    """A participant of the domain, and its writers."""

    def __init__(self, settings: Ros2Settings) -> None:
        self._settings = settings
        self._participant: Any = None
        self._writers: dict[str, Any] = {}

    def open(self) -> None:
        """Join the domain. Raises UnreachableError; Cyclone DDS then writes the cause to standard error."""
        self._participant = join(self._settings)

    def lost(self) -> None:
        """Never: DDS has no connection."""

    def send(self, sample: Sample) -> None:
        """Publish. Raises UnreachableError."""
        try:
            self._writer(sample).write(encoded(TYPES[sample.type.name], sample.payload), sample.unix_ns)
        except DDSException as error:
            raise UnreachableError(f"cannot publish: {error}") from None

    def remove(self, topic: str) -> None:
        """Delete the writer of a topic."""
        self._writers.pop(topic, None)

    def close(self) -> None:
        """Leave the domain."""
        self._writers.clear()
        self._participant = None

    def _writer(self, sample: Sample) -> Any:
        found = self._writers.get(sample.topic)
        if found is None:
            rate = self._settings.rate
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
    """The subscriptions of other participants in the domain that announce themselves soon. Raises UnreachableError."""
    participant = join(settings)
    reader = BuiltinDataReader(participant, BuiltinTopicDcpsSubscription)
    time.sleep(DISCOVERY)
    found = (_endpoint(settings.domain, sample) for sample in reader.take(MOST_ENDPOINTS))
    return sorted({one for one in found if one is not None})


def _endpoint(domain: int, sample: Any) -> Endpoint | None:
    """A subscription of ROS; None for one of something else."""
    name = sample.topic_name or ""
    if not name.startswith(f"{PREFIX}/"):
        return None
    data = next((bytes(policy.data) for policy in sample.qos if isinstance(policy, Policy.Userdata)), b"")
    found = _HASH.search(data)
    return Endpoint(domain, "", name[len(PREFIX) :], sample.type_name or "", found[1].decode() if found else "")


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
