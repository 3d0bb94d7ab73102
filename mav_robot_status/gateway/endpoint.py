"""One live link, and a channel for each of its peers."""

from __future__ import annotations

import logging
import math
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

from ..hardware.mavlink.message_table import WANTED_IDS
from ..links.base import ServesClients
from ..links.guarded import open_guarded
from ..links.url import parse
from ..mavlink.counters import Counters
from ..mavlink.framing import Parser
from .speech import LIMIT, Speech

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..config import LinkConfig
    from ..links.base import Address, Link
    from ..mavlink.encode import Encoder

log = logging.getLogger(__name__)

MOST_SOURCES: Final = 64
"""Limit of channels of one link. The one silent longest is dropped."""
MOST_PEERS: Final = 8
PEER_SILENCE: Final = 30.0  # s
ACTIVE: Final = 10.0
"""Seconds since the last valid frame for which a peer counts as active."""
NEVER: Final = -math.inf


class Channel:
    """One peer of a link: a MAVLink channel with its own sequence numbers. Compared by identity."""

    __slots__ = ("active_at", "encoders", "endpoint", "frames", "heard_at", "interval", "parser", "source", "systems")

    def __init__(self, endpoint: Endpoint, source: Address, parser: Parser) -> None:
        self.endpoint = endpoint
        self.source = source
        """The address to send to; None: the link has one peer."""
        self.parser = parser
        self.heard_at = NEVER
        """When (monotonic seconds) the last heartbeat arrived: of an autopilot, or of any component on an out."""
        self.interval: float | None = None
        """Seconds between two ROBOT_STATUS, as this peer requested. None: the default. inf: no messages."""
        self.encoders: dict[int, Encoder] = {}
        """By our system id."""
        self.frames = parser.counters.frames
        """The frames of the parser when `note_activity` was called last."""
        self.active_at = NEVER
        self.systems: set[int] = set()
        """The system ids of the vehicles that are heard there: messages about others are not sent there."""

    @property
    def is_out(self) -> bool:
        """Whether it leads to ground stations and not to vehicles."""
        return self.endpoint.is_out

    @property
    def passive(self) -> bool:
        """Whether sending there is forbidden."""
        return self.endpoint.passive

    def __str__(self) -> str:
        """For example `10.1.2.3:14550, listening on 0.0.0.0:14550/udp`."""
        text = self.endpoint.link.text
        return f"{self.source[0]}:{self.source[1]}, {text}" if isinstance(self.source, tuple) else text

    def send(self, frame: bytes) -> bool:
        """Send to this peer. False if that fails, or on a passive link."""
        return not self.endpoint.passive and self.endpoint.link.send(frame, self.source)


class Endpoint:
    """One link with its channels. Bounded for any number of senders."""

    def __init__(self, config: LinkConfig, is_out: bool = False, number: int = 0, *, keep_all: bool = False) -> None:
        """Open the link. Raises LinkError, UsageError. `keep_all`: parse every frame, to forward or record it."""
        url = parse(config.url)
        self.url = config.url
        """As in the configuration."""
        self.link: Link = open_guarded(url)
        if isinstance(self.link, ServesClients):
            self.link.is_active = self.is_active
        self._serial = url.kind.is_serial
        self.number: int
        """The number of the link in its gateway, from 0."""
        self.robot_status: bool
        """Whether ROBOT_STATUS is sent on this link, if it is a vehicle link."""
        self.passive: bool
        self.speech = Speech()
        self._wanted: frozenset[int] | None = WANTED_IDS
        self._channels: OrderedDict[Address, Channel] = OrderedDict()
        self.is_out = is_out
        self.adjust(config, number, keep_all=keep_all)
        self.must_speak = url.kind.speaks_first
        self.listens = url.kind.listens
        """Whether each source address is a peer. Otherwise the link has one peer, whatever the address."""
        self._source: Address = None
        self.connections = 0
        """How many connections a link with one peer has had."""
        if not self.listens:
            self._only = self._channels[None] = Channel(self, None, Parser(self._wanted))

    def adjust(self, config: LinkConfig, number: int, *, keep_all: bool = False) -> None:
        """Change an open link: everything except its URL."""
        self.number, self.passive = number, config.passive
        self.robot_status = not self._serial if config.robot_status is None else config.robot_status
        default = None if self.is_out else LIMIT
        self.speech_limit = (config.speech_limit or None) if config.speech_limit is not None else default
        self.speech.renew(self.speech_limit)
        wanted = None if keep_all else WANTED_IDS
        if wanted is not self._wanted:
            self._wanted = wanted
            for channel in self._channels.values():
                parser = Parser(wanted)
                parser.counters.add(channel.parser.counters)
                channel.parser = parser

    def channel(self, source: Address) -> Channel:
        """The channel of one address."""
        if not self.listens:
            if source != self._source:  # a new connection: drop the incomplete frame of the last one
                self._source = source
                self.connections += 1
                self._only.parser.reset()
            return self._only
        channel = self._channels.get(source)
        if channel is None:
            if len(self._channels) < MOST_SOURCES:
                parser = Parser(self._wanted)
            else:  # reused: a new one costs as much as parsing a hundred frames, too much in a flood
                parser = self._channels.popitem(last=False)[1].parser
                parser.reset()
            channel = self._channels[source] = Channel(self, source, parser)
        elif len(self._channels) > 1:
            self._channels.move_to_end(source)
        return channel

    def heard(self, channel: Channel, now: float) -> bool:
        """Note a heartbeat. On a listening link the channel becomes a peer, up to MOST_PEERS. True if it is new."""
        if channel.heard_at > NEVER or not self.listens:
            channel.heard_at = now
            return False
        if sum(1 for _ in self.peers()) >= MOST_PEERS:
            return False
        channel.heard_at = now
        return True

    def peers(self) -> Iterator[Channel]:
        """The channels that get messages from us."""
        return (c for c in self._channels.values() if c.heard_at > NEVER or not self.listens)

    def channels(self) -> Iterator[Channel]:
        """All channels."""
        return iter(self._channels.values())

    def is_peer(self, channel: Channel) -> bool:
        """Whether we send to this channel, and accept its requests."""
        return channel.heard_at > NEVER or not self.listens

    def is_active(self, source: Address) -> bool:
        """Whether valid frames arrive from this address. A server with too many clients drops others first."""
        channel = self._channels.get(source)
        return channel is not None and (channel.active_at > NEVER or channel.parser.counters.frames != channel.frames)

    def forget_silent(self, now: float) -> None:
        """Drop the peers that are silent for PEER_SILENCE, with their requested intervals. Called once a second."""
        for channel in self._channels.values():
            if channel.parser.counters.frames != channel.frames:
                channel.frames, channel.active_at = channel.parser.counters.frames, now
            elif now - channel.active_at > ACTIVE:
                channel.active_at = NEVER
            if now - channel.heard_at > PEER_SILENCE:
                channel.heard_at, channel.interval = NEVER, None if self.listens else channel.interval

    def totals(self) -> Counters:
        """The counters of all channels, added up."""
        total = Counters()
        for channel in self._channels.values():
            total.add(channel.parser.counters)
        return total

    def log_silence(self) -> None:
        """Log that no autopilot was heard on this link, and what was received."""
        got = self.totals()
        received = (
            f"{got.frames} MAVLink frames"
            if got.frames
            else f"{got.garbage_bytes} bytes that are not MAVLink"
            if got.garbage_bytes
            else "no MAVLink"
        )
        log.warning("no autopilot heard yet, %s: %s so far", self.link.text, received)

    def log_counters(self) -> None:
        """Log the totals of this link."""
        got = self.totals()
        log.info(
            "%s: %d frames, %d lost, %d with a bad CRC, %d with an unknown id, %d bytes of garbage, "
            "%d datagrams dropped; sent %d bytes unasked, %d messages held back",
            self.link.text,
            got.frames,
            got.lost,
            sum(got.bad_crc.values()),
            sum(got.unknown.values()),
            got.garbage_bytes,
            self.link.dropped,
            self.speech.said,
            self.speech.withheld,
        )
