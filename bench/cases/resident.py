"""Resident memory of four ways to run the gateway, each after 20 s of one vehicle at 80 frames a second."""

from __future__ import annotations

import contextlib
import os
import pty
import shutil
import socket
import threading
from contextlib import ExitStack
from typing import TYPE_CHECKING

from ..case import Bench, Case, Found
from ..feed import Feed
from ..process import Child, free_port
from ..results import OURS, Sample, Skip, Target

if TYPE_CHECKING:
    from collections.abc import Iterator

RESIDENT = "resident after 20 s, MB"
RATE, SECONDS = 80, 20.0
RUN, HTTP, MQTT, WATCH = "run", "run with --http", "run with --mqtt", "watch"


def measure(bench: Bench) -> Found:
    """One round. All of them run at the same time."""
    skipped: list[Skip] = []
    with ExitStack() as ended:
        running = {}
        for setup in (RUN, HTTP, MQTT, WATCH):
            port = free_port()
            child = _start(bench, setup, port, ended)
            if child is None:
                skipped.append(Skip(setup, OURS, "the program mosquitto is not installed"))
                continue
            child.listens(port)
            running[setup] = child, ended.enter_context(Feed(bench.frames(), port))
        for _, feed in running.values():
            feed.begin(RATE, 4.0 if bench.quick else SECONDS)
        for _, feed in running.values():
            feed.end()
        for setup, (child, _) in running.items():
            yield Sample(setup, RESIDENT, OURS, child.memory())
    yield from skipped


def _start(bench: Bench, setup: str, port: int, ended: ExitStack) -> Child | None:
    """One of them; None if the broker that it needs is missing."""
    ours = bench.contenders.start_ours
    if setup == RUN:
        return ended.enter_context(ours(port))
    if setup == HTTP:
        return ended.enter_context(ours(port, "--http", f"127.0.0.1:{_free_tcp_port()}"))
    if setup == MQTT:
        broker = shutil.which("mosquitto") or shutil.which("mosquitto", path="/usr/sbin:/sbin")
        if broker is None:
            return None
        at = _free_tcp_port()
        ended.enter_context(Child([broker, "-p", str(at)]))
        return ended.enter_context(ours(port, "--mqtt", f"mqtt://127.0.0.1:{at}/robots"))
    terminal = ended.enter_context(_terminal())
    command = bench.contenders.ours("watch", f"udpin:127.0.0.1:{port}")
    return ended.enter_context(Child(command, terminal=terminal, env={**os.environ, "TERM": "xterm-256color"}))


@contextlib.contextmanager
def _terminal() -> Iterator[int]:
    """The descriptor of a terminal that somebody reads."""
    reader, terminal = pty.openpty()

    def drain() -> None:
        with contextlib.suppress(OSError):  # the terminal is closed
            while os.read(reader, 1 << 16):
                pass

    thread = threading.Thread(target=drain)
    thread.start()
    try:
        yield terminal
    finally:
        os.close(terminal)
        thread.join()
        os.close(reader)


def _free_tcp_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as any_port:
        return int(any_port.getsockname()[1])


CASE = Case(
    "resident",
    "Resident memory of the commands",
    measure,
    (
        Target(RUN, RESIDENT, "resident memory of run: at most 20 MB", 20.0),
        Target(HTTP, RESIDENT, "resident memory of run with --http: at most 36 MB", 36.0),
    ),
)
