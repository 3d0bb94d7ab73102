"""The Python API: `for msg in statuses("udp:127.0.0.1:14550")`.

The gateway runs in its own thread and publishes to a queue. The iterator reads the queue.
"""

from __future__ import annotations

import dataclasses
import itertools
import os
import threading
import weakref
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import Final

from .config import Config, ControllerConfig, LinkConfig, PublisherConfig
from .config import load as load_config
from .errors import UsageError
from .gateway.controller_config import DEFAULT_CONTROLLER
from .gateway.event_loop import EventLoop
from .gateway.replay import ReplayPipeline, open_recording, run_through
from .interface import Publisher, RobotStatusMsg
from .links.url import parse
from .publishers.queue import QueuePublisher
from .streams import NO_OUTPUT

PATIENCE: Final = 5.0  # s for the gateway to end
QUEUE: Final = dataclasses.replace(DEFAULT_CONTROLLER, publishers=(PublisherConfig("queue"),))
"""Publishes every handle to the queue, 10 times a second and at once on a change."""


def statuses(*connections: str, config: Config | str | os.PathLike[str] | None = None) -> Statuses:
    """The statuses of all vehicles on these connections, as an iterator of `RobotStatusMsg`.

    Each message has `.handle` (a name), `.status` (a `RobotStatus`), `.detail` (errors, inhibits, vehicle, link),
    `.unix_us` and `.heartbeat_age`. Messages come 10 times a second for each handle, and at once on a change.
    Messages wait in order for a slow loop: compare `.unix_us` with the present before you act on one.

    `connections` are written as on the command line. One of them may be a recorded log; it is read as fast as the
    loop takes messages, and the iteration ends at the end of the log. On live links the iteration ends with `close`.

    `config` is a configuration or the path of a YAML file. Its links are used if there are no `connections`.
    Its controllers also publish to their own publishers.

    All links and outputs are open when this returns. Raises UsageError, ConfigError (a fault in the arguments or the
    file) and LinkError (a port is taken). The iteration raises the errors of the running gateway.
    """
    loaded = config if isinstance(config, Config) else Config() if config is None else load_config(_path(config))
    if connections:
        loaded = dataclasses.replace(loaded, links=tuple(LinkConfig(connection) for connection in connections))
    if not loaded.links and not loaded.interfaces:
        raise UsageError('no connection given; write for example statuses("udp:127.0.0.1:14550")')
    loaded = dataclasses.replace(loaded, controllers=(*_own_outputs(loaded.controllers), QUEUE))
    logs = [url.device for url in (parse(link.url) for link in loaded.links) if url.kind.is_log]
    if not logs:
        return _live(loaded)
    if len(loaded.links) > 1:
        raise UsageError(f"{logs[0]}: a recorded log is replayed alone, without other connections")
    return _replayed(loaded, logs[0])


def _path(path: str | os.PathLike[str]) -> str:
    """The path as a string. Raises UsageError for anything else."""
    try:
        return os.fsdecode(path)
    except TypeError:
        raise UsageError(f"config: must be a path or a Config, not {path!r}") from None


def _own_outputs(controllers: Iterable[ControllerConfig]) -> list[ControllerConfig]:
    """The controllers that name publishers. The default ones would write to the standard output of the caller."""
    return [controller for controller in controllers if controller.publishers is not None]


def _live(config: Config) -> Statuses:
    gateway = EventLoop(config, NO_OUTPUT)
    return Statuses(_queue(gateway.pipeline.publishers.values()), gateway.run, gateway.stop)


def _replayed(config: Config, log: str) -> Statuses:
    recording = open_recording(log)
    pipeline = ReplayPipeline(config, NO_OUTPUT, recording=recording)
    queue = _queue(pipeline.publishers.values())
    stopped = threading.Event()

    def run() -> None:
        try:
            pipeline.now = run_through(pipeline, itertools.takewhile(lambda _: not stopped.is_set(), recording))
        finally:
            pipeline.close(pipeline.now)

    def stop() -> None:
        stopped.set()
        queue.end()

    return Statuses(queue, run, stop)


def _queue(publishers: Iterable[Publisher]) -> QueuePublisher:
    return next(publisher for publisher in publishers if isinstance(publisher, QueuePublisher))


class _Worker:
    """The gateway in its thread. It holds no reference to the iterator, so an abandoned iterator ends the gateway."""

    def __init__(self, queue: QueuePublisher, run: Callable[[], None], stop: Callable[[], None]) -> None:
        self.queue = queue
        self.error: BaseException | None = None
        self._run = run
        self._stop = stop
        self._thread = threading.Thread(target=self._work, name="mav-robot-status", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        try:
            self._run()
        except BaseException as error:
            self.error = error
        finally:
            self.queue.end()

    def stop(self) -> None:
        """Stop the gateway and wait until it has ended."""
        self._stop()
        self._thread.join(PATIENCE)


class Statuses:
    """An iterator of `RobotStatusMsg`, and a context manager that stops the gateway. Made by `statuses`."""

    def __init__(self, queue: QueuePublisher, run: Callable[[], None], stop: Callable[[], None]) -> None:
        self._worker = _Worker(queue, run, stop)
        self._finalizer = weakref.finalize(self, self._worker.stop)

    @property
    def dropped(self) -> int:
        """Messages that were dropped because the loop was too slow: the oldest of 10,000 that waited."""
        return self._worker.queue.dropped

    def __iter__(self) -> Statuses:
        return self

    def __next__(self) -> RobotStatusMsg:
        """The next message; waits for it. Raises the error that ended the gateway."""
        msg = self._worker.queue.take()
        if msg is not None:
            return msg
        error, self._worker.error = self._worker.error, None
        if error is not None:
            raise error
        raise StopIteration

    def close(self) -> None:
        """Stop the gateway and close its links. Queued messages can still be read. May be called twice."""
        self._finalizer()

    def __enter__(self) -> Statuses:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Close."""
        self.close()
