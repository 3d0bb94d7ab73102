"""The live gateway: waits for the links, feeds the plant, sends what we have to say."""

from __future__ import annotations

import logging
import math
import select
import signal
import socket
import time
from collections import OrderedDict
from typing import TYPE_CHECKING, Any, Final

from ..clock import now as present
from ..hardware.robot_hw import WANTED_IDS
from ..interface import TriState
from ..link import open_link
from ..link.url import parse
from ..mavlink.component import LONELY_SYSTEM, Component
from ..mavlink.framing import Counters, Parser
from .plant import Plant

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TextIO

    from ..clock import Instant
    from ..config import Config, LinkConfig
    from ..link.base import Address, Link

log = logging.getLogger(__name__)

MOST_SOURCES: Final = 64
"""Addresses on one link whose cut frames are put together; the longest silent is let go."""
MOST_PEERS: Final = 8
PEER_SILENCE: Final = 30.0  # s
HEARTBEAT_PERIOD: Final = 1.0  # s
FIRST_SILENCE, LATER_SILENCE = 3.5, 30.0  # s until the log says that no autopilot is heard, and again
SPEAKS_FIRST: Final = frozenset({"udpout", "udpbcast", "tcp"})


class Station:
    """One link with what was heard on it."""

    def __init__(self, config: LinkConfig, is_out: bool) -> None:
        url = parse(config.url)
        self.link: Link = open_link(url)
        self.passive = config.passive
        self.is_out = is_out
        self.listens = url.kind not in SPEAKS_FIRST
        self.peers: OrderedDict[Address, float] = OrderedDict()
        """Addresses of autopilots and when they were last heard."""
        self.counters = Counters()
        self._parsers: OrderedDict[Address, Parser] = OrderedDict()

    def parser(self, source: Address) -> Parser:
        """The parser of what one address sends."""
        parser = self._parsers.get(source)
        if parser is None:
            if len(self._parsers) >= MOST_SOURCES:
                self.counters.add(self._parsers.popitem(last=False)[1].counters)
            parser = self._parsers[source] = Parser(WANTED_IDS)
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

    def totals(self) -> Counters:
        """Everything counted on this link."""
        total = Counters()
        total.add(self.counters)
        for parser in self._parsers.values():
            total.add(parser.counters)
        return total


class Live:
    """The gateway on live links."""

    def __init__(self, config: Config, stdout: TextIO, clock: Callable[[], Instant] = present) -> None:
        """Open everything. Raises LinkError, ConfigError."""
        self._clock = clock
        self._config = config
        self._component = Component(config.identity.component, config.identity.system)
        self.stations = [Station(link, False) for link in config.links] + [Station(out, True) for out in config.outs]
        self.plant = Plant(config, self, stdout)
        self._routes: dict[tuple[int, int], tuple[Station, Address]] = {}
        self._beat_at = -math.inf
        self._told_at = math.inf
        self._stop = False
        self._wake_read, self._wake_write = socket.socketpair()
        self._wake_read.setblocking(False)
        self._wake_write.setblocking(False)
        for station in self.stations:
            log.info("%s%s", station.link.text, " (passive)" if station.passive else "")

    def send(self, message: Any, system: int) -> None:
        """`MavlinkPort`: to everyone who listens, about the vehicle with this system id."""
        frame = self._component.frame(message, system)
        for station in self.stations:
            station.send(frame)

    def stop(self) -> None:
        """Make `run` return soon; may be called from a signal handler or another thread."""
        self._stop = True
        self._wake_write.send(b"x")

    def stop_on_signals(self) -> None:
        """SIGINT and SIGTERM stop the gateway. Only in the main thread."""
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self.stop())

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Turn the loop until `stop`, or until `until` says so at one of its turns.

        Raises BrokenPipeError if the reader of the JSON lines has gone.
        """
        now = self._clock()
        self._told_at = now.mono + FIRST_SILENCE
        poll = select.poll()
        poll.register(self._wake_read, select.POLLIN)
        watched: dict[int, Station] = {}
        try:
            while not (self._stop or until()):
                self._watch(poll, watched)
                self.turn(now)
                wait = max(0.0, self._next_due(now.mono) - self._clock().mono)
                events = poll.poll(math.ceil(min(wait, 1.0) * 1000))
                if self._config.coalesce and events:
                    time.sleep(min(self._config.coalesce, wait))
                now = self._clock()
                for descriptor, _ in events:
                    if descriptor in watched:
                        self._receive(watched[descriptor], now)
        finally:
            self.close()

    def turn(self, now: Instant) -> None:
        """Everything that is due at `now`."""
        self.plant.tick(now)
        if self._config.requests == "missing":
            self._ask(now)
        if self._config.identity.heartbeat and now.mono - self._beat_at >= HEARTBEAT_PERIOD:
            self._beat(now)
        if now.mono >= self._told_at:
            self._tell_silence(now)

    def close(self) -> None:
        """Stop the plant, close the links, tell in the log what was counted."""
        try:
            self.plant.close(self._clock())
        finally:
            for station in self.stations:
                station.link.close()
                self._tell_counters(station)
            self._wake_read.close()
            self._wake_write.close()

    def _watch(self, poll: select.poll, watched: dict[int, Station]) -> None:
        """Wait also for links that have got a descriptor since."""
        if len(watched) == len(self.stations):
            return
        for station in self.stations:
            descriptor = station.link.fileno()
            if descriptor >= 0 and descriptor not in watched:
                poll.register(descriptor, select.POLLIN)
                watched[descriptor] = station

    def _receive(self, station: Station, now: Instant) -> None:
        for data, source in station.link.receive():
            for frame in station.parser(source).feed(data):
                if frame.message_id == 0:
                    self._component.heard(frame)
                if station.is_out:
                    continue
                tracked = self.plant.take(frame, now)
                if tracked is not None and tracked.ids is not None:
                    station.heard_autopilot(source, now.mono)
                    self._routes[tracked.ids] = (station, source)

    def _ask(self, now: Instant) -> None:
        for ask in self.plant.hw.write(now):
            station, source = self._routes[ask.system, ask.component]
            if not station.passive:
                frame = self._component.frame(ask.message, ask.system)
                station.link.send(frame, source if station.listens else None)

    def _beat(self, now: Instant) -> None:
        """Our heartbeat, once a second: beside each vehicle heard; alone only where we must speak first."""
        self._beat_at = (
            now.mono if now.mono - self._beat_at > 2 * HEARTBEAT_PERIOD else self._beat_at + HEARTBEAT_PERIOD
        )
        for station in self.stations:
            station.forget_silent(now.mono)
        spoken = set()
        for tracked in self.plant.hw.vehicles:
            if tracked.ids is None:
                continue
            system = tracked.ids[0]
            if self._component.system_for(system) not in spoken:
                spoken.add(self._component.system_for(system))
                in_error = tracked.handle.status.in_error is TriState.TRUE
                frame = self._component.heartbeat(system, in_error)
                for station in self.stations:
                    station.send(frame)
        if not spoken:
            frame = self._component.heartbeat(LONELY_SYSTEM)
            for station in self.stations:
                if not station.listens and not station.is_out:
                    station.send(frame)

    def _next_due(self, now: float) -> float:
        due = min(self.plant.next_due(now), self._told_at)
        return min(due, self._beat_at + HEARTBEAT_PERIOD) if self._config.identity.heartbeat else due

    def _tell_silence(self, now: Instant) -> None:
        if any(self.plant.hw.vehicles):
            self._told_at = math.inf
            return
        self._told_at = now.mono + LATER_SILENCE
        for station in self.stations:
            if not station.is_out:
                got = station.totals()
                heard = f"{got.frames} MAVLink frames" if got.frames else "nothing that is MAVLink"
                log.warning("no autopilot heard yet, %s: %s so far", station.link.text, heard)

    def _tell_counters(self, station: Station) -> None:
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
