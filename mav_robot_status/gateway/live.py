"""The live gateway: turns the loop: waits for the links, feeds the plant, sends what is due."""

from __future__ import annotations

import logging
import math
import select
import signal
import socket
import time
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any, Final

from ..clock import now as present
from ..errors import MavRobotStatusError
from ..mavlink.commands import ROBOT_STATUS
from .metrics import metrics
from .notify import Notifier
from .plant import Plant, check
from .switchboard import Switchboard

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TextIO

    from ..clock import Instant
    from ..config import Config
    from ..interface import Metrics
    from .station import Station

log = logging.getLogger(__name__)

HEARTBEAT_PERIOD: Final = 1.0  # s
FIRST_SILENCE, LATER_SILENCE = 3.5, 30.0  # s until the log says that no autopilot is heard, and again
LONGEST_WAIT: Final = 1.0  # s
PACE: Final = 0.002
"""Seconds between two wake-ups when they come faster than that for long: each costs as much as ten frames do."""
AT_ONCE: Final = 8 * PACE
"""So many wake-ups may follow each other without a rest: nothing that comes alone or in a burst is delayed."""
MOST_AT_ONCE: Final = 1024
"""Datagrams read before anything else is done: all that may have gathered, but a flood must not stop the rest."""


class Live:
    """The gateway on live links."""

    def __init__(
        self,
        config: Config,
        stdout: TextIO,
        clock: Callable[[], Instant] = present,
        notifier: Notifier | None = None,
    ) -> None:
        """Open everything. Raises LinkError, ConfigError. `notifier`: tells systemd; None: there is nobody to tell."""
        self._clock = clock
        self._notifier = Notifier({}) if notifier is None else notifier
        self._beat_at = self._told_at = self._rested = -math.inf
        self._stop = self._hung_up = False
        self._reread: Callable[[], Config] | None = None
        self._handlers: dict[int, Any] = {}
        with ExitStack() as opened:  # what fails half-way leaves nothing open
            self.switchboard = Switchboard(config, clock)
            opened.callback(self.switchboard.close)
            self.plant = Plant(config, self.switchboard, stdout, metrics=self.metrics)
            self._go_by(config)
            self._wake_read, self._wake_write = socket.socketpair()
            opened.pop_all()
        self._wake_read.setblocking(False)
        self._wake_write.setblocking(False)

    @property
    def stations(self) -> list[Station]:
        """The links, vehicles' first."""
        return self.switchboard.stations

    def metrics(self, now: Instant) -> Metrics:
        """What is so and was counted up to `now`."""
        return metrics(self.plant, self.switchboard, now)

    def stop(self) -> None:
        """Make `run` return soon; may be called from a signal handler or another thread."""
        self._stop = True
        with suppress(OSError):  # closed by now, or told often enough
            self._wake_write.send(b"x")

    def stop_on_signals(self) -> None:
        """SIGINT and SIGTERM stop the gateway, until it is closed. Only in the main thread."""
        for number in (signal.SIGINT, signal.SIGTERM):
            self._handlers[number] = signal.signal(number, lambda *_: self.stop())

    def reload_on_hangup(self, reread: Callable[[], Config]) -> None:
        """SIGHUP reads the configuration again, until the gateway is closed. Only in the main thread.

        `reread` raises MavRobotStatusError if the new one is no good.
        """
        self._reread = reread
        self._handlers[signal.SIGHUP] = signal.signal(signal.SIGHUP, lambda *_: self._hang_up())

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Turn the loop until `stop`, or until `until` says so at one of its turns.

        Raises BrokenPipeError if the reader of the JSON lines has gone.
        """
        now = self._clock()
        self._told_at = now.mono + FIRST_SILENCE
        poll = self._new_poll()
        due = -math.inf
        self._notifier.ready()
        try:
            while not (self._stop or until()):
                if self._hung_up:
                    self._reload(now)
                    poll, due = self._new_poll(), -math.inf
                if self._is_stirred() or now.mono >= due:  # most of what comes changes nothing, and costs no turn
                    self.switchboard.watch(poll)
                    self.turn(now)
                    due = min(self._next_due(now.mono), now.mono + LONGEST_WAIT)
                    now = self._clock()
                due = min(due, self.plant.hw.deadline)
                wait = due - now.mono
                rest = self._rested - now.mono
                if 0 < rest < wait:
                    time.sleep(rest)
                    wait -= rest
                # rounded up to milliseconds: rounded down, the loop would spin until the moment has come
                events = poll.poll(math.ceil(wait * 1000) if wait > 0 else 0)
                if self._config.coalesce and events:
                    self._gather(due)
                now = self._clock()
                if events:
                    limit = self._limit(now.mono)
                    for descriptor, _ in events:
                        self._receive(descriptor, now, limit)
        finally:
            self.close()

    def _is_stirred(self) -> bool:
        """Whether something came that cannot wait until it is due."""
        return self.plant.hw.is_stirred(self._asks) or self.switchboard.stirred

    def turn(self, now: Instant) -> None:
        """Everything that is due at `now`."""
        self._notifier.turn(now.mono)
        self.switchboard.service(now.mono)
        while self.switchboard.conflicts:
            self.plant.hw.conflict(self.switchboard.conflicts.pop(), now)
        self.plant.tick(now)
        if self._asks:
            self._ask(now)
        if self._config.identity.heartbeat and now.mono - self._beat_at >= HEARTBEAT_PERIOD:
            late = now.mono - self._beat_at > 2 * HEARTBEAT_PERIOD
            self._beat_at = now.mono if late else self._beat_at + HEARTBEAT_PERIOD
            self.switchboard.beat(self.plant.hw.vehicles, now.mono)
        if now.mono >= self._told_at:
            self._tell_silence(now)

    def close(self) -> None:
        """Stop the plant, close the links, tell in the log what was counted."""
        self._notifier.stopping()
        with ExitStack() as steps:  # each is done, whatever the others raise
            steps.callback(self._notifier.close)
            for number, handler in self._handlers.items():
                steps.callback(signal.signal, number, handler)
            steps.callback(self._wake_read.close)
            steps.callback(self._wake_write.close)
            steps.callback(self.switchboard.close)
            steps.callback(self._tell_losses)
            steps.callback(self.plant.close, self._clock())

    def _new_poll(self) -> select.poll:
        poll = select.poll()
        poll.register(self._wake_read, select.POLLIN)
        return poll

    def _hang_up(self) -> None:
        self._hung_up = True
        with suppress(OSError):
            self._wake_write.send(b"x")

    def _reload(self, now: Instant) -> None:
        """Go on by the configuration as it is now; by the one that there was if the new one is no good."""
        self._hung_up = False
        with suppress(BlockingIOError):
            self._wake_read.recv(4096)
        assert self._reread is not None
        self._notifier.reloading(now.mono)
        try:
            config = self._reread()
            check(config)
            if config != self._config:
                self._change(config, now)
            log.info("the configuration was read again")
        except MavRobotStatusError as error:
            log.error("the configuration stays as it was: %s", error)
            if self.switchboard.config is not self._config:
                self._change(self._config, now)  # what cannot be had again ends the gateway
        self._notifier.ready()

    def _change(self, config: Config, now: Instant) -> None:
        self.switchboard.change(config)
        self.plant.change(config, frozenset(self.switchboard.paths.vehicles()), now)
        self._go_by(config)

    def _go_by(self, config: Config) -> None:
        """Everything that this configuration names is open."""
        self._config = config
        self._asks = config.requests == "missing" and not all(link.passive for link in config.links)
        if self.plant.publishes("mavlink"):
            self.switchboard.offered |= {ROBOT_STATUS}

    def _gather(self, due: float) -> None:
        """Let more input come, so that fewer wake-ups serve it; `stop` ends this, and so does what falls due."""
        seconds = min(self._config.coalesce, due - self._clock().mono)
        if seconds > 0:
            select.select([self._wake_read], [], [], seconds)

    def _limit(self, now: float) -> int:
        """How many datagrams to read after waking up `now`, and from when on to wake up again.

        One if nothing came for a while: most come alone, and to look for a second costs more than it is to read it.
        """
        rested = now - AT_ONCE
        if self._rested < rested and not self._config.coalesce:
            self._rested = rested + PACE
            return 1
        self._rested = min(max(self._rested, rested), now) + PACE
        return MOST_AT_ONCE

    def _receive(self, descriptor: int, now: Instant, limit: int = MOST_AT_ONCE) -> None:
        heard = self.switchboard.receive(descriptor, now, limit)
        if not heard:
            return
        hw = self.plant.hw
        hw.speak_as(self._config.identity.system, self.switchboard.voice.component.id)
        for frame, channel in heard:
            tracked = hw.take(frame, now)
            if tracked is not None and tracked.ids is not None:
                self.switchboard.heard_vehicle(tracked.ids, channel, now.mono)

    def _ask(self, now: Instant) -> None:
        for ask in self.plant.hw.write(now, self.switchboard.passive_vehicles()):
            way = self.switchboard.paths.way((ask.system, ask.component))
            if way is not None:
                self.switchboard.tell(way, ask.message, ask.system)

    def _next_due(self, now: float) -> float:
        due = min(self.plant.next_due(now, now + LONGEST_WAIT), self._told_at, self.switchboard.next_due())
        due = min(due, self._notifier.next_due())
        return min(due, self._beat_at + HEARTBEAT_PERIOD) if self._config.identity.heartbeat else due

    def _tell_losses(self) -> None:
        for tracked in self.plant.hw.vehicles:
            if tracked.losses and tracked.ids is not None:
                times = "once" if tracked.losses == 1 else f"{tracked.losses} times"
                log.info("vehicle %d.%d was lost %s", *tracked.ids, times)

    def _tell_silence(self, now: Instant) -> None:
        if any(self.plant.hw.vehicles):
            self._told_at = math.inf
            return
        self._told_at = now.mono + LATER_SILENCE
        self.switchboard.tell_silence()
