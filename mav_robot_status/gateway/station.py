"""One live link and who is on it."""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Final

from ..hardware.robot_hw import WANTED_IDS
from ..link import open_link
from ..link.url import parse
from ..mavlink.framing import Counters, Parser

if TYPE_CHECKING:
    from ..config import LinkConfig
    from ..link.base import Address, Link

MOST_SOURCES: Final = 64
"""Addresses on one link whose cut frames are put together; the longest silent is let go."""
MOST_PEERS: Final = 8
PEER_SILENCE: Final = 30.0  # s
SPEAKS_FIRST: Final = frozenset({"udpout", "udpbcast", "tcp"})


class Station:
    """One link with what was heard on it. Bounded, however many addresses there are that send."""

    def __init__(self, config: LinkConfig, is_out: bool) -> None:
        """Open the link. Raises LinkError, UsageError."""
        url = parse(config.url)
        self.link: Link = open_link(url)
        self.passive = config.passive
        self.is_out = is_out
        self.listens = url.kind not in SPEAKS_FIRST
        self.peers: OrderedDict[Address, float] = OrderedDict()
        """Addresses of autopilots and when they were last heard."""
        self._parsers: OrderedDict[Address, Parser] = OrderedDict()

    def parser(self, source: Address) -> Parser:
        """The parser of what one address sends."""
        parser = self._parsers.get(source)
        if parser is None:
            if len(self._parsers) < MOST_SOURCES:
                parser = Parser(WANTED_IDS)
            else:  # used again: making one costs as much as parsing a hundred frames, which a flood must not cause
                parser = self._parsers.popitem(last=False)[1]
                parser.reset()
            self._parsers[source] = parser
        elif len(self._parsers) > 1:
            self._parsers.move_to_end(source)
        return parser

    def heard_autopilot(self, source: Address, now: float) -> None:
        """An address that sends an autopilot's heartbeat is a peer, unless there are enough."""
        if source in self.peers or len(self.peers) < MOST_PEERS:
            self.peers[source] = now

    def forget_silent(self, now: float) -> None:
        """Peers that have been silent for long are none any more."""
        for source in [s for s, at in self.peers.items() if now - at > PEER_SILENCE]:
            del self.peers[source]

    def send(self, frame: bytes) -> None:
        """Send to everyone here who listens."""
        if self.passive:
            return
        if not self.listens:
            self.link.send(frame)
            return
        for source in self.peers:
            self.link.send(frame, source)

    def answer(self, frame: bytes, source: Address) -> None:
        """Send to one address that was heard here."""
        if not self.passive:
            self.link.send(frame, source if self.listens else None)

    def totals(self) -> Counters:
        """Everything counted on this link."""
        total = Counters()
        for parser in self._parsers.values():
            total.add(parser.counters)
        return total
