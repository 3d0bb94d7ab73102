"""The `simple_message` publisher: ROS-Industrial's node `robot_state` connects to it as to a robot controller."""

from __future__ import annotations

import logging
import math
from functools import partial
from typing import Final

from ...clock import Instant
from ...interface import Publisher, PublisherContext, RobotStatus, RobotStatusMsg
from ...simple_message import StatusEncoder
from ..listener import listen
from .options import NAME, SimpleMessageOptions, read
from .requests import RequestReader
from .server import MOST_CLIENTS, SOCKET_OPTIONS, Server

log = logging.getLogger(__name__)

LOOK: Final = 0.1
"""Seconds between two looks at the clients. It bounds what a flood costs: a client that sends more has to wait."""


class SimpleMessagePublisher(Publisher):
    """A TCP server that sends the status of one handle to every client. A client without room is disconnected.

    Raises UsageError for a wrong option, LinkError if the port is in use.
    """

    periodic = True
    live_only = True
    one_handle = True  # a frame does not say whose status it is

    options_type = SimpleMessageOptions
    check_options = staticmethod(read)
    listens_on = staticmethod(lambda given: read(given)[:2])

    def __init__(self, context: PublisherContext) -> None:
        host, port, byte_order = self.check_options(context.options)
        listener = listen(NAME, host, port, SOCKET_OPTIONS, MOST_CLIENTS)
        self._server = Server(NAME, listener, partial(RequestReader, byte_order))
        self._encoder = StatusEncoder(byte_order)
        self._latest = b""
        self._look_at = -math.inf
        log.info("%s: listening on %s/tcp", NAME, self._server.where)

    @property
    def dropped(self) -> int:
        """Frames that did not fit into the buffer of a client. Each disconnected its client."""
        return self._server.dropped

    def publish(self, msg: RobotStatusMsg) -> None:
        """Send the status to every client."""
        self._latest = self._encoder.encode(msg.status)
        self._server.send(self._latest)

    def service(self, now: Instant) -> float:
        """Look at the clients every LOOK seconds."""
        if now.mono >= self._look_at:
            self._look_at = now.mono + LOOK
            self._server.look(now.mono, self._latest)
        return self._look_at

    def forget(self, handle: str) -> None:
        """Stop sending the last status of this handle to new clients."""
        self._latest = b""

    def close(self) -> None:
        """Tell every client that nothing is known any more; close the port and all connections."""
        self._server.send(self._encoder.encode(RobotStatus()))
        self._server.close()
