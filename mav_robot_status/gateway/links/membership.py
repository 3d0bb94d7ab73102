"""Which links are open, which channels lead where, and which vehicles are heard on them."""

from __future__ import annotations

import logging
from contextlib import ExitStack
from itertools import count
from typing import TYPE_CHECKING, Final

from ...interface import Audience
from .endpoint import Endpoint

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from ...config import Config, LinkConfig
    from ...hardware.mavlink.belief import Belief
    from ...hardware.mavlink.vehicle import TrackedVehicle
    from .channel import Channel

    Ids = tuple[int, int]

log = logging.getLogger(__name__)

NONE: Final[frozenset[tuple[int, int]]] = frozenset()


class Membership:
    """The open links of one gateway: first those to vehicles, then the outs."""

    def __init__(self) -> None:
        self.endpoints: list[Endpoint] = []
        self.beliefs: dict[Ids, Belief] = {}
        """Who speaks with the ids of each vehicle. The hardware interface fills it."""
        self.has_passive = False
        """Whether nothing may be sent on one of the links."""
        self._peers: tuple[Channel, ...] | None = None
        self._audiences: tuple[Audience, ...] | None = None

    # links

    def close_others(self, config: Config) -> list[Endpoint]:
        """Close the links that a configuration lacks, and forget the vehicles heard only on them. Returns them."""
        kept, others = self._matched(config)
        self.endpoints = [endpoint for endpoint in kept if endpoint is not None]
        close(others)
        self.forget_peers()
        for belief in self.beliefs.values():
            belief.keep(lambda channel: channel.endpoint in self.endpoints)
        return others

    def open(self, config: Config) -> None:
        """Open the links that are new in a configuration: the outs first, the links to vehicles last.

        Raises LinkError, UsageError.
        """
        keep_all = config.forward or config.record is not None
        kept, _ = self._matched(config)
        opened = []
        rows = zip(count(), _wanted(config), kept, strict=False)
        for number, (link, is_out), endpoint in sorted(rows, key=lambda row: not row[1][1]):
            if endpoint is not None:
                endpoint.adjust(link, number, keep_all=keep_all)
            else:
                opened.append(Endpoint(link, is_out, number, keep_all=keep_all))
                self.endpoints.append(opened[-1])
        self.endpoints.sort(key=lambda endpoint: endpoint.number)
        for endpoint in sorted(opened, key=lambda endpoint: endpoint.number):
            log.info("%s%s", endpoint.link.text, " (passive)" if endpoint.passive else "")
        self.has_passive = any(endpoint.passive for endpoint in self.endpoints)
        self.forget_peers()

    def _matched(self, config: Config) -> tuple[list[Endpoint | None], list[Endpoint]]:
        """The open link for each one that a configuration wants, and the other open links."""
        others = list(self.endpoints)
        return [_take_out(others, link.url, is_out) for link, is_out in _wanted(config)], others

    # channels

    def peers(self) -> tuple[Channel, ...]:
        """The channels to which frames may be forwarded; the same tuple while they are the same."""
        if self._peers is None:
            self._peers = tuple(channel for endpoint in self.endpoints for channel in endpoint.peers())
        return self._peers

    def audiences(self) -> Sequence[Audience]:
        """The receivers of statuses: peers and outs. Not serial vehicle links: autopilots drop unknown ids."""
        if self._audiences is None:
            self._audiences = tuple(
                Audience(channel, channel.interval, endpoint.is_out, None if endpoint.is_out else channel.systems)
                for endpoint in self.endpoints
                if endpoint.gets_statuses
                for channel in endpoint.peers()
            )
        return self._audiences

    def forget_peers(self) -> None:
        """Note that the peers, or the intervals that they want, are others than before."""
        self._peers = self._audiences = None

    def note_heartbeat(self, channel: Channel, now: float) -> None:
        """Note a heartbeat: of an autopilot, or of any component on an out."""
        if channel.endpoint.heard(channel, now):
            self.forget_peers()

    # vehicles

    def heard_vehicle(self, ids: Ids, channel: Channel, now: float) -> None:
        """Note a heartbeat of a vehicle on this channel."""
        self.note_heartbeat(channel, now)
        channel.systems.add(ids[0])

    def place(self, vehicles: Iterable[TrackedVehicle], now: float) -> None:
        """Note on which channels these vehicles are heard, and forget silent peers. Called once a second."""
        for endpoint in self.endpoints:
            endpoint.forget_silent(now)
            for channel in endpoint.channels():
                channel.systems.clear()
                channel.quiet = False
        self.forget_peers()
        for tracked in vehicles:
            path = None if tracked.ids is None else self.channel_of(tracked.ids)
            if path is not None and tracked.costly:
                path.quiet = True
            elif path is not None and tracked.ids is not None:
                path.systems.add(tracked.ids[0])

    def channel_of(self, ids: Ids) -> Channel | None:
        """The channel on which a vehicle is best reached; None if it was not heard."""
        belief = self.beliefs.get(ids)
        return None if belief is None else belief.channel

    def vehicles(self) -> frozenset[Ids]:
        """The ids of the vehicles that are heard on a link."""
        return frozenset(ids for ids, belief in self.beliefs.items() if belief.channel is not None)

    def vehicles_on(self, endpoint: Endpoint) -> list[Ids]:
        """The ids of the vehicles that are heard on a link."""
        found = ((ids, belief.channel) for ids, belief in self.beliefs.items())
        return [ids for ids, channel in found if channel is not None and channel.endpoint is endpoint]

    def passive_vehicles(self) -> frozenset[Ids]:
        """The vehicles on passive links. Nothing may be sent to them."""
        if not self.has_passive:
            return NONE
        return frozenset(ids for ids, b in self.beliefs.items() if b.channel is None or b.channel.passive)

    def reconnected(self, endpoint: Endpoint) -> None:
        """Note that a link has a new connection."""
        for belief in self.beliefs.values():
            belief.reconnected(lambda channel: channel.endpoint is endpoint)


def close(endpoints: Iterable[Endpoint]) -> None:
    """Close links, and log their counters."""
    with ExitStack() as steps:  # close all, even if one raises
        for endpoint in endpoints:
            steps.callback(endpoint.link.close)
            steps.callback(endpoint.log_counters)


def _wanted(config: Config) -> list[tuple[LinkConfig, bool]]:
    """The links of a configuration, each with whether it is an out."""
    return [*((link, False) for link in config.links), *((out, True) for out in config.outs)]


def _take_out(endpoints: list[Endpoint], url: str, is_out: bool) -> Endpoint | None:
    """The endpoint of this connection, removed from the list."""
    found = next((s for s in endpoints if s.url == url and s.is_out is is_out), None)
    if found is not None:
        endpoints.remove(found)
    return found
