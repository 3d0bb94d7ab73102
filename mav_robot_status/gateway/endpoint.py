"""One live link, and a channel for each of its peers."""

from __future__ import annotations

import logging
import math
import shlex
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

from ..hardware.mavlink.message_table import IDS_WITH_FILES, WANTED_IDS
from ..links.base import ServesClients
from ..links.guarded import open_guarded
from ..links.udp import UdpSender
from ..links.url import parse
from ..mavlink.counters import Counters
from ..mavlink.framing import Parser
from .speech import LIMIT, Speech

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..config import LinkConfig
    from ..links.base import Address, Link
    from ..mavlink.encode import Encoder
    from ..mavlink.framing import Frame

log = logging.getLogger(__name__)

MOST_SOURCES: Final = 64
"""Limit of channels of one link. A newcomer replaces the one silent longest, but none on which a vehicle speaks."""
MOST_PEERS: Final = 8
PEER_SILENCE: Final = 30.0
"""Seconds of silence after which a peer is forgotten."""
NEWCOMER_SILENCE: Final = 5.0
"""Seconds for which a silent newcomer keeps its place. A peer that has spoken for longer keeps it for that time."""
ACTIVE: Final = 10.0
"""Seconds since the last valid frame for which a peer counts as active."""
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

    def hear_files(self, on: bool) -> None:
        """Start or stop using messages that bring files. May be repeated: the channel may have another parser now."""
        self.wanted = IDS_WITH_FILES if on else WANTED_IDS
        self.parser.want(self.wanted)

    def gives_way(self, now: float) -> bool:
        """Whether it gives up its place to another, because no vehicle speaks on it."""
        spoken = max(NEWCOMER_SILENCE, self.heard_at - self.since)
        return now - self.heard_at > min(spoken, PEER_SILENCE)

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
        """Open the link. `keep_all`: parse every frame, to forward or record it. Raises LinkError, UsageError."""
        url = parse(config.url)
        self.url = config.url
        """As in the configuration."""
        self.link: Link = open_guarded(url)
        if isinstance(self.link, ServesClients):
            self.link.is_active = self.is_active
        self.is_serial = url.kind.is_serial
        self.number: int
        """The number of the link in its gateway, from 0."""
        self.robot_status: bool
        """Whether ROBOT_STATUS is sent on this link, if it is a vehicle link."""
        self.passive: bool
        self.heartbeat_timeout: float | None
        """Seconds without a heartbeat after which a vehicle there counts as lost. None: the link does not say."""
        self.speech = Speech()
        self._wanted: frozenset[int] | None = WANTED_IDS
        self._channels: OrderedDict[Address, Channel] = OrderedDict()
        self._scratch = Parser(self._wanted)
        """Parses the first bytes of an address. Only a valid frame gives it a channel."""
        self._stranger: Address = None
        """The address whose bytes `_scratch` has."""
        self.is_out = is_out
        self.adjust(config, number, keep_all=keep_all)
        self.must_speak = url.kind.speaks_first
        self.listens = url.kind.listens
        """Whether each source address is a peer. Otherwise the link has one peer, whatever the address."""
        self._source: Address = None
        """The address of the one peer."""
        self.connections = 0
        """How many connections a link with one peer has had."""
        self._source_at = NEVER
        self._asks = self.link if isinstance(self.link, UdpSender) else None
        """A link that sends to one peer and receives datagrams of any address."""
        if not self.listens:
            self._only = self._channels[None] = Channel(self, None, Parser(self._wanted))

    def adjust(self, config: LinkConfig, number: int, *, keep_all: bool = False) -> None:
        """Change an open link: everything except its URL."""
        self.number, self.passive = number, config.passive
        self.heartbeat_timeout = config.heartbeat_timeout
        self.robot_status = not self.is_serial if config.robot_status is None else config.robot_status
        default = None if self.is_out else LIMIT
        self.speech_limit = (config.speech_limit or None) if config.speech_limit is not None else default
        self.speech.renew(self.speech_limit)
        wanted = None if keep_all else WANTED_IDS
        if wanted is not self._wanted:
            self._wanted = wanted
            for channel in self._channels.values():
                channel.parser = _renewed(channel.parser, wanted)
            self._scratch = _renewed(self._scratch, wanted)

    def channel(self, source: Address, now: float) -> Channel | None:
        """The channel of one address. None for an address that sent no valid frame yet: see `hear_stranger`."""
        if self.listens:
            channel = self._channels.get(source)
            if channel is not None and len(self._channels) > 1:
                self._channels.move_to_end(source)
            return channel
        if source != self._source:
            if self._asks is not None:
                return None
            self._source = source  # a new connection: drop the incomplete frame of the last one
            self.connections += 1
            self._only.parser.reset()
        self._source_at = now
        return self._only

    def hear_stranger(self, data: bytes, source: Address, now: float) -> tuple[Channel | None, list[Frame]]:
        """Parse data of an address without a channel. A valid frame gives it one, if there is a place."""
        parser = self._scratch
        if source != self._stranger:
            self._stranger = source
            parser.reset()
        before = parser.counters.frames
        frames = parser.feed(data)
        if parser.counters.frames == before:
            return None, []
        channel = self._admit(source, now)
        return channel, frames if channel is not None else []

    def _admit(self, source: Address, now: float) -> Channel | None:
        """A channel for an address that speaks MAVLink. It gets the parser of its first bytes."""
        self._stranger = None
        if self._asks is not None:
            if not self._asks.may_answer(source, self._source, now - self._source_at):
                return None
            self._asks.answered(source)
            self._source, self._source_at = source, now
            self._only.parser, self._scratch = self._scratch, self._only.parser
            return self._only
        spare = None  # reused: a new one costs as much as parsing a hundred frames, too much in a flood
        if len(self._channels) >= MOST_SOURCES:
            oldest = next((key for key, channel in self._channels.items() if channel.gives_way(now)), None)
            if oldest is None:
                return None
            spare = self._channels.pop(oldest).parser
        channel = self._channels[source] = Channel(self, source, self._scratch)
        self._scratch = spare or Parser(self._wanted)
        return channel

    def heard(self, channel: Channel, now: float) -> bool:
        """Note a heartbeat. On a listening link the channel becomes a peer, up to MOST_PEERS. True if it is new.

        A peer that is silent gives its place to one that speaks.
        """
        if now - channel.heard_at > PEER_SILENCE:
            channel.since = now
        channel.heard_at = now
        if channel.is_peer:
            return False
        peers = list(self.peers())
        if len(peers) >= MOST_PEERS:
            silent = min(peers, key=lambda peer: peer.heard_at)
            if not silent.gives_way(now):
                return False
            silent.is_peer, silent.interval = False, None
        channel.is_peer = True
        return True

    def peers(self) -> Iterator[Channel]:
        """The channels that get messages from us."""
        return (channel for channel in self._channels.values() if channel.is_peer)

    def channels(self) -> Iterator[Channel]:
        """All channels."""
        return iter(self._channels.values())

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
                channel.heard_at = NEVER
                if self.listens:
                    channel.is_peer, channel.interval = False, None

    def totals(self) -> Counters:
        """The counters of all channels, added up."""
        total = Counters()
        for parser in (self._scratch, *(channel.parser for channel in self._channels.values())):
            total.add(parser.counters)
        return total

    def log_silence(self) -> None:
        """Log that no autopilot was heard on this link, what was received, and the command that finds the cause."""
        got = self.totals()
        received = (
            f"{got.frames} MAVLink frames"
            if got.frames
            else f"{got.garbage_bytes} bytes that are not MAVLink"
            if got.garbage_bytes
            else "no MAVLink"
        )
        log.warning(
            "no autopilot heard yet, %s: %s so far; to find out why, stop this and run: mav-robot-status doctor %s",
            self.link.text, received, shlex.quote(self.url),
        )  # fmt: skip

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


def _renewed(parser: Parser, wanted: frozenset[int] | None) -> Parser:
    """A parser for other messages, with the same counters."""
    new = Parser(wanted)
    new.counters.add(parser.counters)
    return new
