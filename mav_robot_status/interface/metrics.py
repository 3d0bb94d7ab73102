"""What a gateway counts, as values: taken in its own thread, written out by whoever was asked for them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    from .status import RobotStatusMsg


class ConnectionMetrics(NamedTuple):
    """One connection, counted since it was opened."""

    connection: str
    """As it was configured: `udp:0.0.0.0:14550`."""
    is_out: bool
    """Whether it leads to ground stations rather than to vehicles."""
    peers: int
    """Ends that we speak to."""
    frames: int
    """MAVLink frames that were not damaged."""
    lost: int
    """Sequence numbers that are missing."""
    crc_errors: Mapping[int, int]
    """By message id: frames damaged, or defined otherwise there. Under -1 those of further ids."""
    unknown: int
    """Frames of ids that cannot be checked."""
    incompatible: int
    """Frames with an unknown incompatibility flag."""
    garbage_bytes: int
    dropped: int
    """What could not be sent, and what the kernel dropped on receipt."""


class PublisherMetrics(NamedTuple):
    """One publisher, counted since it was made."""

    type: str
    number: int
    """Counts those of one type from 1."""
    queued: int
    """What it holds and has not yet handed on."""
    dropped: int
    """Messages that it had no room for."""


class Metrics(NamedTuple):
    """Everything at one moment."""

    vehicles: tuple[RobotStatusMsg, ...] = ()
    """The latest status of every handle, with the age of its heartbeat now."""
    connections: tuple[ConnectionMetrics, ...] = ()
    publishers: tuple[PublisherMetrics, ...] = ()
    record_dropped: int | None = None
    """Frames that the recording has not; None: nothing is recorded."""
