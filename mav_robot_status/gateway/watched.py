"""A live gateway that somebody watches from another thread: statuses on a board, explanations when asked for, rates."""

from __future__ import annotations

import dataclasses
import logging
import threading
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from ..clock import now as present
from ..config import PublisherConfig
from ..mavlink import definitions as mav
from ..publishers.board import BoardPublisher
from .explain import NO_OUTPUT
from .live import Live
from .plant import DEFAULT_CONTROLLER, Plant

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from types import TracebackType

    from ..clock import Instant
    from ..config import Config
    from ..hardware.tracked import Tracked
    from ..mavlink.framing import Frame
    from ..publishers.board import Entry, Transition

log = logging.getLogger(__name__)

RATE: Final = 4.0
"""Hz at which a board is told again what has not changed; changes come at once."""
AGAIN: Final = 0.25  # s from one explanation to the next
ENOUGH: Final = 3.0  # s over which a rate is measured
SILENCE: Final = 2.0
"""A message that has not come for so many of its periods, and this many seconds, comes no more."""
PATIENCE: Final = 5.0  # s for the gateway to end


class Row(NamedTuple):
    """What is known of one vehicle."""

    line: Mapping[str, Any]
    """Its status: the members of a native JSON line."""
    stamp: str
    """When it was so, RFC 3339."""
    version: int
    """Another number for every change."""
    age: float | None
    """Seconds since the last heartbeat; None if there was none."""
    rates: Mapping[str, float]
    """Hz of the messages that its status is made of, by name."""


class Watched:
    """A gateway in a thread of its own, from `with` on. It shows statuses, and gives them to nobody else."""

    def __init__(self, config: Config, clock: Callable[[], Instant] = present) -> None:
        """Open everything. Raises LinkError, ConfigError."""
        self.now = clock
        self.explained = ""
        """The handle that is to be explained from now on; empty: none."""
        self._explanation: Mapping[str, Any] | None = None
        self._explain_at = 0.0
        self._rates: dict[tuple[int, int], Rates] = {}
        self._error: BaseException | None = None
        self._ended = threading.Event()
        self.gateway = Live(on_a_board(config), NO_OUTPUT, clock)
        plant = self.gateway.plant
        self._board = next(p.board for p in plant.publishers.values() if isinstance(p, BoardPublisher))
        self._lock = threading.Lock()
        """Held by whoever is at the board."""
        self.gateway.plant = cast("Plant", _Shared(plant, self._lock, self._count))
        self.connection = config.links[0].url if len(config.links) == 1 else f"{len(config.links)} links"
        self.advice = f"To find out why: mav-robot-status doctor {config.links[0].url}"
        self._thread = threading.Thread(target=self._run, name="gateway", daemon=True)

    def __enter__(self) -> Watched:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Stop the gateway. Raises what ended it, if it did not end as it should."""
        self.gateway.stop()
        self._thread.join(PATIENCE)
        if self._error is not None:
            raise self._error

    def wait(self, seconds: float) -> bool:
        """Whether the gateway ends within so many seconds."""
        return self._ended.wait(seconds)

    def explanation(self) -> Mapping[str, Any] | None:
        """The latest explanation of what is to be explained (the JSON form of `explain`)."""
        return self._explanation

    @property
    def version(self) -> int:
        """Another number for every change of any vehicle."""
        return self._board.version

    def rows(self) -> list[Row]:
        """What is known of each vehicle, by system, component and handle."""
        with self._lock:
            return [self._row(entry) for entry in self._board]

    def changes(self, handles: Iterable[str], most: int) -> list[tuple[str, Transition]]:
        """The latest changes of these handles, the latest first, each with the handle."""
        with self._lock:
            found = [(handle, change) for handle in handles for change in self._board.entries[handle].transitions]
        return sorted(found, key=lambda named: named[1].at)[: -most - 1 : -1]

    def _row(self, entry: Entry) -> Row:
        now = self.now().mono
        # the heartbeat has aged since the line was written
        age = None if entry.heartbeat_age is None else entry.heartbeat_age + max(0.0, now - entry.at)
        rates = self._rates.get((entry.line["system"], entry.line["component"]))
        return Row(entry.line, entry.stamp, entry.version, age, {} if rates is None else rates.at(now))

    def _run(self) -> None:
        try:
            self.gateway.run(until=self._turned)
        except BaseException as error:
            self._error = error
        finally:
            self._ended.set()

    def _turned(self) -> bool:
        """Explain, between two turns of the loop: only this thread may look into the hardware."""
        now = self.now()
        if self.explained and now.mono >= self._explain_at:
            self._explain_at = now.mono + AGAIN
            self._explanation = self.gateway.plant.explain(self.explained, now)
        return False

    def _count(self, frame: Frame, now: Instant) -> None:
        ids = frame.ids
        rates = self._rates.get(ids)
        if rates is None:
            rates = self._rates[ids] = Rates()
        rates.take(frame.message_id, now.mono)


class _Shared:
    """A plant whose publishers work under a lock, and that tells of every frame of a vehicle."""

    def __init__(self, plant: Plant, lock: threading.Lock, count: Callable[[Frame, Instant], None]) -> None:
        self._plant = plant
        self._lock = lock
        self._count = count

    def __getattr__(self, name: str) -> Any:
        return getattr(self._plant, name)

    def take(self, frame: Frame, now: Instant) -> Tracked | None:
        """Take one frame; the vehicle if it is an autopilot's heartbeat."""
        heard = self._plant.take(frame, now)
        if self._plant.hw.find(*frame.ids) is not None:
            self._count(frame, now)
        return heard

    def tick(self, now: Instant) -> None:
        """Tick, while nobody looks at the board."""
        with self._lock:
            self._plant.tick(now)


class Rates:
    """How often each message of one vehicle comes. No larger than the list of messages that a status is made of."""

    def __init__(self) -> None:
        self._of: dict[int, tuple[float, int, float, float]] = {}
        """By message id: since when, how many since, when the last, and the rate before."""

    def take(self, message_id: int, now: float) -> None:
        """One came."""
        since, count, _, rate = self._of.get(message_id, (now, -1, now, 0.0))
        count += 1
        if now - since >= ENOUGH:
            since, count, rate = now, 0, count / (now - since)
        self._of[message_id] = since, count, now, rate

    def at(self, now: float) -> dict[str, float]:
        """Hz by name; what has fallen silent, or has come only once, is left out."""
        return {
            mav.MESSAGES[message_id].name: rate
            for message_id, (_, _, last, rate) in list(self._of.items())
            if rate > 0 and now - last < SILENCE + SILENCE / rate
        }


def on_a_board(config: Config) -> Config:
    """The configuration with a board as its only output."""
    controller = dataclasses.replace(
        DEFAULT_CONTROLLER, parameters={"publish_rate": RATE}, publishers=(PublisherConfig("board"),)
    )
    return dataclasses.replace(config, controllers=(controller,), outs=(), forward=False, record=None)
