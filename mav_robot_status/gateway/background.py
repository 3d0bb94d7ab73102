"""A live gateway in a thread, for a view in another: statuses, an explanation on request, message rates."""

from __future__ import annotations

import dataclasses
import logging
import threading
from typing import TYPE_CHECKING, Final, NamedTuple

from ..clock import now as present
from ..config import PublisherConfig
from ..mavlink import definitions as mav
from ..publishers.board import BoardPublisher
from ..streams import NO_OUTPUT
from .controller_config import DEFAULT_CONTROLLER
from .event_loop import EventLoop
from .observer import Observer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from types import TracebackType

    from ..clock import Instant
    from ..config import Config
    from ..interface import IndustrialRobotStatusInterface
    from ..json_object import JsonMapping
    from ..mavlink.framing import Frame
    from ..publishers.board import Entry, Transition

log = logging.getLogger(__name__)

RATE: Final = 4.0
"""Hz of the periodic statuses on the board. Changes come at once."""
EXPLAIN_PERIOD: Final = 0.25  # s
RATE_WINDOW: Final = 3.0  # s over which a rate is measured
SILENCE: Final = 2.0
"""A message has no rate after a silence of this many of its periods plus this many seconds."""
PATIENCE: Final = 5.0  # s to wait for the gateway to end


class Row(NamedTuple):
    """The present state of one vehicle."""

    line: JsonMapping
    """Its status: the members of a native JSON line."""
    stamp: str
    """The time of the status, RFC 3339."""
    version: int
    """Changes with every change of the status."""
    age: float | None
    """Seconds since the last heartbeat; None if there was none."""
    rates: Mapping[str, float]
    """Hz by message name, for the messages that a status uses."""


class BackgroundGateway(Observer):
    """A gateway in its own thread; `with` starts and stops it. It publishes to the board, and to those `beside` it."""

    def __init__(
        self, config: Config, clock: Callable[[], Instant] = present, *, beside: Iterable[PublisherConfig] = ()
    ) -> None:
        """Open everything. Raises LinkError, ConfigError."""
        self.now = clock
        self.explained = ""
        """The handle to explain; empty: none."""
        self._explanation: JsonMapping | None = None
        self._explain_at = 0.0
        self._rates: dict[tuple[int, int], Rates] = {}
        self._error: BaseException | None = None
        self._ended = threading.Event()
        self.gateway = EventLoop(on_a_board(config, beside), NO_OUTPUT, clock, observers=[self])
        publishers = self.gateway.pipeline.publishers.values()
        publisher = next(p for p in publishers if isinstance(p, BoardPublisher))
        self._board, self._lock = publisher.board, publisher.lock
        self.connection, self.advice = _source(config)
        self._thread = threading.Thread(target=self._run, name="gateway", daemon=True)

    def __enter__(self) -> BackgroundGateway:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Stop the gateway. Raises the error that ended it, if there was one."""
        self.gateway.stop()
        self._thread.join(PATIENCE)
        if self._error is not None:
            raise self._error

    def wait(self, seconds: float) -> bool:
        """Wait for the end of the gateway, at most `seconds`. True if it has ended."""
        return self._ended.wait(seconds)

    def explanation(self) -> JsonMapping | None:
        """The latest explanation of the handle in `explained`, as `explain --as-json` prints it."""
        return self._explanation

    @property
    def version(self) -> int:
        """Changes with every change of any vehicle."""
        return self._board.version

    def rows(self) -> list[Row]:
        """The state of each vehicle, sorted by system, component and handle."""
        with self._lock:
            return [self._row(entry) for entry in self._board]

    def changes(self, handles: Iterable[str], most: int) -> list[tuple[str, Transition]]:
        """The latest changes of these handles, newest first, each with its handle."""
        with self._lock:
            entries = ((handle, self._board.entries.get(handle)) for handle in handles)
            found = [(handle, change) for handle, entry in entries if entry is not None for change in entry.transitions]
        return sorted(found, key=lambda named: named[1].at)[: -most - 1 : -1]

    def _row(self, entry: Entry) -> Row:
        now = self.now().mono
        # the line contains the age at the time of writing
        age = None if entry.heartbeat_age is None else entry.heartbeat_age + max(0.0, now - entry.at)
        rates = None  # a group receives nothing itself
        if not entry.line.get("members"):
            rates = self._rates.get((entry.line["system"], entry.line["component"]))
        return Row(entry.line, entry.stamp, entry.version, age, {} if rates is None else rates.at(now))

    def _run(self) -> None:
        try:
            self.gateway.run()
        except BaseException as error:
            self._error = error
        finally:
            self._ended.set()

    # in the gateway's thread

    def on_frame(self, frame: Frame, now: Instant) -> None:
        """Count it."""
        rates = self._rates.get(frame.ids)
        if rates is None:
            rates = self._rates[frame.ids] = Rates()
        rates.take(frame.message_id, now.mono)

    def on_tick(self, handles: IndustrialRobotStatusInterface, now: Instant) -> None:
        """Update the explanation. Only this thread may read the hardware interface."""
        if len(self._rates) > len(handles):  # some vehicles are gone
            present = {(handle.detail.system, handle.detail.component) for handle in handles}
            self._rates = {ids: rates for ids, rates in self._rates.items() if ids in present}
        if self.explained and now.mono >= self._explain_at:
            self._explain_at = now.mono + EXPLAIN_PERIOD
            self._explanation = self.gateway.pipeline.explain(self.explained, now)


def _source(config: Config) -> tuple[str, str]:
    """The name of the source, and advice while no vehicle is heard."""
    names = [*(link.url for link in config.links), *(interface.name for interface in config.interfaces)]
    advice = f"To find out why: mav-robot-status doctor {config.links[0].url}" if config.links else ""
    if len(names) == 1:
        return names[0], advice
    return f"{len(names)} {'robots' if config.interfaces else 'links'}", advice


class Rates:
    """The rate of each message of one vehicle. Bounded by the list of messages that a status uses."""

    def __init__(self) -> None:
        self._of: dict[int, tuple[float, int, float, float]] = {}
        """By message id: start of the window, messages in it, time of the last one, rate of the previous window."""

    def take(self, message_id: int, now: float) -> None:
        """Count one message."""
        since, count, _, rate = self._of.get(message_id, (now, -1, now, 0.0))
        count += 1
        if now - since >= RATE_WINDOW:
            since, count, rate = now, 0, count / (now - since)
        self._of[message_id] = since, count, now, rate

    def at(self, now: float) -> dict[str, float]:
        """Hz by name, without messages that are silent or arrived only once."""
        return {
            mav.MESSAGES[message_id].name: rate
            for message_id, (_, _, last, rate) in list(self._of.items())
            if rate > 0 and now - last < SILENCE + SILENCE / rate
        }


def on_a_board(config: Config, beside: Iterable[PublisherConfig] = ()) -> Config:
    """The configuration with a board, and with the publishers beside it, as its only outputs."""
    controller = dataclasses.replace(
        DEFAULT_CONTROLLER, parameters={"publish_rate": RATE}, publishers=(PublisherConfig("board"), *beside)
    )
    return dataclasses.replace(config, controllers=(controller,), outs=(), forward=False, record=None)
