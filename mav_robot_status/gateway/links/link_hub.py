"""All live links: receive on them, forward, and send under our identity."""

from __future__ import annotations

import itertools
import logging
from contextlib import ExitStack
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from ...config import Config
from ...hardware.mavlink.belief import Belief
from ...hardware.mavlink.identity import is_autopilot
from ...hardware.mavlink.message_table import COMMAND_IDS
from ...interface import Audience
from ...mavlink.commands import HEARTBEAT, ROBOT_STATUS, answer
from ...mavlink.framing import Frame
from ...mavlink.signing import ACCEPTED, Verdict
from .arrival import BATCH, USUAL, Arrivals, Pause
from .endpoint import Endpoint
from .routing import Router
from .sender import Sender, speaks_for
from .signing_policy import proof

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from ...clock import Instant
    from ...hardware.mavlink.requests.scheduler import Ask
    from ...hardware.mavlink.vehicle import TrackedVehicle
    from ...links.base import Address
    from ..observer import Observer
    from .channel import Channel

    Heard = list[tuple[Frame, Channel]]

log = logging.getLogger(__name__)

new: Final = tuple.__new__  # as in `framing`
NONE: Final[frozenset[tuple[int, int]]] = frozenset()
REQUEST_SIZE: Final = 45  # bytes of a COMMAND_LONG
STREAMED: Final = 40
"""Bytes of a stream that count as one datagram: a usual frame."""
SETUP_SIGNING: Final = 256
"""This message contains a key. It is never recorded or forwarded."""


class LinkHub:
    """The links of one gateway and the channels on them. It is the `MavlinkPort` of the publishers."""

    def __init__(self, config: Config, clock: Callable[[], Instant], observers: Sequence[Observer] = ()) -> None:
        """Open everything. Raises LinkError, UsageError."""
        self._observers = observers
        self.config = Config()
        self.sender = Sender(clock)
        self.offered: frozenset[int]
        """The messages that a consumer can request from us."""
        self.beliefs: dict[tuple[int, int], Belief] = {}
        """Who speaks with the ids of each vehicle. The hardware interface fills it."""
        self.needs_turn = False
        """True if something was received that needs a turn at once. The hardware interface resets it."""
        self.arrivals = Arrivals()
        self.late = False
        """Whether `receive_late` has to be used: some input may be old."""
        self.endpoints: list[Endpoint] = []
        self._requests: set[tuple[Channel, int]] = set()
        self._channels: tuple[Channel, ...] | None = None
        """The channels to which frames may be forwarded. None: not collected yet."""
        self._audiences: tuple[Audience, ...] | None = None
        """The receivers of statuses. None: not collected yet."""
        self._router: Router[Channel] | None = None
        self._keep_all = False
        self._relays = False
        """Whether all frames are only forwarded: none is recorded, and none needs a signature."""
        self.has_passive = False
        """Whether nothing may be sent on one of the links."""
        self.is_plain = False
        """Whether `receive_one` may be used: nobody but the hardware interface sees the frames."""
        self.pieces = 0
        """Datagrams that the last `receive` has read; for a stream, its bytes divided by STREAMED."""
        self.open(config)

    def open(self, config: Config) -> None:
        """Open everything of this configuration: the outs first, the links to vehicles last.

        Raises LinkError, UsageError. After an error nothing stays open.
        """
        try:
            self.change(config)
        except BaseException:
            for endpoint in self.endpoints:
                endpoint.link.close()
            self.endpoints = []
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
        opened = []
        for number, ((link, is_out), endpoint) in sorted(
            enumerate(zip(places, kept, strict=True)), key=lambda row: not row[1][0][1]
        ):
            if endpoint is not None:
                endpoint.adjust(link, number, keep_all=self._keep_all)
                continue
            endpoint = Endpoint(link, is_out, number, keep_all=self._keep_all)
            self.endpoints.append(endpoint)
            opened.append(endpoint)
        self.endpoints.sort(key=lambda endpoint: endpoint.number)
        for endpoint in sorted(opened, key=lambda endpoint: endpoint.number):
            log.info("%s%s", endpoint.link.text, " (passive)" if endpoint.passive else "")
        self._audiences = None
        self.has_passive = any(endpoint.passive for endpoint in self.endpoints)
        unsigned = self.sender.signing_policy is None
        self.is_plain = unsigned and not (self._observers or self._keep_all)
        self._relays = unsigned and self._router is not None and self.sender.recorder is None

    def _close(self, endpoints: list[Endpoint]) -> None:
        """Close links, and forget the vehicles heard only on them."""
        self._close_links(endpoints)
        self._channels = self._audiences = None
        self._requests = {(channel, ids) for channel, ids in self._requests if channel.endpoint in self.endpoints}
        for belief in self.beliefs.values():
            belief.keep(lambda channel: channel.endpoint in self.endpoints)

    def _close_links(self, endpoints: list[Endpoint]) -> None:
        with ExitStack() as steps:  # close all, even if one raises
            for endpoint in endpoints:
                steps.callback(endpoint.link.close)
                steps.callback(endpoint.log_counters)
                self.arrivals.forget(endpoint)

    # receiving

    def receive_one(self, endpoint: Endpoint, now: Instant) -> Sequence[tuple[Frame, Channel]]:
        """As `receive` with a limit of 1, while `is_plain`. Most datagrams arrive alone, and hold nothing of interest.

        Only this path is so short: after a wake-up nearly all code runs from a cold cache.
        """
        link = endpoint.link
        pieces = link.receive(1)
        self.pieces = 1
        if link.stream or not pieces:
            return self.receive(endpoint, now, 1, lambda _: pieces)
        data, source = pieces[0]
        channel = endpoint.channel(source, now.mono)
        if channel is None:
            return self.receive(endpoint, now, 1, lambda _: pieces)
        found: list[Any] = channel.parser.walk(data)
        if not found:
            return ()
        heard: Heard = []
        for values in found:
            self._accept(new(Frame, values), channel, now, heard)
        return heard

    def receive(
        self,
        endpoint: Endpoint,
        now: Instant,
        limit: int = BATCH,
        read: Callable[[int], Sequence[tuple[bytes, Address]]] | None = None,
    ) -> list[tuple[Frame, Channel]]:
        """Receive on a link. Returns the frames that a status needs, each with its channel.

        Reads at most `limit` datagrams of USUAL bytes, or BATCH pieces of a stream. A limit of 1 makes a single system
        call. `read` replaces the `receive` of the link.
        """
        heard: Heard = []
        link = endpoint.link
        read = read or link.receive
        self.pieces = 0
        while True:
            pieces = read(limit if limit < BATCH else BATCH)
            self.pieces += sum(len(data) for data, _ in pieces) // STREAMED if link.stream else len(pieces)
            if self._observers:
                self._observe(pieces, now)
            whole = _joined(pieces) if len(pieces) > 1 and not self._keep_all else pieces
            if self._relays:
                self._relay(pieces, endpoint, now, heard)
            else:
                for data, source in whole:
                    channel = endpoint.channel(source, now.mono)
                    if channel is not None:
                        frames = channel.parser.feed(data)
                    else:
                        channel, frames = endpoint.hear_stranger(data, source, now.mono)
                    if channel is not None:
                        self._hear(data, frames, channel, now, heard)
            if len(pieces) < BATCH:
                self.pieces += not pieces  # the link may have refused some
                break
            limit = 0 if link.stream else limit - max(BATCH, sum(len(data) for data, _ in pieces) // USUAL)
            if limit <= 0:
                self.late = self.arrivals.left(endpoint, pieces, now)
                break
        if link.stream and link.due() <= now.mono:  # the connection has ended
            self.needs_turn = True
        return heard

    def _relay(self, pieces: Sequence[tuple[bytes, Address]], endpoint: Endpoint, now: Instant, heard: Heard) -> None:
        """Forward and hear pieces, while `_relays`. Most hold one frame, which takes a short path.

        It does what `_hear` does, but makes no list and no Frame for a frame that is only forwarded.
        """
        router, mono = self._router, now.mono
        assert router is not None
        for data, source in pieces:
            channel = endpoint.channel(source, mono)
            if channel is None:
                channel, frames = endpoint.hear_stranger(data, source, mono)
                if channel is not None:
                    self._hear(data, frames, channel, now, heard)
                continue
            found: list[Any] = channel.parser.walk(data)
            if len(found) != 1:
                if found:
                    self._hear(data, [new(Frame, values) for values in found], channel, now, heard)
                continue
            values = found[0]
            message_id = values[0]
            if message_id == SETUP_SIGNING:
                continue
            if channel.is_peer:
                channels = self._channels
                if channels is None:
                    channels = self._collect_channels()
                for target in router.destinations(values, channel, channels, mono):
                    target.send(values[4])
            self._accept(new(Frame, values), channel, now, heard)

    def _hear(self, data: bytes, frames: list[Frame], channel: Channel, now: Instant, heard: Heard) -> None:
        """Record and forward the frames of one piece, and add to `heard` those that a status needs."""
        if self._keep_all:
            frames = [frame for frame in frames if frame.message_id != SETUP_SIGNING]
            self._record(frames, now)
        if self.sender.signing_policy is not None:
            frames = self._believed(frames, channel, now)
        if self._keep_all:
            self._forward(data, frames, channel, now)
        for frame in frames:
            self._accept(frame, channel, now, heard)

    def receive_late(
        self, endpoint: Endpoint, now: Instant, limit: int
    ) -> list[tuple[Instant, list[tuple[Frame, Channel]]]]:
        """As `receive`, for input that may be old: groups of frames, each with the time of its arrival."""
        groups, self.late = self.arrivals.receive(endpoint, now, limit)
        found = []
        for at, piece in groups:
            given = [piece]
            found.append((at, self.receive(endpoint, at, 1, lambda _, given=given: given)))  # type: ignore[misc]
        self.needs_turn = True
        return found

    def pause(self, since: Instant, now: Instant, *, stalled: bool) -> None:
        """The look at the links at `now` is late, see `arrival.Pause`."""
        self.arrivals.pause = Pause(since, now, stalled)
        self.late = True

    def _observe(self, pieces: Sequence[tuple[bytes, Address]], now: Instant) -> None:
        for observer in self._observers:
            for data, source in pieces:
                observer.on_data(data, source, now)

    def _believed(self, frames: list[Frame], channel: Channel, now: Instant) -> list[Frame]:
        """The frames that the signing policy accepts. All others have no effect, and are not forwarded."""
        policy = self.sender.signing_policy
        assert policy is not None
        believed = []
        for frame in frames:
            verdict = policy.judge(frame, now)
            if verdict in ACCEPTED:
                believed.append(frame)
            elif frame.message_id == HEARTBEAT and policy.may_heal(verdict, now.mono):
                self.sender.send_heartbeat(channel, frame.ids[0])
        return believed

    def _accept(self, frame: Frame, channel: Channel, now: Instant, heard: Heard) -> None:
        """Add a frame to what the hardware interface gets. Handles commands to us."""
        policy = self.sender.signing_policy
        if policy is not None and not policy.may_speak(frame):
            return
        verdict = None if policy is None else proof(frame)
        endpoint = channel.endpoint
        if frame.message_id == HEARTBEAT:
            self.sender.component.observe(frame)
            if endpoint.is_out:
                self._note_heartbeat(channel, now.mono)
            elif is_autopilot(frame.message, frame.ids[1]):
                channel.hear(now.mono)
        elif frame.message_id in COMMAND_IDS and frame.message is not None:
            if channel.is_peer and verdict in (None, Verdict.VERIFIED):
                self._handle_command(frame, channel)
            if self._is_delivered(frame, channel):
                heard.append((frame, channel))
                return
            frame = frame._replace(message=None)  # its number still counts
        if not endpoint.is_out:
            heard.append((frame, channel))

    def _is_delivered(self, frame: Frame, channel: Channel) -> bool:
        """Whether a command reaches the vehicle: it arrived where the vehicle is heard, or is forwarded there."""
        system = frame.message.target_system
        beliefs = [belief for ids, belief in self.beliefs.items() if ids[0] == system and belief.channel is not None]
        if any(belief.hears(channel) for belief in beliefs):
            return True
        if self._router is None or not channel.is_peer:
            return False
        return not {belief.channel for belief in beliefs}.isdisjoint(self._router.decided(frame, channel))

    def channel_of(self, ids: tuple[int, int]) -> Channel | None:
        """The channel on which a vehicle is best reached; None if it was not heard."""
        belief = self.beliefs.get(ids)
        return None if belief is None else belief.channel

    def vehicles(self) -> frozenset[tuple[int, int]]:
        """The ids of the vehicles that are heard on a link."""
        return frozenset(ids for ids, belief in self.beliefs.items() if belief.channel is not None)

    def heard_vehicle(self, ids: tuple[int, int], channel: Channel, now: float) -> None:
        """Note a heartbeat of a vehicle on this channel."""
        self._note_heartbeat(channel, now)
        channel.systems.add(ids[0])

    def _note_heartbeat(self, channel: Channel, now: float) -> None:
        if channel.endpoint.heard(channel, now):
            self._channels = self._audiences = None

    def _handle_command(self, frame: Frame, channel: Channel) -> None:
        """Handle a command that is addressed to us, and acknowledge it."""
        gets_statuses = self._gets_statuses(channel.endpoint)
        offered = self.offered if gets_statuses else self.offered - {ROBOT_STATUS}
        found = answer(frame.message, frame.ids, self.sender.component.speaks_as, channel.interval, offered)
        if found is None:
            return
        for reply in found.replies:
            self.send_to(channel, reply, found.system)
        if found.interval != channel.interval:
            channel.interval, self._audiences = found.interval, None
        if found.once == HEARTBEAT:
            self.sender.send_heartbeat(channel, found.system)
        elif found.once == ROBOT_STATUS:
            vehicles = {system for system, _ in self.vehicles()}
            self.needs_turn = True
            self._requests |= {(channel, v) for v in vehicles if self.sender.component.system_for(v) == found.system}

    def _record(self, frames: list[Frame], now: Instant) -> None:
        recorder = self.sender.recorder
        if recorder is not None:
            for frame in frames:
                recorder.write(now.unix_us, frame.raw)

    def _forward(self, data: bytes, frames: list[Frame], channel: Channel, now: Instant) -> None:
        """Forward frames by MAVLink's routing rules."""
        if self._router is None or not channel.is_peer:
            return
        channels = self._collect_channels() if self._channels is None else self._channels
        whole = b"" if channel.endpoint.link.stream else data
        for part, targets in self._router.plan(whole, frames, channel, channels, now.mono):
            for target in targets:
                target.send(part)

    def _collect_channels(self) -> tuple[Channel, ...]:
        """The channels to which frames may be forwarded; the same tuple until `_channels` is None again."""
        self._channels = tuple(channel for endpoint in self.endpoints for channel in endpoint.peers())
        return self._channels

    # sending

    def passive_vehicles(self) -> frozenset[tuple[int, int]]:
        """The vehicles on passive links. Nothing may be sent to them."""
        if not self.has_passive:
            return NONE
        return frozenset(ids for ids, b in self.beliefs.items() if b.channel is None or b.channel.passive)

    def audiences(self) -> Sequence[Audience]:
        """The receivers of statuses: peers and outs. Not serial vehicle links: autopilots drop unknown ids."""
        if self._audiences is None:
            self._audiences = tuple(
                Audience(channel, channel.interval, endpoint.is_out, None if endpoint.is_out else channel.systems)
                for endpoint in self.endpoints
                if self._gets_statuses(endpoint)
                for channel in endpoint.peers()
            )
        return self._audiences

    def _gets_statuses(self, endpoint: Endpoint) -> bool:
        return not endpoint.passive and (endpoint.is_out or endpoint.robot_status)

    def requests(self) -> set[tuple[Channel, int]]:
        """`MavlinkPort`: the requests for one status since the last call, as channel and system."""
        if not self._requests:  # asked in every turn
            return self._requests
        requests, self._requests = self._requests, set()
        return requests

    def send(self, message: NamedTuple, system: int, audience: Audience) -> None:
        """`MavlinkPort`: send a message about the vehicle with this system id."""
        channel: Any = audience.key
        self.sender.send_unasked(channel, message, system)

    def send_to(self, channel: Any, message: NamedTuple, system: int) -> None:
        """Send one message on one channel, with our ids for this system."""
        self.sender.send(channel, message, system)

    def speak(self, vehicles: Sequence[TrackedVehicle], now: float) -> None:
        """Send our heartbeats, and what waited for its turn. Called once a second."""
        for endpoint in self.endpoints:
            endpoint.forget_silent(now)
            for channel in endpoint.channels():
                channel.systems.clear()
                channel.quiet = False
        self._channels = self._audiences = None
        for tracked in vehicles:
            path = self.channel_of(tracked.ids) if tracked.ids is not None and speaks_for(tracked) else None
            if path is not None and tracked.ids is not None:
                if tracked.costly:
                    path.quiet = True
                else:
                    path.systems.add(tracked.ids[0])
        self.sender.speak(self.endpoints, vehicles, self.config.identity.heartbeat)

    def ask(self, request: Ask) -> None:
        """Send a request to a vehicle."""
        path = self.channel_of((request.system, request.component))
        if path is not None:
            path.endpoint.speech.count(self.sender.send(path, request.message, request.system))

    def vehicles_on(self, endpoint: Endpoint) -> list[tuple[int, int]]:
        """The ids of the vehicles that are heard on a link."""
        found = ((ids, belief.channel) for ids, belief in self.beliefs.items())
        return [ids for ids, channel in found if channel is not None and channel.endpoint is endpoint]

    def reconnected(self, endpoint: Endpoint) -> None:
        """Note that a link has a new connection."""
        for belief in self.beliefs.values():
            belief.reconnected(lambda channel: channel.endpoint is endpoint)

    def lag(self, frame: Frame) -> float:
        """How late a frame is by its signature, seconds."""
        policy = self.sender.signing_policy
        return 0.0 if policy is None else policy.lag(frame)

    def may_ask(self, ids: tuple[int, int], number: int) -> bool:
        """Whether the link of a vehicle has room for this number of requests and one more, in this second."""
        path = self.channel_of(ids)
        return path is not None and path.endpoint.speech.has_room_for(number * REQUEST_SIZE)

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
        if copied := sum(belief.copied for belief in self.beliefs.values()):
            log.info("%d duplicate frames", copied)

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
