"""The live gateway: polls the sources of all hardware interfaces, and runs the pipeline when something is due."""

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
from .arrival import LATE, STALL
from .controller_config import check
from .live_hardware import LiveHardware
from .metrics import metrics
from .pipeline import Pipeline
from .systemd import SystemdNotifier

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TextIO

    from ..clock import Instant
    from ..config import Config
    from ..interface import IoSource, Metrics
    from .endpoint import Endpoint
    from .observer import Observer

log = logging.getLogger(__name__)

LONGEST_WAIT: Final = 1.0  # s
PACE: Final = 0.002
"""Seconds between wake-ups under continuous input. A wake-up costs as much as ten frames."""
BURST: Final = 8 * PACE
"""Eight wake-ups may follow each other without a pause, so single messages and short bursts are not delayed."""
MOST_AT_ONCE: Final = 1024
"""Datagrams of usual length read in one wake-up of each link; bounded, so that a flood does not stop the rest."""
MOST_AFTER_PAUSE: Final = 8 * MOST_AT_ONCE
"""The same after a pause. Enough for a full socket buffer: it should be read before the next status."""


class EventLoop:
    """The gateway on live hardware. It uses the port `interface.hardware`, and no MAVLink."""

    def __init__(
        self,
        config: Config,
        stdout: TextIO,
        clock: Callable[[], Instant] = present,
        notifier: SystemdNotifier | None = None,
        observers: Sequence[Observer] = (),
    ) -> None:
        """Open everything. Raises LinkError, ConfigError. Without a `notifier` nothing is sent to systemd."""
        self._clock = clock
        self._notifier = SystemdNotifier({}) if notifier is None else notifier
        self._rested = -math.inf
        self._stop = self._hung_up = False
        self._reread: Callable[[], Config] | None = None
        self._handlers: dict[int, Any] = {}
        self._polled: dict[int, IoSource] = {}
        """The polled sources by descriptor."""
        self._config = config
        with ExitStack() as opened:  # after an error nothing stays open
            self.hardware = LiveHardware(config, clock, observers)
            opened.callback(self.hardware.close)
            port = self.hardware.mavlink.hub
            self.pipeline = Pipeline(config, self.hardware.all, port, stdout, metrics=self.metrics, observers=observers)
            self._wake_read, self._wake_write = socket.socketpair()
            opened.pop_all()
        self._wake_read.setblocking(False)
        self._wake_write.setblocking(False)

    @property
    def endpoints(self) -> list[Endpoint]:
        """The MAVLink links: first those to vehicles, then the outs."""
        return self.hardware.mavlink.hub.endpoints

    def metrics(self, now: Instant) -> Metrics:
        """The present values and counters."""
        return metrics(self.pipeline, self.hardware.mavlink.hub, now)

    def stop(self) -> None:
        """Make `run` return soon. A signal handler or another thread may call it."""
        self._stop = True
        with suppress(OSError):  # it is closed, or enough bytes are pending
            self._wake_write.send(b"x")

    def stop_on_signals(self) -> None:
        """Stop on SIGINT and SIGTERM, until `close`. Only in the main thread."""
        for number in (signal.SIGINT, signal.SIGTERM):
            self._handlers[number] = signal.signal(number, lambda *_: self.stop())

    def reload_on_hangup(self, reread: Callable[[], Config]) -> None:
        """Reload the configuration on SIGHUP, until `close`. Only in the main thread.

        `reread` raises MavRobotStatusError if the new configuration is invalid.
        """
        self._reread = reread
        self._handlers[signal.SIGHUP] = signal.signal(signal.SIGHUP, lambda *_: self._hang_up())

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Run the loop until `stop`, or until `until` returns True.

        Raises BrokenPipeError if the reader of the JSON lines is gone.
        """
        now = looked = self._clock()
        poll = self._new_poll()
        due, next_due = -math.inf, self.hardware.all.next_due
        self._notifier.ready()
        try:
            while not (self._stop or until()):
                if self._hung_up:
                    self._reload(now)
                    poll, due, next_due = self._new_poll(), -math.inf, self.hardware.all.next_due
                due = min(due, next_due())
                if now.mono >= due:  # most input changes no status, and needs no turn
                    self._watch(poll)
                    self.turn(now)
                    due = min(self._next_due(now.mono), now.mono + LONGEST_WAIT)
                    now = self._clock()
                wait = due - now.mono
                if now.mono < self._rested < due:
                    rest = self._rested - now.mono
                    time.sleep(rest)
                    wait -= rest
                # poll takes milliseconds: rounded down, the loop would spin until the due time
                events = poll.poll(math.ceil(wait * 1000) if wait > 0 else 0)
                if self._config.coalesce and events:
                    self._gather(due)
                now = self._clock()
                if events:
                    limit = self._limit(now.mono)
                    if now.mono - looked.mono > LATE:
                        limit = self._look_late(looked, now, wait)
                    for descriptor, _ in events:
                        source = self._polled.get(descriptor)
                        if source is not None:
                            source.receive(now, limit)
                looked = now
        finally:
            self.close()

    def _look_late(self, looked: Instant, now: Instant, wait: float) -> int:
        """Tell the links that their input may be old, and how many datagrams to read.

        `looked` is the instant of the last look at the links, `wait` how many seconds the loop wanted to wait.
        """
        stalled = now.mono - looked.mono > max(wait, 0.0) + STALL
        self.hardware.mavlink.hub.pause(looked, now, stalled=stalled)
        return MOST_AFTER_PAUSE if stalled else MOST_AT_ONCE

    def turn(self, now: Instant) -> None:
        """Do everything that is due at `now`."""
        self._notifier.turn(now.mono)
        hardware = self.hardware.all
        for source in hardware.sources():
            if now.mono >= source.next_due():
                source.service(now)
        self.pipeline.tick(now)
        hardware.write(now)

    def close(self) -> None:
        """Stop the pipeline, close the hardware, log the counters."""
        self._notifier.stopping()
        with ExitStack() as steps:  # close all, even if one raises
            steps.callback(self._notifier.close)
            for number, handler in self._handlers.items():
                steps.callback(signal.signal, number, handler)
            steps.callback(self._wake_read.close)
            steps.callback(self._wake_write.close)
            steps.callback(self.hardware.close)
            steps.callback(self.pipeline.close, self._clock())

    def _new_poll(self) -> select.poll:
        poll = select.poll()
        poll.register(self._wake_read, select.POLLIN)
        self._polled = {}
        return poll

    def _watch(self, poll: select.poll) -> None:
        """Register the sources that have a descriptor now."""
        found = {descriptor: s for s in self.hardware.all.sources() if (descriptor := s.fileno()) >= 0}
        if found.keys() != self._polled.keys():
            for descriptor in self._polled.keys() - found.keys():
                poll.unregister(descriptor)
            for descriptor in found.keys() - self._polled.keys():
                poll.register(descriptor, select.POLLIN)
        self._polled = found

    def _hang_up(self) -> None:
        self._hung_up = True
        with suppress(OSError):
            self._wake_write.send(b"x")

    def _reload(self, now: Instant) -> None:
        """Apply the new configuration. Keep the present one if the new one is invalid."""
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
            if self.hardware.config is not self._config:
                self._change(self._config, now)  # a part that cannot be opened again ends the gateway
        self._notifier.ready()

    def _change(self, config: Config, now: Instant) -> None:
        self.hardware.change(config)
        self.pipeline.change(config, self.hardware.renew, now)
        self._config = config

    def _gather(self, due: float) -> None:
        """Wait for more input, so that fewer wake-ups are needed. `stop` and a due time end the wait."""
        seconds = min(self._config.coalesce, due - self._clock().mono)
        if seconds > 0:
            select.select([self._wake_read], [], [], seconds)

    def _limit(self, now: float) -> int:
        """How many datagrams to read after a wake-up. Also sets the earliest next wake-up.

        One after a quiet time: most datagrams arrive alone, and a second read call would cost more than it finds.
        """
        rested = now - BURST
        if self._rested < rested and not self._config.coalesce:
            self._rested = rested + PACE
            return 1
        self._rested = min(max(self._rested, rested), now) + PACE
        return MOST_AT_ONCE

    def _next_due(self, now: float) -> float:
        due = min(self.pipeline.next_due(now, now + LONGEST_WAIT), self._notifier.next_due())
        return min([due, *(source.next_due() for source in self.hardware.all.sources())])
