"""The counters of a gateway as values. The gateway's thread reads them; a publisher writes them out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from .status import RobotStatusMsg


class ConnectionMetrics(NamedTuple):
    """One connection, counted since it was opened."""

    connection: str
    """As it was configured: `udp:0.0.0.0:14550`."""
    is_out: bool
    """True for an out, False for a vehicle link."""
    peers: int
    """Peers that get messages from us."""
    frames: int
    """Valid MAVLink frames that reached the gateway."""
    lost: int
    """Sequence numbers that are missing."""
    crc_errors: Mapping[int, int]
    """Frames with a bad CRC by message id. -1 counts the ids beyond the limit."""
    unknown: int
    """Frames of ids that cannot be checked."""
    incompatible: int
    """Frames with an unknown incompatibility flag."""
    garbage_bytes: int
    dropped: int
    """Messages that could not be sent, and datagrams that the kernel dropped."""
    said: int = 0
    """Bytes that we sent without being asked."""
    withheld: int = 0
    """Messages that we held back because of `speech_limit`."""
    left_out: int = 0
    """Senders that are not heard, because there are too many."""


class PublisherMetrics(NamedTuple):
    """One publisher, counted since it was made."""

    type: str
    number: int
    """The number of the publisher among those of its type, from 1."""
    queued: int
    """Messages in its queue."""
    dropped: int
    """Messages that it dropped."""


class Metrics(NamedTuple):
    """Everything at one moment."""

    vehicles: tuple[RobotStatusMsg, ...] = ()
    """The latest status of every handle, with the age of its heartbeat now."""
    connections: tuple[ConnectionMetrics, ...] = ()
    publishers: tuple[PublisherMetrics, ...] = ()
    record_dropped: int | None = None
    """Frames missing in the recording; None: nothing is recorded."""
