"""The latency of a vehicle beside an arm whose controller sends garbage as fast as it is read."""

from __future__ import annotations

import contextlib
import socket
import threading
from statistics import median, quantiles
from typing import TYPE_CHECKING, Any

from ..case import Bench, Case, Found
from ..process import free_port
from ..results import FIRST_MACHINE, OURS, Sample, Target
from .latency import P50, P99, TIMES, times_of

if TYPE_CHECKING:
    from collections.abc import Iterator

SETUP = "HEARTBEAT to JSON line, beside an arm that sends garbage"
VEHICLE = "industrial_robot_status_handle"
GARBAGE = bytes(range(3, 256)) * 200


def measure(bench: Bench) -> Found:
    """One round."""
    port = free_port()
    with _garbage() as arm, bench.contenders.start_ours(port, "--arm", f"ur:127.0.0.1:{arm}", pipe=True) as child:
        child.listens(port)
        times = sorted(times_of(child, port, _powered, bench.number(TIMES)))
    yield Sample(SETUP, P50, OURS, median(times))
    yield Sample(SETUP, P99, OURS, quantiles(times, n=100)[98])


def _powered(line: dict[str, Any]) -> Any:
    """Whether the vehicle has power; None for a line of another handle."""
    return line["drives_powered"] if line["handle"] == VEHICLE else None


@contextlib.contextmanager
def _garbage() -> Iterator[int]:
    """A server that sends garbage to each client; its port."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            while True:
                try:
                    client, _ = server.accept()
                except OSError:  # the server is closed
                    return
                with client, contextlib.suppress(OSError):
                    while True:
                        client.sendall(GARBAGE)

        threading.Thread(target=serve, daemon=True).start()
        yield int(server.getsockname()[1])


CASE = Case(
    "arm",
    "Beside a bad arm",
    measure,
    (Target(SETUP, P99, "latency beside a bad arm, p99: below 5 ms", 5000.0, machine=FIRST_MACHINE),),
)
