"""All live links: receive on them, forward, and send under our identity."""

from __future__ import annotations

import itertools
import logging
from contextlib import ExitStack
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

from ..config import Config
from ..hardware.mavlink.message_table import COMMAND_IDS, WANTED_IDS
from ..hardware.mavlink.state.claims import Claims
from ..interface import Audience
from ..mavlink.commands import HEARTBEAT, ROBOT_STATUS, answer
from ..mavlink.signing import Verdict
from .endpoint import Endpoint
from .routing import Router
from .sender import Sender

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from ..clock import Instant
    from ..hardware.mavlink.vehicle import TrackedVehicle
    from ..links.base import Address
    from ..mavlink.framing import Frame
    from .endpoint import Channel
    from .observer import Observer

log = logging.getLogger(__name__)

NONE: Final[frozenset[tuple[int, int]]] = frozenset()
BATCH: Final = 64
"""Pieces read before parsing. Bounds the memory in a flood of long pieces."""
SETUP_SIGNING: Final = 256
"""This message contains a key. It is never forwarded."""


class LinkHub:
    """The links of one gateway and the channels on them. It is the `MavlinkPort` of the publishers."""

    def __init__(self, config: Config, clock: Callable[[], Instant], observers: Sequence[Observer] = ()) -> None:
        """Open everything. Raises LinkError, UsageError."""
        self._observers = observers
        self.config = Config()
        self.sender = Sender(clock)
        self.offered: frozenset[int]
        """The messages that a consumer can request from us."""
        self.claims: dict[tuple[int, int], Claims[Channel]] = {}
        """Who speaks with the ids of each vehicle. The hardware interface fills it."""
        self.needs_turn = False
        """True if something was received that needs a turn at once. The hardware interface resets it."""
        self.endpoints: list[Endpoint] = []
        self._requests: set[tuple[Channel, int]] = set()
        self._channels: tuple[Channel, ...] | None = None
        """The channels to which frames may be forwarded. None: not collected yet."""
        self._router: Router[Channel] | None = None
        self._keep_all = False
        try:
            self.change(config)
        except BaseException:  # after an error nothing stays open
            for endpoint in self.endpoints:
                endpoint.link.close()
            self.sender.close()
            raise

    def change(self, config: Config) -> None:
        """Open the new links of this configuration, close those that it lacks, keep the others with their peers.

        Raises LinkError, UsageError. After an error some links are closed: change back.
        """
        before, self.config = self.config, config
        self.offered = frozenset({HEARTBEAT} if config.identity.heartbeat else ())
        self._keep_all = config.forward or config.record is not None
        places = [*((link, False) for link in config.links), *((out, True) for out in config.outs)]
        rest = list(self.endpoints)
        kept = [_take_out(rest, link.url, is_out) for link, is_out in places]
        self.endpoints = [endpoint for endpoint in kept if endpoint is not None]
        self._close(rest)
        if not config.forward or self._router is None or rest:
            self._router = Router() if config.forward else None
        self.sender.change(config, before)
        for number, ((link, is_out), endpoint) in enumerate(zip(places, kept, strict=True)):
            if endpoint is not None:
                endpoint.adjust(link, number, keep_all=self._keep_all)
                continue
            endpoint = Endpoint(link, is_out, number, keep_all=self._keep_all)
            self.endpoints.append(endpoint)
            log.info("%s%s", endpoint.link.text, " (passive)" if endpoint.passive else "")
        self.endpoints.sort(key=lambda endpoint: endpoint.number)

    def _close(self, endpoints: list[Endpoint]) -> None:
        """Close links, and forget the vehicles heard only on them."""
        self._close_links(endpoints)
        self._channels = None
        self._requests = {(channel, ids) for channel, ids in self._requests if channel.endpoint in self.endpoints}
        for claims in self.claims.values():
            claims.keep(lambda channel: channel.endpoint in self.endpoints)

    def _close_links(self, endpoints: list[Endpoint]) -> None:
        with ExitStack() as steps:  # close all, even if one raises
            for endpoint in endpoints:
                steps.callback(endpoint.link.close)
                steps.callback(endpoint.log_counters)

    # receiving

    def receive(self, endpoint: Endpoint, now: Instant, limit: int = BATCH) -> list[tuple[Frame, Channel]]:
        """Receive on a link. Returns the frames that a status needs, each with its channel.

        Reads at most `limit` datagrams, or BATCH pieces of a stream. A limit of 1 makes a single system call.
        """
        heard: list[tuple[Frame, Channel]] = []
        link = endpoint.link
        while limit > 0:
            pieces: Sequence[tuple[bytes, Address]] = link.receive(limit if limit < BATCH else BATCH)
            limit = limit - BATCH if len(pieces) == BATCH and not link.stream else 0
            if self._observers:
                self._observe(pieces, now)
            if len(pieces) > 1 and not self._keep_all:
                pieces = _joined(pieces)
            for data, source in pieces:
                channel = endpoint.channel(source, now.mono)
                if channel is not None:
                    frames = channel.parser.feed(data)
                else:
                    channel, frames = endpoint.hear_stranger(data, source, now.mono)
                    if channel is None:
                        continue
                if self._keep_all:
                    self._record_and_forward(data, frames, channel, now)
                    frames = [frame for frame in frames if frame.message_id in WANTED_IDS]
                for frame in frames:
                    if self._accepts(frame, channel, now):
                        heard.append((frame, channel))
        if link.stream and link.due() <= now.mono:  # the connection has ended
            self.needs_turn = True
        return heard

    def _observe(self, pieces: Sequence[tuple[bytes, Address]], now: Instant) -> None:
        for observer in self._observers:
            for data, source in pieces:
                observer.on_data(data, source, now)

    def _accepts(self, frame: Frame, channel: Channel, now: Instant) -> bool:
        """Whether the hardware interface gets this frame. Handles commands to us."""
        signing_policy = self.sender.signing_policy
        verdict = None if signing_policy is None else signing_policy.judge(frame, now)
        if verdict is not None and verdict not in (Verdict.VERIFIED, Verdict.LET_THROUGH):
            if frame.message_id == HEARTBEAT and signing_policy and signing_policy.may_heal(verdict, now.mono):
                self.sender.send_heartbeat(channel, frame.ids[0])
            return False
        endpoint = channel.endpoint
        if frame.message_id == HEARTBEAT:
            self.sender.component.observe(frame)
            if endpoint.is_out:
                self._note_heartbeat(channel, now.mono)
        elif frame.message_id in COMMAND_IDS:
            if channel.is_peer and verdict in (None, Verdict.VERIFIED):
                self._handle_command(frame, channel)
            if endpoint.is_out:
                return self._router is not None  # a command that is forwarded to a vehicle
        if endpoint.is_out:
            return False
        if verdict is not None and (claims := self.claims.get(frame.ids)) is not None:
            if verdict is not Verdict.VERIFIED:
                return not claims.is_signed(now.mono)
            claims.verified(channel, now.mono)  # its time stamp proves that it is newer than all before, on every way
        return True

    def way_of(self, ids: tuple[int, int]) -> Channel | None:
        """The channel that counts for a vehicle; None if it was not heard."""
        claims = self.claims.get(ids)
        return None if claims is None else claims.way

    def vehicles(self) -> frozenset[tuple[int, int]]:
        """The ids of the vehicles that are heard on a link."""
        return frozenset(ids for ids, claims in self.claims.items() if claims.way is not None)

    def heard_vehicle(self, channel: Channel, now: float) -> None:
        """Note a heartbeat of a vehicle on this channel, which is its selected way."""
        self._note_heartbeat(channel, now)

    def _note_heartbeat(self, channel: Channel, now: float) -> None:
        if channel.endpoint.heard(channel, now):
            self._channels = None

    def _handle_command(self, frame: Frame, channel: Channel) -> None:
        """Handle a command that is addressed to us, and acknowledge it."""
        gets_statuses = self._gets_statuses(channel.endpoint)
        offered = self.offered if gets_statuses else self.offered - {ROBOT_STATUS}
        found = answer(frame.message, frame.ids, self.sender.component.speaks_as, channel.interval, offered)
        if found is None:
            return
        for reply in found.replies:
            self.send_to(channel, reply, found.system)
        channel.interval = found.interval
        if found.once == HEARTBEAT:
            self.sender.send_heartbeat(channel, found.system)
        elif found.once == ROBOT_STATUS:
            vehicles = {system for system, _ in self.vehicles()}
            self.needs_turn = True
            self._requests |= {(channel, v) for v in vehicles if self.sender.component.system_for(v) == found.system}

    def _record_and_forward(self, data: bytes, frames: list[Frame], channel: Channel, now: Instant) -> None:
        """Record frames, and forward them by MAVLink's routing rules."""
        recorder = self.sender.recorder
        if recorder is not None:
            for frame in frames:
                recorder.write(now.unix_us, frame.raw)
        if self._router is None or not channel.is_peer:
            return
        frames = [frame for frame in frames if frame.message_id != SETUP_SIGNING]
        if self._channels is None:
            self._channels = tuple(channel for endpoint in self.endpoints for channel in endpoint.peers())
        whole = b"" if channel.endpoint.link.stream else data
        for part, targets in self._router.plan(whole, frames, channel, self._channels, now.mono):
            for target in targets:
                target.send(part)

    # sending

    def passive_vehicles(self) -> frozenset[tuple[int, int]]:
        """The vehicles on passive links. Nothing may be sent to them."""
        if not any(endpoint.passive for endpoint in self.endpoints):
            return NONE
        return frozenset(ids for ids, claims in self.claims.items() if claims.way is None or claims.way.passive)

    def audiences(self) -> list[Audience]:
        """The receivers of statuses: peers and outs. Not serial vehicle links: autopilots drop unknown ids."""
        return [
            Audience(channel, channel.interval, mirror=endpoint.is_out)
            for endpoint in self.endpoints
            if self._gets_statuses(endpoint)
            for channel in endpoint.peers()
        ]

    def _gets_statuses(self, endpoint: Endpoint) -> bool:
        return not endpoint.passive and (endpoint.is_out or endpoint.robot_status)

    def requests(self) -> set[tuple[Channel, int]]:
        """`MavlinkPort`: the requests for one status since the last call, as channel and system."""
        requests, self._requests = self._requests, set()
        return requests

    def send(self, message: Any, system: int, audience: Audience) -> None:
        """`MavlinkPort`: send a message about the vehicle with this system id."""
        self.send_to(audience.key, message, system)

    def send_to(self, channel: Any, message: Any, system: int) -> None:
        """Send one message on one channel, with our ids for this system."""
        self.sender.send(channel, message, system)

    def send_heartbeats(self, vehicles: Iterable[TrackedVehicle], now: float) -> None:
        """Send our heartbeat on all links. Called once a second."""
        for endpoint in self.endpoints:
            endpoint.forget_silent(now)
        self._channels = None
        self.sender.send_heartbeats(self.endpoints, vehicles)

    # logging and closing

    @property
    def record_dropped(self) -> int | None:
        """Frames missing in the recording; None if nothing is recorded."""
        return None if self.sender.recorder is None else self.sender.recorder.dropped

    def close(self) -> None:
        """Close the links, and log their counters."""
        with ExitStack() as steps:  # close all, even if one raises
            steps.callback(self._close_links, self.endpoints)
            steps.callback(self.sender.close)
        if unused := sum(claims.unused for claims in self.claims.values()):
            log.info("%d duplicate frames on other paths", unused)

    def log_silence(self) -> None:
        """Log that no autopilot is heard, with a line for each vehicle link."""
        for endpoint in self.endpoints:
            if not endpoint.is_out:
                endpoint.log_silence()
        signing_policy = self.sender.signing_policy
        if signing_policy is not None and (found := signing_policy.summary()):
            log.warning("signing: %s", found)


def _joined(pieces: Sequence[tuple[bytes, Address]]) -> list[tuple[bytes, Address]]:
    """Join consecutive pieces of one address: a parser call costs half as much as a frame."""
    runs = itertools.groupby(pieces, itemgetter(1))
    return [(b"".join([data for data, _ in run]), source) for source, run in runs]


def _take_out(endpoints: list[Endpoint], url: str, is_out: bool) -> Endpoint | None:
    """The endpoint of this connection, removed from the list."""
    found = next((s for s in endpoints if s.url == url and s.is_out is is_out), None)
    if found is not None:
        endpoints.remove(found)
    return found
