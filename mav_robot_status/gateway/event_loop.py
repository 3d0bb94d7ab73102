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
from .controller_config import check
from .links.arrival import LATE, STALL
from .live_hardware import LiveHardware
from .metrics import metrics
from .pace import MOST_AT_ONCE, UNCOUNTED, Pace
from .pipeline import Pipeline
from .systemd import SystemdNotifier

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from typing import TextIO

    from ..clock import Instant
    from ..config import Config
    from ..interface import IoSource, Metrics
    from .links.endpoint import Endpoint
    from .observer import Observer

log = logging.getLogger(__name__)

LONGEST_WAIT: Final = 1.0  # s
MOST_AFTER_PAUSE: Final = 8 * MOST_AT_ONCE
"""Datagrams read after a pause. Enough for a full socket buffer: it should be read before the next status."""


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
        self._pace = Pace(config.coalesce)
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
            opened.callback(lambda: self.pipeline.close(clock()))
            self.hardware.open()
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
                soon = next_due()
                if now.mono >= due or now.mono >= soon:  # most input changes no status, and needs no turn
                    self.turn(now)
                    due = self._prepare(poll, now.mono)
                    now = self._clock()
                elif soon < due:
                    due = soon
                wait = rest = due - now.mono
                if now.mono < self._pace.rests_until:
                    rest -= self._rest(now.mono, due)
                # poll takes whole milliseconds: rounding down would make the loop spin until the due time
                events = poll.poll(math.ceil(rest * 1000) if rest > 0 else 0)
                now = self._clock()
                if events:
                    self._receive(events, looked, now, wait)
                looked = now
        finally:
            self.close()

    def _receive(self, events: Sequence[tuple[int, int]], looked: Instant, now: Instant, wait: float) -> None:
        """Read the sources that have input. `looked` is the last look at them."""
        late = now.mono - looked.mono > LATE
        limit = self._look_late(looked, now, wait) if late else MOST_AT_ONCE
        for descriptor, _ in events:
            source = self._polled.get(descriptor)
            if source is not None:
                read = source.receive(now, limit)
                self._pace.count(UNCOUNTED if read is None else read, now.mono)

    def _look_late(self, looked: Instant, now: Instant, wait: float) -> int:
        """Tell the links that their input may be old. Returns how many datagrams to read.

        `looked` is the instant of the last look at the links, `wait` how many seconds the loop wanted to wait.
        """
        stalled = now.mono - looked.mono > max(wait, 0.0) + STALL
        self.hardware.mavlink.hub.receiver.pause(looked, now, stalled=stalled)
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

    def _prepare(self, poll: select.poll, now: float) -> float:
        """After a turn: watch the sources that have a descriptor now. Returns when the next turn is due."""
        due = min(self._notifier.next_due(), now + LONGEST_WAIT)
        found = {}
        for source in self.hardware.all.sources():
            descriptor = source.fileno()
            if descriptor >= 0:
                found[descriptor] = source
            due = min(due, source.next_due())
        due = min(due, self.pipeline.next_due(now, due))
        if found.keys() != self._polled.keys():
            for descriptor in self._polled.keys() - found.keys():
                poll.unregister(descriptor)
            for descriptor in found.keys() - self._polled.keys():
                poll.register(descriptor, select.POLLIN)
        self._polled = found
        return due

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
        self._pace = Pace(config.coalesce)
        self._config = config

    def _rest(self, now: float, due: float) -> float:
        """Let input gather. A due time ends the rest, and `stop` ends a long one. Returns the seconds it took."""
        rest = min(self._pace.rests_until, due) - now
        if rest <= 0:
            return 0.0
        if self._pace.gather:
            select.select([self._wake_read], [], [], rest)
        else:
            time.sleep(rest)
        return rest
