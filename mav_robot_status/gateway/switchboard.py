"""All live links: what comes in on them, who is where, and what we send under our identity."""

from __future__ import annotations

import itertools
import logging
import math
import select
from contextlib import ExitStack
from operator import itemgetter
from typing import TYPE_CHECKING, Any, Final

from ..config import Config
from ..hardware.kinds import COMMAND_IDS, WANTED_IDS
from ..interface import Audience
from ..mavlink.commands import HEARTBEAT, ROBOT_STATUS, answer
from ..mavlink.signing import Verdict
from .paths import Paths
from .routing import Router
from .station import Station
from .voice import Voice

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from ..clock import Instant
    from ..hardware.tracked import Tracked
    from ..link.base import Address
    from ..mavlink.framing import Frame
    from .station import Channel

log = logging.getLogger(__name__)

NONE: Final[frozenset[tuple[int, int]]] = frozenset()
BATCH: Final = 64
"""Pieces read before they are parsed: bounds what a flood of long ones takes of memory."""
SETUP_SIGNING: Final = 256
"""Carries a key: passed on to nobody."""


class Switchboard:
    """The links of one gateway and the channels on them. It is the `MavlinkPort` of the publishers."""

    def __init__(self, config: Config, clock: Callable[[], Instant]) -> None:
        """Open everything. Raises LinkError, UsageError."""
        self.config = Config()
        self.voice = Voice(clock)
        self.offered: frozenset[int]
        """The messages of ours that can be asked for."""
        self.paths: Paths[Channel] = Paths()
        self.stirred = False
        """Whether something came, since the last `service`, that cannot wait until it is due."""
        self.conflicts: set[tuple[int, int]] = set()
        """Ids that two autopilots claim, found since the last look."""
        self.stations: list[Station] = []
        self._watched: dict[int, Station] = {}
        self._requests: set[tuple[Channel, int]] = set()
        self._ends: tuple[Channel, ...] | None = None
        """Everyone a frame may be passed on to; None: to be found anew."""
        self._router: Router[Channel] | None = None
        self._keep_all = False
        try:
            self.change(config)
        except BaseException:  # what fails half-way leaves nothing open
            for station in self.stations:
                station.link.close()
            self.voice.close()
            raise

    def change(self, config: Config) -> None:
        """Open what this configuration has more, close what it has less, and keep every other link and its peers.

        The caller's poll object is to be made anew. Raises LinkError, UsageError; then some links are closed: change
        back.
        """
        before, self.config = self.config, config
        self.offered = frozenset({HEARTBEAT} if config.identity.heartbeat else ())
        self._keep_all = config.forward or config.record is not None
        places = [*((link, False) for link in config.links), *((out, True) for out in config.outs)]
        rest = list(self.stations)
        kept = [_taken(rest, link.url, is_out) for link, is_out in places]
        self.stations = [station for station in kept if station is not None]
        self._let_go(rest)
        if not config.forward or self._router is None or rest:
            self._router = Router() if config.forward else None
        self.voice.change(config, before)
        for number, ((link, is_out), station) in enumerate(zip(places, kept, strict=True)):
            if station is not None:
                station.adjust(link, number, keep_all=self._keep_all)
                continue
            station = Station(link, is_out, number, keep_all=self._keep_all)
            self.stations.append(station)
            log.info("%s%s", station.link.text, " (passive)" if station.passive else "")
        self.stations.sort(key=lambda station: station.number)

    def _let_go(self, stations: list[Station]) -> None:
        """Close links, and forget whom was heard there only."""
        self._close_links(stations)
        self._watched.clear()
        self._ends = None
        self._requests = {(channel, ids) for channel, ids in self._requests if channel.station in self.stations}
        self.paths.keep(lambda channel: channel.station in self.stations)

    def _close_links(self, stations: list[Station]) -> None:
        with ExitStack() as steps:  # each is done, whatever the others raise
            for station in stations:
                steps.callback(station.link.close)
                steps.callback(_tell_counters, station)

    # what comes in

    def watch(self, poll: select.poll) -> None:
        """Wait also for the links that have got a descriptor since."""
        if len(self._watched) == len(self.stations):
            return
        for station in self.stations:
            descriptor = station.link.fileno()
            if descriptor >= 0 and descriptor not in self._watched:
                poll.register(descriptor, select.POLLIN)
                self._watched[descriptor] = station

    def receive(self, descriptor: int, now: Instant, limit: int = BATCH) -> list[tuple[Frame, Channel]]:
        """What has come on the link with this descriptor, of the kinds that a status needs, and from where.

        At most `limit` datagrams or BATCH pieces of a stream; with a limit of 1 it does not look for more.
        """
        heard: list[tuple[Frame, Channel]] = []
        station = self._watched.get(descriptor)
        if station is None:
            return heard
        link = station.link
        while limit > 0:
            pieces: Sequence[tuple[bytes, Address]] = link.receive(limit if limit < BATCH else BATCH)
            limit = limit - BATCH if len(pieces) == BATCH and not link.stream else 0
            if len(pieces) > 1 and not self._keep_all:
                pieces = _joined(pieces)
            for data, source in pieces:
                channel = station.channel(source)
                frames = channel.parser.feed(data)
                if self._keep_all:
                    self._pass_on(data, frames, channel, now)
                    frames = [frame for frame in frames if frame.message_id in WANTED_IDS]
                for frame in frames:
                    if self._believes(frame, channel, now):
                        heard.append((frame, channel))
        if link.stream and link.due() <= now.mono:  # the connection has ended
            self.stirred = True
        return heard

    def _believes(self, frame: Frame, channel: Channel, now: Instant) -> bool:
        """Whether a frame is one that the hardware is to take; what is meant for us is dealt with."""
        trust = self.voice.trust
        verdict = None if trust is None else trust.judge(frame, now)
        if verdict is not None and verdict not in (Verdict.VERIFIED, Verdict.LET_THROUGH):
            if frame.message_id == HEARTBEAT and trust and trust.may_heal(verdict, now.mono):
                self.voice.beat(channel, frame.ids[0])
            return False
        station = channel.station
        if frame.message_id == HEARTBEAT:
            self.voice.component.heard(frame)
            if station.is_out:
                self._heard_at(channel, now.mono)
        elif frame.message_id in COMMAND_IDS:
            if station.is_peer(channel) and verdict in (None, Verdict.VERIFIED):
                self._obey(frame, channel)
            if station.is_out:
                return self._router is not None  # passed on to a vehicle: the hardware overhears it
        if station.is_out:
            return False
        if verdict is Verdict.VERIFIED:  # newer than all that came before, whichever way it came
            self.paths.take(frame.ids, channel, now.mono)
            return True
        return self._counts(frame, channel, now.mono)

    def _counts(self, frame: Frame, channel: Channel, now: float) -> bool:
        """Whether a frame came the way that counts for its vehicle."""
        if self.paths.counts(frame, channel, now):
            return True
        ends = self.paths.conflict(frame, channel)
        if ends is not None:
            self.stirred = True
            self.conflicts.add(frame.ids)
            log.warning("two autopilots claim the ids %d.%d: %s and %s", *frame.ids, *ends)
        return False

    def heard_vehicle(self, ids: tuple[int, int], channel: Channel, now: float) -> None:
        """A heartbeat of a vehicle came from this channel."""
        self._heard_at(channel, now)
        self.paths.learn(ids, channel, now)

    def _heard_at(self, channel: Channel, now: float) -> None:
        if channel.station.heard(channel, now):
            self._ends = None

    def _obey(self, frame: Frame, channel: Channel) -> None:
        """A command, perhaps to us: answer it, and do what it says."""
        hears_statuses = self._hears_statuses(channel.station)
        offered = self.offered if hears_statuses else self.offered - {ROBOT_STATUS}
        found = answer(frame.message, frame.ids, self.voice.component.speaks_as, channel.interval, offered)
        if found is None:
            return
        for reply in found.replies:
            self.tell(channel, reply, found.system)
        channel.interval = found.interval
        if found.once == HEARTBEAT:
            self.voice.beat(channel, found.system)
        elif found.once == ROBOT_STATUS:
            vehicles = {system for system, _ in self.paths.vehicles()}
            self.stirred = True
            self._requests |= {(channel, v) for v in vehicles if self.voice.component.system_for(v) == found.system}

    def _pass_on(self, data: bytes, frames: list[Frame], channel: Channel, now: Instant) -> None:
        """Record what came, and send it to whom it concerns."""
        recorder = self.voice.recorder
        if recorder is not None:
            for frame in frames:
                recorder.write(now.unix_us, frame.raw)
        if self._router is None or not channel.station.is_peer(channel):
            return
        frames = [frame for frame in frames if frame.message_id != SETUP_SIGNING]
        if self._ends is None:
            self._ends = tuple(end for station in self.stations for end in station.peers())
        whole = b"" if channel.station.link.stream else data
        for part, ends in self._router.plan(whole, frames, channel, self._ends, now.mono):
            for end in ends:
                end.send(part)

    # what goes out

    def passive_vehicles(self) -> frozenset[tuple[int, int]]:
        """The vehicles to which nothing may be sent."""
        if not any(station.passive for station in self.stations):
            return NONE
        ways = ((ids, self.paths.way(ids)) for ids in self.paths.vehicles())
        return frozenset(ids for ids, way in ways if way is None or way.passive)

    def audiences(self) -> list[Audience]:
        """Everyone who hears statuses: peers and outs; of serial devices only outs, autopilots drop unknown ids."""
        return [
            Audience(channel, channel.interval, mirror=station.is_out)
            for station in self.stations
            if self._hears_statuses(station)
            for channel in station.peers()
        ]

    def _hears_statuses(self, station: Station) -> bool:
        return not station.passive and (station.is_out or station.robot_status)

    def requests(self) -> set[tuple[Channel, int]]:
        """`MavlinkPort`: who asked for a status, once, and of which system; since the last call."""
        asked, self._requests = self._requests, set()
        return asked

    def send(self, message: Any, system: int, audience: Audience) -> None:
        """`MavlinkPort`: to one audience, about the vehicle with this system id."""
        self.tell(audience.key, message, system)

    def tell(self, channel: Any, message: Any, system: int) -> None:
        """Send one message to one end, under the identity that we have beside this system."""
        self.voice.tell(channel, message, system)

    def beat(self, vehicles: Iterable[Tracked], now: float) -> None:
        """Our heartbeat, once a second."""
        for station in self.stations:
            station.forget_silent(now)
        self._ends = None
        self.voice.beat_all(self.stations, vehicles)

    # keeping the links

    @property
    def record_dropped(self) -> int | None:
        """Frames that the recording has not; None: there is no recording."""
        return None if self.voice.recorder is None else self.voice.recorder.dropped

    def service(self, now: float) -> None:
        """Connect and reconnect what waits for its turn."""
        self.stirred = False
        if self.voice.trust is not None:
            self.voice.trust.keep()
        for station in self.stations:
            if now >= station.link.due():
                station.link.service(now)

    def next_due(self) -> float:
        """When (monotonic seconds) `service` has something to do."""
        return min((station.link.due() for station in self.stations), default=math.inf)

    def close(self) -> None:
        """Close the links, tell in the log what was counted."""
        with ExitStack() as steps:  # each is done, whatever the others raise
            steps.callback(self._close_links, self.stations)
            steps.callback(self.voice.close)
        if self.paths.duplicates:
            log.info("%d frames came a second way, %d changes of the way", self.paths.duplicates, self.paths.changes)

    def tell_silence(self) -> None:
        """Say on which links no autopilot is heard."""
        for station in self.stations:
            if not station.is_out:
                got = station.totals()
                rest = (
                    f"{got.garbage_bytes} bytes of something else" if got.garbage_bytes else "nothing that is MAVLink"
                )
                heard = f"{got.frames} MAVLink frames" if got.frames else rest
                log.warning("no autopilot heard yet, %s: %s so far", station.link.text, heard)
        trust = self.voice.trust
        if trust is not None and (found := trust.summary()):
            log.warning("signing: %s", found)


def _joined(pieces: Sequence[tuple[bytes, Address]]) -> list[tuple[bytes, Address]]:
    """The same with neighbours from one address in one piece: a call of the parser costs half as much as a frame."""
    runs = itertools.groupby(pieces, itemgetter(1))
    return [(b"".join([data for data, _ in run]), source) for source, run in runs]


def _taken(stations: list[Station], url: str, is_out: bool) -> Station | None:
    """The station of this connection, taken out of those that are there."""
    found = next((s for s in stations if s.url == url and s.is_out is is_out), None)
    if found is not None:
        stations.remove(found)
    return found


def _tell_counters(station: Station) -> None:
    got = station.totals()
    log.info(
        "%s: %d frames, %d lost, %d with a bad CRC, %d of unknown kind, %d bytes of garbage, %d datagrams dropped",
        station.link.text,
        got.frames,
        got.lost,
        sum(got.bad_crc.values()),
        sum(got.unknown.values()),
        got.garbage_bytes,
        station.link.dropped,
    )
