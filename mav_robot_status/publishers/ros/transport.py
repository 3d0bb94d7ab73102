"""What the worker needs of a middleware. Only the worker's thread calls it, so every call may block."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from .messages import MessageType


class UnreachableError(Exception):
    """The middleware cannot be used now. The message is the reason, for the log."""


class Sample(NamedTuple):
    """One message of a topic."""

    topic: str
    """`/rover/robot_status`."""
    type: MessageType
    payload: bytes
    """CDR with its header."""
    unix_ns: int
    """When the status was made: Unix nanoseconds."""


class Endpoint(NamedTuple):
    """A subscription of another program, as its middleware announces it."""

    domain: int
    node: str
    """With its namespace: `/plant/viewer`; empty if the middleware does not say it."""
    topic: str
    dds_type: str
    type_hash: str
    """Empty if the middleware does not say it."""
    matched: bool | None = None
    """Whether our writers match it; None if the middleware does not say it, or the topic is none of ours."""
    why: str = ""
    """Why it does not match."""


class Transport(Protocol):
    """A node of ROS 2 with its publishers. After `close`, or after an exception of `send`, it can be opened again."""

    def open(self) -> None:
        """Join the network. Raises UnreachableError."""

    def lost(self) -> str | None:
        """Why nothing can be sent any more; None while it can."""

    def send(self, sample: Sample) -> None:
        """Publish. A new topic is announced first. Raises UnreachableError."""

    def remove(self, topic: str) -> None:
        """Take back the announcement of a topic that is not published any more. Raises UnreachableError."""

    def close(self) -> None:
        """Leave the network. A second call does nothing."""
