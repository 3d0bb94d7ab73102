"""One live link, and a channel for each of its peers."""

from __future__ import annotations

import logging
import shlex
from typing import TYPE_CHECKING, Final

from ...hardware.mavlink.subjects import WANTED_IDS
from ...links.base import IDLE, SPEAKS, STAYS, ServesClients
from ...links.guarded import open_guarded
from ...links.udp import UdpBroadcaster, UdpSender
from ...links.url import host_port, parse
from ...mavlink.counters import Counters
from ...mavlink.framing import Parser
from ...paced_log import PacedLog
from .channel import NEVER, PEER_SILENCE, Channel
from .fair_table import SHARE, FairTable
from .send_budget import LIMIT, SendBudget

if TYPE_CHECKING:
    from collections.abc import Iterator

    from ...config import LinkConfig
    from ...links.base import Address, Link
    from ...mavlink.framing import Frame

log = logging.getLogger(__name__)

MOST_SOURCES: Final = 1024
"""Limit of channels of one link. A newcomer replaces one that is silent, but none on which a vehicle speaks."""
MOST_PEERS: Final = 64
"""Limit of the peers of one link: those who get messages from us."""
ACTIVE: Final = 10.0
"""Seconds since the last valid frame for which a peer counts as active."""


class Endpoint:
    """One link with its channels. Bounded for any number of senders."""

    def __init__(self, config: LinkConfig, is_out: bool = False, number: int = 0, *, keep_all: bool = False) -> None:
        """Open the link. `keep_all`: parse every frame, to forward or record it. Raises LinkError, UsageError."""
        url = parse(config.url)
        self.url = config.url
        """As in the configuration."""
        self.link: Link = open_guarded(url)
        if isinstance(self.link, ServesClients):
            self.link.priority = self.priority
        self.is_serial = url.kind.is_serial
        self.number: int
        """The number of the link in its gateway, from 0."""
        self.robot_status: bool
        """Whether ROBOT_STATUS is sent on this link, if it is a vehicle link."""
        self.passive: bool
        self.heartbeat_timeout: float | None
        """Seconds without a heartbeat after which a vehicle there counts as lost. None: the link does not say."""
        self.budget = SendBudget()
        self._wanted: frozenset[int] | None = WANTED_IDS
        self._table: FairTable[Channel] = FairTable(MOST_SOURCES)
        self._channels = self._table.holders
        self._peers: FairTable[Channel] = FairTable(MOST_PEERS)
        """The peers of a link on which several speak."""
        self._tell_refused = PacedLog(log), PacedLog(log)
        self._not_heard = 0
        """How many senders had no channel before the last line about them."""
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
        self._hears_all = isinstance(self.link, UdpBroadcaster)
        """Whether those who do not get what it sends are heard, too, each on a channel of its own."""
        self._has_turned = False
        """Whether it sends to another channel than when `heard` was called last."""
        if not self.listens:
            self._only = Channel(self, None, Parser(self._wanted))
            self._table.add(self._only)

    def adjust(self, config: LinkConfig, number: int, *, keep_all: bool = False) -> None:
        """Change an open link: everything except its URL."""
        self.number, self.passive = number, config.passive
        self.heartbeat_timeout = config.heartbeat_timeout
        self.robot_status = not self.is_serial if config.robot_status is None else config.robot_status
        default = None if self.is_out else LIMIT
        self.speech_limit = (config.speech_limit or None) if config.speech_limit is not None else default
        self.budget.renew(self.speech_limit)
        wanted = None if keep_all else WANTED_IDS
        if wanted is not self._wanted:
            self._wanted = wanted
            for channel in self._channels.values():
                channel.parser = _renewed(channel.parser, wanted)
            self._scratch = _renewed(self._scratch, wanted)

    @property
    def gets_statuses(self) -> bool:
        """Whether statuses are sent on this link."""
        return not self.passive and (self.is_out or self.robot_status)

    def parse(self, data: bytes, source: Address, now: float) -> tuple[Channel | None, list[Frame]]:
        """The channel of data that was received, and the frames in it. None: it is no MAVLink, or there is no room."""
        channel = self.channel(source, now)
        if channel is None:
            return self.hear_stranger(data, source, now)
        return channel, channel.parser.feed(data)

    def channel(self, source: Address, now: float) -> Channel | None:
        """The channel of one address. None for an address that sent no valid frame yet: see `hear_stranger`."""
        if self.listens:
            channel = self._channels.get(source)
            if channel is not None and len(self._channels) > 1:
                self._channels.move_to_end(source)
            return channel
        if source != self._source:
            if self._asks is not None:
                return self._channel_of_other(source, now) if self._hears_all else None
            self._source = source  # a new connection: drop the incomplete frame of the last one
            self.connections += 1
            self._only.parser.reset()
        self._source_at = now
        return self._only

    def _channel_of_other(self, source: Address, now: float) -> Channel | None:
        """The channel of an address that a broadcast link hears and does not send to. It does if the peer is silent."""
        channel = self._channels.get(source)
        if channel is not None:
            self._channels.move_to_end(source)
            self._turn_to(channel, now)
        return channel

    def _turn_to(self, channel: Channel, now: float) -> None:
        """Send to this address of a broadcast link from now on, unless the present one speaks."""
        asks = self._asks
        if asks is None or not asks.may_answer(channel.source, self._source, now - self._source_at):
            return
        asks.answered(channel.source)
        before, self._only = self._only, channel
        before.is_peer, before.interval, channel.is_peer = False, None, True
        self._table.remove(None)  # what was there before anybody answered
        self._source, self._source_at, self._has_turned = channel.source, now, True

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
        if self._asks is not None and not self._hears_all:
            if not self._asks.may_answer(source, self._source, now - self._source_at):
                return None
            self._asks.answered(source)
            self._source, self._source_at = source, now
            self._only.parser, self._scratch = self._scratch, self._only.parser
            return self._only
        room, gone = self._table.make_room(source, now)
        if not room:
            return None
        channel = Channel(self, source, self._scratch)
        channel.is_peer = False
        self._table.add(channel)
        if gone is None:
            self._scratch = Parser(self._wanted)
        else:  # a new one costs as much as parsing a hundred frames, too much in a flood
            self._scratch = gone.parser
            self._peers.remove(gone.source)
        self._turn_to(channel, now)
        return channel

    def heard(self, channel: Channel, now: float) -> bool:
        """Note a heartbeat. On a listening link the channel becomes a peer, up to MOST_PEERS.

        A peer that is silent gives its place to one that speaks. True if `peers` are others than before.
        """
        channel.hear(now)
        if not self.listens:
            turned, self._has_turned = self._has_turned, False
            return turned
        if channel.is_peer:
            return False
        room, gone = self._peers.make_room(channel.source, now)
        if gone is not None:
            gone.is_peer, gone.interval = False, None
        if room:
            self._peers.add(channel)
            channel.is_peer = True
        return room

    def peers(self) -> Iterator[Channel]:
        """The channels that get messages from us."""
        return iter(self._peers.holders.values() if self.listens else (self._only,))

    def channels(self) -> Iterator[Channel]:
        """All channels."""
        return iter(self._channels.values())

    def priority(self, source: Address) -> int:
        """How important a client is, see `ServesClients`. One on which an autopilot speaks keeps its place."""
        channel = self._channels.get(source)
        if channel is None:
            return IDLE
        if channel.heard_at > NEVER:
            return STAYS
        return SPEAKS if channel.active_at > NEVER or channel.parser.counters.frames != channel.frames else IDLE

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
                    self._peers.remove(channel.source)
        self._log_refused(now)

    def _log_refused(self, now: float) -> None:
        """Log how many have no channel, and how many are no peers, because there are too many."""
        tables = (self._table, "not heard"), (self._peers, "neither answered nor forwarded")
        for (table, what), tell in zip(tables, self._tell_refused, strict=True):
            if now >= tell.due and table is self._table:
                self._not_heard = len(table.refused)
            if table.refused and now >= tell.due:
                number = f"{len(table.refused)} sender{'s are' if len(table.refused) > 1 else ' is'} {what}"
                room = f"there is room for {table.most}, and for {table.most // SHARE} at one address"
                line = f"{self.link.text}: {number}, {_where(next(iter(table.refused)))} for one: {room}"
                tell(logging.WARNING, now, line)
                table.refused.clear()

    @property
    def left_out(self) -> int:
        """How many senders have no channel, because there are too many, lately."""
        return max(len(self._table.refused), self._not_heard)

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
            "%d datagrams dropped; sent %s; %s",
            self.link.text,
            got.frames,
            got.lost,
            sum(got.bad_crc.values()),
            sum(got.unknown.values()),
            got.garbage_bytes,
            self.link.dropped,
            _kilobytes(self.budget.sent),
            f"{self.budget.withheld} messages had to wait" if self.budget.withheld else "no message had to wait",
        )


def _renewed(parser: Parser, wanted: frozenset[int] | None) -> Parser:
    """A parser for other messages, with the same counters."""
    new = Parser(wanted)
    new.counters.add(parser.counters)
    return new


def _kilobytes(number: int) -> str:
    return f"{number} bytes" if number < 1000 else f"{number / 1000:.0f} kB"


def _where(source: Address) -> str:
    return host_port(*source[:2]) if isinstance(source, tuple) else str(source)
