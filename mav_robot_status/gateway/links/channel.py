"""One peer of a link."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from ...hardware.mavlink.subjects import IDS_WITH_FILES, WANTED_IDS

if TYPE_CHECKING:
    from ...links.base import Address
    from ...mavlink.encode import Encoder
    from ...mavlink.framing import Parser
    from .endpoint import Endpoint

PEER_SILENCE: Final = 30.0
"""Seconds of silence after which a peer is forgotten."""
NEWCOMER_SILENCE: Final = 5.0
"""Seconds for which a silent newcomer keeps its place. A peer that has spoken for longer keeps it for that time."""
NEVER: Final = -math.inf


class Channel:
    """One peer of a link: a MAVLink channel with its own sequence numbers. Compared by identity."""

    __slots__ = (
        "active_at",
        "encoders",
        "endpoint",
        "frames",
        "heard_at",
        "interval",
        "is_peer",
        "parser",
        "quiet",
        "since",
        "source",
        "systems",
        "wanted",
    )

    def __init__(self, endpoint: Endpoint, source: Address, parser: Parser) -> None:
        self.endpoint = endpoint
        self.source = source
        """The address to send to; None: the link has one peer."""
        self.parser = parser
        self.heard_at = NEVER
        """When (monotonic seconds) the last heartbeat arrived: of an autopilot, or of any component on an out."""
        self.since = 0.0
        """The first of these heartbeats."""
        self.is_peer = not endpoint.listens
        """Whether we send to it, and accept its requests."""
        self.interval: float | None = None
        """Seconds between two ROBOT_STATUS, as this peer requested. None: the default. inf: no messages."""
        self.encoders: dict[int, Encoder] = {}
        """By our system id."""
        self.frames = -1
        """The frames of the parser when `Endpoint.forget_silent` was called last."""
        self.active_at = NEVER
        self.quiet = False
        """Whether all vehicles heard there send only HIGH_LATENCY2: each byte that we send there costs money."""
        self.systems: set[int] = set()
        """The system ids of the vehicles that are heard there: messages about others are not sent there."""
        self.wanted = WANTED_IDS
        """The ids of the messages that are used."""

    @property
    def is_out(self) -> bool:
        """Whether it leads to ground stations and not to vehicles."""
        return self.endpoint.is_out

    @property
    def passive(self) -> bool:
        """Whether sending there is forbidden."""
        return self.endpoint.passive

    @property
    def trusted(self) -> bool:
        """Whether all bytes come from one sender: a serial device, or a TCP connection that we opened."""
        return self.endpoint.is_serial or (self.endpoint.link.stream and not self.endpoint.listens)

    @property
    def heartbeat_timeout(self) -> float | None:
        """Seconds without a frame after which a vehicle there is lost, if the site says so."""
        return self.endpoint.heartbeat_timeout

    @property
    def address(self) -> str | None:
        """The address of the peer; None if the link has one peer."""
        return f"{self.source[0]}:{self.source[1]}" if isinstance(self.source, tuple) else None

    @property
    def named(self) -> str | None:
        """The URL of its link with the address of this peer as the only one; None if the link has one peer."""
        return f"{self.endpoint.url.split('?')[0]}?from={self.source[0]}" if isinstance(self.source, tuple) else None

    def hear_files(self, on: bool) -> None:
        """Start or stop using messages that bring files. May be repeated: the channel may have another parser now."""
        self.wanted = IDS_WITH_FILES if on else WANTED_IDS
        self.parser.want(self.wanted)

    def hear(self, now: float) -> None:
        """Note a heartbeat: of an autopilot, or of any component on an out."""
        if now - self.heard_at > PEER_SILENCE:
            self.since = now
        self.heard_at = now

    def gives_way(self, now: float) -> bool:
        """Whether it gives up its place to another, because no vehicle speaks on it."""
        if self.is_peer and not self.endpoint.listens:
            return False
        spoken = max(NEWCOMER_SILENCE, self.heard_at - self.since)
        return now - self.heard_at > min(spoken, PEER_SILENCE)

    def __str__(self) -> str:
        """For example `10.1.2.3:14550, listening on 0.0.0.0:14550/udp`."""
        text = self.endpoint.link.text
        return f"{self.source[0]}:{self.source[1]}, {text}" if isinstance(self.source, tuple) else text

    def send(self, frame: bytes) -> bool:
        """Send to this peer. False if that fails, on a passive link, and if the link sends only to another."""
        endpoint = self.endpoint
        if endpoint.listens:
            return not endpoint.passive and endpoint.link.send(frame, self.source)
        return self.is_peer and not endpoint.passive and endpoint.link.send(frame)
