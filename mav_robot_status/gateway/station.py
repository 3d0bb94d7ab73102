"""One live link, and a channel for each of its other ends."""

from __future__ import annotations

import math
from collections import OrderedDict
from typing import TYPE_CHECKING, Final

from ..hardware.kinds import WANTED_IDS
from ..link import open_link
from ..link.url import parse
from ..mavlink.counters import Counters
from ..mavlink.framing import Parser

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ..config import LinkConfig
    from ..link.base import Address, Link
    from ..mavlink.encode import Encoder

MOST_SOURCES: Final = 64
"""Channels of one link; the longest silent is let go."""
MOST_PEERS: Final = 8
PEER_SILENCE: Final = 30.0  # s
MUST_SPEAK: Final = frozenset({"udpout", "udpbcast", "tcp"})
"""Kinds of link where nobody knows of us before we have sent something."""
ONE_END: Final = MUST_SPEAK | {"serial"}
NEVER: Final = -math.inf


class Channel:
    """One other end of a link: MAVLink's channel, with sequence numbers of its own. Compared by identity."""

    __slots__ = ("encoders", "heard_at", "interval", "parser", "source", "station")

    def __init__(self, station: Station, source: Address, parser: Parser) -> None:
        self.station = station
        self.source = source
        """Where to send to; None: the link knows."""
        self.parser = parser
        self.heard_at = NEVER
        """When (monotonic seconds) an autopilot's heartbeat last came from here, on an out anybody's."""
        self.interval: float | None = None
        """Seconds between two ROBOT_STATUS, as asked for from here; None: the default, inf: none."""
        self.encoders: dict[int, Encoder] = {}
        """By our system id."""

    @property
    def is_out(self) -> bool:
        """Whether it leads to ground stations rather than to vehicles."""
        return self.station.is_out

    @property
    def passive(self) -> bool:
        """Whether nothing may ever be sent there."""
        return self.station.passive

    def __str__(self) -> str:
        """In words: `10.1.2.3:14550, listening on 0.0.0.0:14550/udp`."""
        text = self.station.link.text
        return f"{self.source[0]}:{self.source[1]}, {text}" if isinstance(self.source, tuple) else text

    def send(self, frame: bytes) -> bool:
        """Send to this end; False if it could not be sent, or nothing may ever be."""
        return not self.station.passive and self.station.link.send(frame, self.source)


class Station:
    """One link with what was heard on it. Bounded, however many addresses there are that send."""

    def __init__(self, config: LinkConfig, is_out: bool = False, number: int = 0, *, keep_all: bool = False) -> None:
        """Open the link. Raises LinkError, UsageError. `keep_all`: the parsers give every frame, to pass it on."""
        url = parse(config.url)
        self.url = config.url
        """As it was configured."""
        self.link: Link = open_link(url)
        self._serial = url.kind == "serial"
        self.number: int
        """Counts the links of a gateway from 0."""
        self.robot_status: bool
        """Whether ROBOT_STATUS is sent here if this is a vehicle's link."""
        self.passive: bool
        self._wanted: frozenset[int] | None = WANTED_IDS
        self._channels: OrderedDict[Address, Channel] = OrderedDict()
        self.adjust(config, number, keep_all=keep_all)
        self.is_out = is_out
        self.must_speak = url.kind in MUST_SPEAK
        self.listens = url.kind not in ONE_END
        """Whether each address that sends is an end of its own; else there is one, whoever answers."""
        self._source: Address = None
        if not self.listens:
            self._only = self._channels[None] = Channel(self, None, Parser(self._wanted))

    def adjust(self, config: LinkConfig, number: int, *, keep_all: bool = False) -> None:
        """What can be changed of an open link: everything but its URL."""
        self.number, self.passive = number, config.passive
        self.robot_status = not self._serial if config.robot_status is None else config.robot_status
        wanted = None if keep_all else WANTED_IDS
        if wanted is not self._wanted:
            self._wanted = wanted
            for channel in self._channels.values():
                parser = Parser(wanted)
                parser.counters.add(channel.parser.counters)
                channel.parser = parser

    def channel(self, source: Address) -> Channel:
        """The channel of what one address sends."""
        if not self.listens:
            if source != self._source:  # another connection: it does not go on where the last one was cut
                self._source = source
                self._only.parser.reset()
            return self._only
        channel = self._channels.get(source)
        if channel is None:
            if len(self._channels) < MOST_SOURCES:
                parser = Parser(self._wanted)
            else:  # used again: making one costs as much as parsing a hundred frames, which a flood must not cause
                parser = self._channels.popitem(last=False)[1].parser
                parser.reset()
            channel = self._channels[source] = Channel(self, source, parser)
        elif len(self._channels) > 1:
            self._channels.move_to_end(source)
        return channel

    def heard(self, channel: Channel, now: float) -> bool:
        """A heartbeat of somebody we speak to: an end of a listening link becomes a peer, unless there are enough.

        True if it is a new one.
        """
        if channel.heard_at > NEVER or not self.listens:
            channel.heard_at = now
            return False
        if sum(1 for _ in self.peers()) >= MOST_PEERS:
            return False
        channel.heard_at = now
        return True

    def peers(self) -> Iterator[Channel]:
        """Those who hear what we have to say."""
        return (c for c in self._channels.values() if c.heard_at > NEVER or not self.listens)

    def channels(self) -> Iterator[Channel]:
        """Every end that was heard, or to which this link sends."""
        return iter(self._channels.values())

    def is_peer(self, channel: Channel) -> bool:
        """Whether we speak to this end, and hence listen to its wishes."""
        return channel.heard_at > NEVER or not self.listens

    def forget_silent(self, now: float) -> None:
        """Peers that have been silent for long are none any more, and what they asked for is over."""
        for channel in self._channels.values():
            if now - channel.heard_at > PEER_SILENCE:
                channel.heard_at, channel.interval = NEVER, None if self.listens else channel.interval

    def totals(self) -> Counters:
        """Everything counted on this link."""
        total = Counters()
        for channel in self._channels.values():
            total.add(channel.parser.counters)
        return total
