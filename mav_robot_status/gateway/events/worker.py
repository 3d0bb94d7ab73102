"""Runs jobs off the loop, one after the other, in one thread: what waits for a disk or takes long."""

from __future__ import annotations

import logging
import queue
import threading
from typing import TYPE_CHECKING, Final, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable

log = logging.getLogger(__name__)

PATIENCE: Final = 2.0  # s for the jobs to end

T = TypeVar("T")


class Worker:
    """A thread that starts with the first job. It does not keep the program from ending."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._jobs: queue.SimpleQueue[Callable[[], Callable[[], None]] | None] = queue.SimpleQueue()
        self._done: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._outstanding = 0
        self._thread: threading.Thread | None = None

    @property
    def busy(self) -> bool:
        """Whether a result is outstanding."""
        return self._outstanding > 0

    def do(self, job: Callable[[], T], then: Callable[[T], None]) -> None:
        """Run `job` in the thread. `finish` calls `then` with its result. A job that raises has none, and is logged."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._thread.start()
        self._outstanding += 1
        self._jobs.put(lambda: _bound(then, job()))

    def finish(self) -> None:
        """Take the results, in the thread of the caller. Never waits."""
        while not self._done.empty():
            self._outstanding -= 1
            self._done.get()()

    def close(self) -> None:
        """Wait a moment for the jobs, so that no file stays half written."""
        if self._thread is not None:
            self._jobs.put(None)
            self._thread.join(PATIENCE)

    def _run(self) -> None:
        while True:
            job = self._jobs.get()
            if job is None:
                return
            try:
                self._done.put(job())
            except Exception:
                log.exception("%s", self._name)
                self._done.put(lambda: None)


def _bound(then: Callable[[T], None], result: T) -> Callable[[], None]:
    return lambda: then(result)
