"""The live gateway: waits for the links, feeds the plant, sends what we have to say."""

from __future__ import annotations

import logging
import math
import select
import signal
import socket
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any, Final

from ..clock import now as present
from ..interface import TriState
from ..mavlink.component import LONELY_SYSTEM, Component
from .plant import Plant
from .station import Station

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TextIO

    from ..clock import Instant
    from ..config import Config
    from ..link.base import Address

log = logging.getLogger(__name__)

HEARTBEAT_PERIOD: Final = 1.0  # s
FIRST_SILENCE, LATER_SILENCE = 3.5, 30.0  # s until the log says that no autopilot is heard, and again
LONGEST_WAIT: Final = 1.0  # s


class Live:
    """The gateway on live links."""

    def __init__(self, config: Config, stdout: TextIO, clock: Callable[[], Instant] = present) -> None:
        """Open everything. Raises LinkError, ConfigError."""
        self._clock = clock
        self._config = config
        self._component = Component(config.identity.component, config.identity.system)
        self.stations: list[Station] = []
        self._routes: dict[tuple[int, int], tuple[Station, Address]] = {}
        """Where the heartbeats of each vehicle come from; no longer than the hardware's list of vehicles."""
        self._asks = config.requests == "missing" and not all(link.passive for link in config.links)
        self._beat_at = self._told_at = -math.inf
        self._stop = False
        self._handlers: dict[int, Any] = {}
        with ExitStack() as opened:  # what fails half-way leaves nothing open
            for link, is_out in [*((link, False) for link in config.links), *((out, True) for out in config.outs)]:
                self.stations.append(Station(link, is_out))
                opened.callback(self.stations[-1].link.close)
            self.plant = Plant(config, self, stdout)
            self.plant.hw.own_system = config.identity.system
            self._wake_read, self._wake_write = socket.socketpair()
            opened.pop_all()
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
        with suppress(OSError):  # closed by now, or told often enough
            self._wake_write.send(b"x")

    def stop_on_signals(self) -> None:
        """SIGINT and SIGTERM stop the gateway, until it is closed. Only in the main thread."""
        for number in (signal.SIGINT, signal.SIGTERM):
            self._handlers[number] = signal.signal(number, lambda *_: self.stop())

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
                due = min(self._next_due(now.mono), now.mono + LONGEST_WAIT)
                wait = due - self._clock().mono
                # rounded up to milliseconds: rounded down, the loop would spin until the moment has come
                events = poll.poll(math.ceil(wait * 1000) if wait > 0 else 0)
                if self._config.coalesce and events:
                    self._gather(due)
                now = self._clock()
                for descriptor, _ in events:
                    if descriptor in watched:
                        self._receive(watched[descriptor], now)
        finally:
            self.close()

    def turn(self, now: Instant) -> None:
        """Everything that is due at `now`."""
        self.plant.tick(now)
        if self._asks:
            self._ask(now)
        if self._config.identity.heartbeat and now.mono - self._beat_at >= HEARTBEAT_PERIOD:
            self._beat(now)
        if now.mono >= self._told_at:
            self._tell_silence(now)

    def close(self) -> None:
        """Stop the plant, close the links, tell in the log what was counted."""
        with ExitStack() as steps:  # each is done, whatever the others raise
            for number, handler in self._handlers.items():
                steps.callback(signal.signal, number, handler)
            steps.callback(self._wake_read.close)
            steps.callback(self._wake_write.close)
            for station in self.stations:
                steps.callback(station.link.close)
                steps.callback(self._tell_counters, station)
            steps.callback(self.plant.close, self._clock())

    def _gather(self, due: float) -> None:
        """Let more input come, so that fewer wake-ups serve it; `stop` ends this, and so does what falls due."""
        seconds = min(self._config.coalesce, due - self._clock().mono)
        if seconds > 0:
            select.select([self._wake_read], [], [], seconds)

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
                    self.plant.hw.own_component = self._component.id
                if station.is_out:
                    continue
                tracked = self.plant.take(frame, now)
                if tracked is not None and tracked.ids is not None:
                    station.heard_autopilot(source, now.mono)
                    self._routes[tracked.ids] = (station, source)

    def _ask(self, now: Instant) -> None:
        passive = {ids for ids, (station, _) in self._routes.items() if station.passive}
        for ask in self.plant.hw.write(now, passive):
            station, source = self._routes[ask.system, ask.component]
            station.answer(self._component.frame(ask.message, ask.system), source)

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
        due = min(self.plant.next_due(now, now + LONGEST_WAIT), self._told_at)
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
