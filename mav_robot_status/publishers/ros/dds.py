"""ROS 2 over DDS, with Cyclone DDS: a participant, and a writer for each topic.

The environment variable CYCLONEDDS_URI selects network interfaces, as it does for ROS 2 itself.
"""

from __future__ import annotations

import re
import time
from typing import TYPE_CHECKING, Any, Final

from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsSubscription
from cyclonedds.core import DDSException
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.topic import Topic
from cyclonedds.util import duration

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
        self._participant = join(self._settings.domain)

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
            found = self._writers[sample.topic] = writer(self._participant, sample.topic, sample.type)
        return found


def join(domain: int) -> Any:
    """A participant. Raises UnreachableError."""
    try:
        return DomainParticipant(domain)
    except DDSException as error:
        raise UnreachableError(f"cannot join: {error.msg or error}") from None


def subscriptions_of(settings: Ros2Settings) -> list[Endpoint]:
    """The subscriptions of other participants in the domain that announce themselves soon. Raises UnreachableError."""
    participant = join(settings.domain)
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


def writer(participant: Any, topic: str, kind: MessageType) -> Any:
    """A writer with the quality of service that ROS 2 uses by default."""
    qos = Qos(
        Policy.Reliability.Reliable(duration(milliseconds=LONGEST)),
        Policy.Durability.Volatile,
        Policy.History.KeepLast(DEPTH),
        Policy.Userdata(f"typehash={kind.hash};".encode()),
    )
    found = Topic(participant, f"{PREFIX}{topic}", TYPES[kind.name], qos)
    return DataWriter(participant, found, qos)
